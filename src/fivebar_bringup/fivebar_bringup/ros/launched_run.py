# SPDX-License-Identifier: Apache-2.0
"""The process of a run under ROS' own launch: it is interrupted with the launch, which ends and fails with it."""

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence

from launch.actions import EmitEvent, ExecuteProcess, RegisterEventHandler
from launch.event_handlers import OnProcessExit, OnShutdown
from launch.events import Shutdown
from launch.events.process import ProcessExited, SignalProcess
from launch.launch_context import LaunchContext
from launch.launch_description_entity import LaunchDescriptionEntity

STOP_TIMEOUT = "120"
"""Time (s) for the run to stop its nodes in order after an interrupt, the recorder last; longer than the run itself
waits."""


def launched_run(command: Sequence[str]) -> list[LaunchDescriptionEntity]:
    """Return the process of a run, and what ties the launch to it."""
    # colours and a progress bar are for a terminal, and not for the file into which a launch is redirected
    run = ExecuteProcess(
        cmd=list(command),
        name="fivebar_run",
        output="screen",
        sigterm_timeout=STOP_TIMEOUT,
        emulate_tty=sys.stdout.isatty() and sys.stderr.isatty(),
    )

    def interrupt(event: Shutdown, context: LaunchContext) -> list[LaunchDescriptionEntity]:
        """Interrupt the run with a launch that takes its own interrupt for a Ctrl-C, which every process has got."""
        if context.noninteractive or not event.due_to_sigint:
            return []
        passed_on = SignalProcess(
            signal_number=signal.SIGINT,
            process_matcher=lambda action: action is run and run.process_details is not None,
        )
        return [EmitEvent(event=passed_on)]

    return [
        run,
        RegisterEventHandler(OnProcessExit(target_action=run, on_exit=_end_with_run)),
        RegisterEventHandler(OnShutdown(on_shutdown=interrupt)),
    ]


def _end_with_run(event: ProcessExited, context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Shut the launch down; fail if the run failed."""
    if event.returncode != 0:
        raise RuntimeError(f"the run did not succeed: exit status {event.returncode}")
    return [EmitEvent(event=Shutdown(reason="the run has ended"))]
