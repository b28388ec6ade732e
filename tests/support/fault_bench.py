# SPDX-License-Identifier: Apache-2.0
"""The graph of an experiment with every node a process of its own, on drives that can be broken."""

from __future__ import annotations

import contextlib
import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from forked_node import ForkedNode, end_with_parent
from graph_probe import DEADLINE, Bench, Probe
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from std_srvs.srv import Trigger

from fivebar_bringup.bag import RECORDER
from fivebar_bringup.drives.choice import kind_of, write_drive_files
from fivebar_bringup.drives.run_files import Rehearsal
from fivebar_bringup.graph.crossing_graph import crossing_graph
from fivebar_bringup.graph.node_spec import EMULATED_ROBOT, Mode, Sharing
from fivebar_bringup.runs.processes import ProcessSpec, processes
from fivebar_bringup.scenario import Scenario
from fivebar_description.interface import (
    ALL_WELL,
    CTC_TORQUE,
    DRIVES_STATE,
    FAULTS,
    JOINT_STATES,
    MOTOR_STATES,
    REFERENCE,
    RUN_READY,
    RUN_STATUS,
    SAFETY_STATE,
    SUPERVISOR_STATE,
    TORQUE_COMMAND,
    UNIFIED_TORQUE,
    Topic,
)
from fivebar_description.ros.scheduling import Scheduling
from fivebar_description.scenario_file import FILE_OF_RUN
from fivebar_vendor_drives.kinds import MOTKIN_BOARD

PRIORITY = 20
"""Under SCHED_FIFO where that is granted: what is tested are cycles of the clock, on a machine with other work."""

NOT_RUN = ("imu_listener", EMULATED_ROBOT)

OF_EMULATED_ROBOT = ("ground_truth", "imu/data")
"""Topics that nobody publishes here."""

ATTEMPTS = 3
"""How often a motion is begun, or held, where a busy machine misses cycles: what is tested comes after that."""

NO_TORQUE = 1e-6
"""Torque (Nm) that is none: the current of a board decays."""

AT_REST = 0.05
"""Speed (rad/s) of the fastest joint below which the robot rests: integrated in steps of 1 ms, friction lets the light
links of the bench creep at 0.02 rad/s."""

WITNESSED_DRIVES = Path(__file__).with_name("witnessed_drives.py")


class Look(NamedTuple):
    """What the drives' process tells: SYNCs heard so far, both torques (Nm) since, fastest joint (rad/s)."""

    syncs: int
    first: float
    second: float
    speed: float

    @property
    def zero(self) -> bool:
        return self.first == self.second == 0.0


class DrivesProcess:
    """The emulated drives in a process of their own, as hardware is, and what torque they gave at every SYNC."""

    def __init__(self, file: Path, priority: int) -> None:
        self.log: list[Look] = []
        self._obeyed: queue.SimpleQueue[Look] = queue.SimpleQueue()
        self._process = subprocess.Popen(
            [sys.executable, str(WITNESSED_DRIVES), str(file), str(priority)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            preexec_fn=end_with_parent,
        )
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            word, syncs, *others = line.split()
            look = Look(int(syncs), *map(float, others))
            self.log.append(look)
            if word == "obeyed":
                self._obeyed.put(look)

    def order(self, *lines: str) -> int:
        """Have lines of the drives' protocol obeyed; return how many SYNCs had been heard when the last one was."""
        assert self._process.stdin is not None
        for line in lines:
            self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()
        return [self._obeyed.get(timeout=DEADLINE) for _ in lines][-1].syncs

    def at_rest(self) -> bool:
        return self.log[-1].speed < AT_REST

    def stopped_at(self) -> int | None:
        """Return the SYNC since which there is no torque, None while there is some."""
        found = None
        for look in reversed(self.log):
            if not look.zero:
                break
            found = look.syncs
        return found

    def close(self) -> None:
        self._process.terminate()
        self._process.communicate(timeout=DEADLINE)


class FaultBench:
    """The nodes, the drives, and a probe that breaks and mends them."""

    def __init__(self, bench: Bench, folder: Path, scenario: Scenario) -> None:
        self.bench, self.scenario = bench, scenario
        self.period = 1.0 / scenario.rate_hz
        self.bag = folder / "bag"
        files = write_drive_files(scenario, folder)
        (folder / FILE_OF_RUN).write_text(scenario.to_yaml(), encoding="utf-8")
        kind = kind_of(scenario)
        self.bridge = kind.bridge
        self.mend = ("mend",) if kind.name == MOTKIN_BOARD.name else ("mend 1", "mend 2", "bus_on")
        """What ends all that was broken."""
        self.drives = DrivesProcess(files.emulation, PRIORITY + 1)
        nodes = crossing_graph(scenario, Mode.REALTIME, self.bag, Rehearsal(files))
        specs = processes(nodes, Mode.REALTIME, scenario.rate_hz, Scheduling(PRIORITY), sharing=Sharing.NONE)
        self._specs = {spec.name: self._changed(spec) for spec in specs if spec.name not in NOT_RUN}
        self._folder = folder
        for name, spec in self._specs.items():
            (folder / f"{name}.yaml").write_text(spec.parameter_file(), encoding="utf-8")
        self.processes: dict[str, ForkedNode] = {}
        self.probe: Probe = bench.probe()
        self.probe.advertise(RUN_STATUS)
        self.probe.listen(FAULTS, SAFETY_STATE, DRIVES_STATE, MOTOR_STATES, JOINT_STATES)
        self.probe.listen(CTC_TORQUE, UNIFIED_TORQUE, SUPERVISOR_STATE, REFERENCE, TORQUE_COMMAND)
        for name in self._specs:
            self.start(name)
        self.wait_ready(set(self._specs))
        # obeyed once the drives are on the bus
        self.drives.order("home")
        self.change(Transition.TRANSITION_CONFIGURE)
        self.running = False

    def _changed(self, spec: ProcessSpec) -> ProcessSpec:
        """A bridge that waits to be asked."""
        (node,) = spec.nodes
        awaited = [name for name in node.parameters.get("wait_for_nodes", ()) if name not in NOT_RUN]
        changes = {
            self.bridge: {"autostart": False, "wait_for_nodes": awaited},
            RECORDER: {
                "topics": [name for name in node.parameters.get("topics", ()) if name not in OF_EMULATED_ROBOT],
                "wait_for_nodes": awaited,
            },
        }.get(node.executable, {})
        return spec._replace(nodes=(node._replace(parameters={**node.parameters, **changes}),))

    def start(self, name: str) -> None:
        """Start a process of the graph, or start it again."""
        (node,) = self._specs[name].nodes
        file = self._folder / f"{name}.yaml"
        self.processes[name] = self.bench.fork(node.module, ["--ros-args", "--params-file", str(file)])

    def kill(self, name: str, number: signal.Signals = signal.SIGKILL) -> None:
        self.processes[name].send(number)

    def wait_ready(self, names: set[str], after: int = 0) -> None:
        ready = self.probe.got(RUN_READY)
        self.probe.wait_for(lambda: names <= {one.data for one in ready[after:]}, f"{names} ready", 60.0)

    def restart(self, name: str) -> None:
        """Start a killed process again and wait until it has joined."""
        after = len(self.probe.got(RUN_READY))
        self.start(name)
        self.wait_ready({name}, after)

    def change(self, transition: int) -> bool:
        request = ChangeState.Request(transition=Transition(id=transition))
        return bool(self.probe.call(ChangeState, f"/{self.bridge}/change_state", request).success)

    def ask(self, node: str, service: str) -> Trigger.Response:
        return self.probe.call(Trigger, f"/{node}/{service}", Trigger.Request())

    def sample(self, topic: Topic = JOINT_STATES) -> int:
        """The newest sample on a topic, -1 before the first; of `joint_states`, what the controllers know of."""
        messages = self.probe.got(topic)
        return self._number(messages[-1]) if messages else -1

    def _number(self, message: Any) -> int:
        return self.probe.sample(message, self.scenario.rate_hz) or 0

    def sample_without_torque(self) -> int:
        """The sample since which the drives have measured no torque, -1 while they measure some."""
        found = -1
        for message in reversed(self.probe.got(MOTOR_STATES)):
            if max(map(abs, message.effort)) > NO_TORQUE:
                break
            found = self._number(message)
        return found

    def begin(self) -> None:
        """Begin the motion anew, from home; again where a busy machine has missed its first samples."""
        if not any(self._begun() for _ in range(ATTEMPTS)):
            pytest.fail(f"no beginning in {ATTEMPTS} times")

    def _begun(self) -> bool:
        if self.running:
            assert self.change(Transition.TRANSITION_DEACTIVATE)
        self.drives.order(*self.mend, "home")
        self.probe.got(JOINT_STATES).clear()
        self.running, known = False, len(self.faults())
        # once more where a busy machine has left the bridge without an answer for two cycles
        self.probe.wait_for(self._activated, "an active bridge")
        self.running = True
        self.probe.wait_for(lambda: self.sample() > 0 or "estimate_lost" in self.faults()[known:], "the first samples")
        return self.sample() > 0

    def _activated(self) -> bool:
        return self.change(Transition.TRANSITION_ACTIVATE) or (self.ask(self.bridge, "reset").success and False)

    def run_to(self, sample: int) -> bool:
        """Let the motion get to a sample; return whether it has, and was not stopped on the way."""
        self.probe.wait_for(lambda: self.sample() >= sample or self.stopped(), f"sample {sample}")
        return not self.stopped()

    def stopped(self) -> bool:
        """Whether the blender or the bridge says that it has stopped the robot."""
        return any(told[-1].data != ALL_WELL for told in map(self.probe.got, (SAFETY_STATE, DRIVES_STATE)) if told)

    def faults(self) -> list[str]:
        return [one.data.partition(":")[0] for one in self.probe.got(FAULTS)]

    def wait_for_fault(self, known: int) -> str:
        """Return the name of the first fault after so many."""
        self.probe.wait_for(lambda: len(self.faults()) > known, "a fault")
        return self.faults()[known]

    def stopped_at(self) -> int:
        """Wait until both motors have no torque, and return the SYNC since which they have none."""
        return self.probe.wait_for(self.drives.stopped_at, "no torque")

    def expect_no_torque_for(self, seconds: float) -> None:
        """Nothing enables by itself."""
        known = len(self.drives.log)
        self.probe.spin_for(seconds)
        assert all(look.zero for look in self.drives.log[known - 1 :])

    def wait_for_rest(self) -> None:
        self.probe.wait_for(self.drives.at_rest, "the robot at rest")

    def enable_drives(self) -> None:
        """Reset the bridge and enable the drives; again where a busy machine has lost two cycles meanwhile."""

        def enabled() -> bool:
            assert self.drives.log[-1].zero
            return self.ask(self.bridge, "reset").success and self.ask(self.bridge, "enable").success

        self.probe.wait_for(enabled, "drives that are enabled")

    def reset_blender(self) -> Trigger.Response:
        """Ask for a reset until the estimate, too, is at rest; return the last answer."""
        answers: list[Trigger.Response] = []

        def done() -> bool:
            self.probe.spin_for(2 * self.period)
            answers.append(self.ask("blender", "reset"))
            if "drives are stopped" in answers[-1].message:
                self.enable_drives()
            waits = ("still turn", "no sample", "drives are stopped", "tracking_lost", "over_speed")
            return answers[-1].success or not any(text in answers[-1].message for text in waits)

        self.probe.wait_for(done, "an answer other than 'not yet'")
        return answers[-1]

    def stop_recorder(self) -> None:
        """End the recording; the blender's last word is in it."""
        self.drives.order(*self.mend)
        self.ask("blender", "emergency_stop")
        self.probe.wait_for(lambda: self.drives.log[-1].zero, "no torque")
        self.kill(RECORDER, signal.SIGINT)
        self.processes[RECORDER].wait()

    def close(self) -> None:
        """Kill what is left: that nodes end in order is not what is tested here."""
        for process in self.processes.values():
            process.close()
        self.drives.close()


@contextlib.contextmanager
def fault_bench(folder: Path, scenario: Scenario) -> Iterator[FaultBench]:
    """A bench that is closed whatever happens."""
    folder.mkdir(parents=True, exist_ok=True)
    with ordered_priority(), Bench(folder) as bench:
        made = FaultBench(bench, folder, scenario)
        try:
            yield made
        finally:
            made.close()


@contextlib.contextmanager
def ordered_priority() -> Iterator[None]:
    """Run this thread, and what it starts, a little below the nodes' priority where that is granted.

    Whoever breaks something is not held up by other work between noting the time and doing it.
    """
    me = threading.get_native_id()
    try:
        os.sched_setscheduler(me, os.SCHED_FIFO, os.sched_param(PRIORITY - 1))
    except PermissionError:
        yield
        return
    try:
        yield
    finally:
        os.sched_setscheduler(me, os.SCHED_OTHER, os.sched_param(0))
