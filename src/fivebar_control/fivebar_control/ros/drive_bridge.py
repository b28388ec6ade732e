# SPDX-License-Identifier: Apache-2.0
"""Lifecycle node for the robot's two drives: publishes motor measurements, sends torque commands, stops on any fault.

Nodes that derive from it say what the drives are. configure opens and sets up the drives, with their power stages off;
activate enables both at zero torque; deactivate commands zero torque first, then disables them; cleanup releases them
and closes their bus or port. A fault of the drives or of any other node is latched: zero torque and a quick stop, until
~/reset and ~/enable.
"""

from __future__ import annotations

import functools
import json
import os
import time
import traceback
from collections.abc import Callable, Mapping

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNodeMixin, LifecycleState, TransitionCallbackReturn
from rclpy.timer import Timer
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fivebar_control.fault import Fault
from fivebar_control.hardware.configuration import MICROSECONDS
from fivebar_control.hardware.drive_connection import DriveConnection
from fivebar_control.hardware.drive_session import LATE_PERIODS, REPEAT_PERIOD, DriveSession
from fivebar_control.ros.inner_loop_targets import InnerLoopTargets
from fivebar_control.ros.node_settings import BridgeSettings
from fivebar_control.safety.brake import BRAKED_FAULTS
from fivebar_control.scenario.keys import STOPPING
from fivebar_control.scenario.law_settings import section_law
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_control.scenario.stopping import brake_limit, stop_cycles
from fivebar_description.errors import unwrapped
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    CONTROL_QOS,
    DRIVES_STATE,
    FAULTS,
    MOTOR_STATES,
    NANOSECONDS,
    RUN_READY,
    RUN_STATUS,
    TORQUE_COMMAND,
    TORQUE_LATENCY,
    unexpected_sample,
)
from fivebar_description.joint_sample import JointSample, MessageError, OneAnswer, fields_of
from fivebar_description.ros.file_parameters import FileParameters
from fivebar_description.ros.latency_watch import LatencyWatch
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.run_agreement import TimeKeeper
from fivebar_description.run_plan import next_epoch
from fivebar_description.strict_yaml import InputError

COMMANDED = fields_of(ACTIVE_JOINTS, "effort")
"""Reads a torque command (Nm)."""

SOONER = 3
"""Cycles by which the bridge reports missing answers sooner than the blender tolerates them: it knows the cause, and
there is time for a frame that takes the torque."""

READY_TIME = 20.0
"""Longest time (s) for which configure waits for the nodes of the run."""

LONGEST_WAIT_NS = 60 * NANOSECONDS
"""Time (ns) after which an unanswered sample 0 gets a new stamp, since stamps are to be those of the clock; long enough
to answer it by hand."""

Transition = Callable[["DriveBridge", LifecycleState], TransitionCallbackReturn]

SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


def _logged(transition: Transition) -> Transition:
    """Log an exception raised in a transition: rclpy calls on_error without logging it."""

    @functools.wraps(transition)
    def run(self: DriveBridge, state: LifecycleState) -> TransitionCallbackReturn:
        try:
            return transition(self, state)
        except Exception:
            self.get_logger().error(f"{transition.__name__} failed:\n{traceback.format_exc()}")
            raise

    return run


class DriveBridge(LifecycleNodeMixin, GraphNode):
    """The bridge between the graph and the drives: lifecycle transitions, topics and services of a `DriveSession`."""

    in_chain = True
    commands_robot = True

    def __init__(self, name: str, connect: Callable[[str], DriveConnection], default: str) -> None:
        """Make the node, unconfigured.

        Args:
            name: name of the node.
            connect: reads the configuration of the drives, given by name or path.
            default: name of the configuration by default.
        """
        GraphNode.__init__(self, name)
        settings = self.declare_settings(BridgeSettings, drives=default)
        known = connect(settings.drives)
        scenario = FileParameters(self, ControlScenario, STOPPING, section_law).file
        self._rate_hz = scenario.rate_hz
        if self._rate_hz * known.period_us != MICROSECONDS:
            raise InputError(
                f"{name}: rate_hz: {self._rate_hz}: expected {MICROSECONDS // known.period_us}, which is"
                f" {known.period_key} {known.period_us} of {settings.drives}"
            )
        self._run = TimeKeeper(self, self._rate_hz)
        self._brake_limit = brake_limit(scenario)
        self._tend_period = known.tend_period
        timeout_ms = settings.command_timeout_ms
        held = stop_cycles(scenario)
        timeout = held / self._rate_hz if timeout_ms is None else timeout_ms / 1e3
        # less than the blender tolerates, so that the bridge, which knows what is missing, reports the fault
        opens = functools.partial(known.open, max(0, held - SOONER))
        self._session = DriveSession(
            opens, self._rate_hz, timeout, settings.enable_timeout_s, self._on_latch, name, known.waits
        )
        self._timer: Timer | None = None
        self._bell = known.bell
        self._rung = False
        self._cycled = self._read = 0.0
        self._latency = LatencyWatch()
        if self._bell is not None:
            self._bell.heard = self._on_bell
        LifecycleNodeMixin.__init__(self)
        self._states = self.advertise(MOTOR_STATES)
        self._state = self.advertise(DRIVES_STATE)
        self._published_state = ""
        self._answer = OneAnswer()
        self._publish_state()
        self._last_sample = settings.samples
        self._outcome = "running"
        self._progress = self.advertise(RUN_STATUS) if self._last_sample else None
        if self._progress is not None:
            self.every(REPEAT_PERIOD, self._publish_progress)
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.create_service(Trigger, "~/enable", self._on_enable)
        self.create_service(Trigger, "~/emergency_stop", self._on_emergency_stop)
        self.listen(TORQUE_COMMAND, self._on_command)
        self._targets = None if known.inner_loop is None else InnerLoopTargets(self, known.inner_loop)
        # volatile on this side: faults from before this node started must not be latched again
        self.listen(FAULTS._replace(qos=CONTROL_QOS), self._on_fault)
        self._awaited = set(settings.wait_for_nodes)
        # not required for this node's own readiness, for which others may wait
        self.listen(RUN_READY, self._on_ready, awaited=False)
        self._by_operator = not settings.autostart
        self._opens = self._failed_to_open = False
        self._refusal = ""
        if settings.autostart:
            self._start_timer = self.every(REPEAT_PERIOD, self._autostart)

    def _on_ready(self, message: String) -> None:
        self._awaited.discard(message.data)

    def _autostart(self) -> None:
        if self._awaited or not self._run.agrees:
            return
        self._start_timer.cancel()
        if self.trigger_configure() == SUCCESS:
            self.trigger_activate()

    def _LifecycleNodeMixin__change_state(self, transition_id: int) -> TransitionCallbackReturn:
        """Refuse a transition that is invalid in the current state; rclpy would terminate the node."""
        try:
            outcome: TransitionCallbackReturn = super()._LifecycleNodeMixin__change_state(transition_id)
        except rclpy_implementation.RCLError as error:
            self.get_logger().error(f"transition {transition_id} refused: {unwrapped(error)}")
            return FAILURE
        return outcome

    @_logged
    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Open and set up both drives, once the nodes of the run are there; their power stages stay off.

        Where that fails before the run has begun, the operator may try again: it is no fault of the run then.
        """
        self._wait_for_nodes()
        self._opens = True
        try:
            self._failed_to_open = not self._session.open()
        finally:
            self._opens = False
        self._publish_state()
        if self._failed_to_open:
            return FAILURE
        for note in self._session.drives.notes:
            self.get_logger().info(f"set-up of the drives: {note}")
        self._run_every(self._tend_period, self._session.drives.tend)
        return SUCCESS

    @_logged
    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Enable both drives at zero torque and start at sample 0."""
        self._refusal = self._hindrance()
        if self._refusal:
            self.get_logger().error(f"not activated: {self._refusal}")
            return FAILURE
        if not self._session.activate(time.monotonic):
            return FAILURE
        self._publish_state()
        self._run_every(1.0 / self._rate_hz, self._tick if self._bell is None else self._tick_in_silence)
        return SUCCESS

    @property
    def _may_try_again(self) -> bool:
        """Whether a run waits for an operator, who has not begun it yet."""
        return self._by_operator and bool(self._last_sample) and not self.answered

    def _hindrance(self) -> str:
        """Return why the drives cannot be enabled now, "" where they can."""
        if self._session.fault is not None:
            return f"reset {self._session.fault.name} first"
        if self._awaited:
            return f"not ready yet: {', '.join(sorted(self._awaited))}"
        return "" if self._run.agrees else self._run.problem or "run/plan has not come"

    def _wait_for_nodes(self) -> None:
        """Wait for a limited time until the nodes of the run are ready: so activate may follow at once."""
        end = time.monotonic() + READY_TIME
        while (self._awaited or not self._run.agrees) and time.monotonic() < end:
            self.look_for_others()
            time.sleep(REPEAT_PERIOD)

    @_logged
    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Command zero torque, then disable both drives."""
        self._power_off()
        self._run_every(self._tend_period, self._session.drives.tend)
        return SUCCESS

    @_logged
    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Release and close the drives."""
        self._close()
        self._session.fault = None
        self._publish_state()
        return SUCCESS

    @_logged
    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Power off and close, from any state."""
        self._close()
        return SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """After an exception in a transition: power off, close the drives and return to unconfigured."""
        self._close()
        return SUCCESS

    def stop_robot(self, fault: str) -> None:
        """Latch a fault, which stops the drives."""
        self._session.latch(Fault.from_text(fault))

    def stop(self) -> None:
        """Disable and close the drives on shutdown."""
        self._close()

    def health(self) -> tuple[bytes, str]:
        """Return an error while a fault is latched, a warning for discarded frames and unanswered samples."""
        if self._session.fault is not None:
            return DiagnosticStatus.ERROR, str(self._session.fault)
        if self._refusal and not self._session.active:
            return DiagnosticStatus.WARN, f"not activated: {self._refusal}"
        warning = self._session.warning
        return super().health() if warning is None else (DiagnosticStatus.WARN, warning)

    def metrics(self) -> Mapping[str, object]:
        """Return how long torques took, and in how many samples the drives closed an inner loop, where they are to."""
        inner = {} if self._targets is None else self._targets.counts
        return {TORQUE_LATENCY: json.dumps(self._latency.summary()), **inner}

    def _run_every(self, period: float, callback: Callable[[], None]) -> None:
        """Replace the timer: tending while inactive, control cycles while active."""
        self._cancel_timer()
        self._timer = self.every(period, callback)

    def _cancel_timer(self) -> None:
        if self._timer is not None:
            self.destroy_timer(self._timer)
            self._timer = None

    def _power_off(self) -> None:
        self._session.active = False
        self._run.end()
        # before the samples end, so that no other node reports their absence as a fault
        self._publish_state()
        self._cancel_timer()
        self._session.power_off()

    def _close(self) -> None:
        if not self._session.is_open:
            return
        if self._session.active:
            self._power_off()
        self._cancel_timer()
        self._session.close()

    def _on_bell(self) -> None:
        """Have a cycle run in the node's thread; called in the one that receives."""
        executor = self.executor
        if not self._rung and executor is not None:
            self._rung = True
            executor.create_task(self._tick_on_arrival)

    def _tick_on_arrival(self) -> None:
        self._rung = False
        self._tick()

    def _tick_in_silence(self) -> None:
        """Run a cycle where no measurement has come that would: what is missing has to be noticed."""
        if time.monotonic() - self._cycled > LATE_PERIODS / self._rate_hz:
            self._tick()

    def _tick(self) -> None:
        if not self._session.active:
            # this call may have been queued behind the transition that cancelled the timer
            return
        self._cycled = time.monotonic()
        sample = self._session.cycle(time.monotonic())
        if sample is None:
            return
        if sample.number == 0 and self._begins_run():
            return
        first, second = sample.readings
        self._read = time.monotonic()
        self.note_answer()
        self._states.publish(
            JointSample(
                self._run.stamp(sample.number),
                ACTIVE_JOINTS,
                (first.position, second.position),
                (first.velocity, second.velocity),
                (first.torque, second.torque),
            )
        )

    def _begins_run(self) -> bool:
        """Announce when time begins, and again where sample 0 has had no answer for long; return whether it was.

        The sample itself follows with the next repetition, when every node knows the stamp of sample 0.
        """
        now = self.get_clock().now().nanoseconds
        if self._run.begun and now - self._run.epoch_ns < LONGEST_WAIT_NS:
            return False
        self._run.begin(next_epoch(now + int(REPEAT_PERIOD * NANOSECONDS), self._rate_hz))
        return True

    def _on_command(self, message: JointSample) -> None:
        if self.refuses(TORQUE_COMMAND):
            return
        try:
            ((tau1, tau2),) = COMMANDED(message)
        except MessageError as error:
            self.drop(TORQUE_COMMAND, str(error))
            return
        sample = self._run.sample(message.stamp_ns)
        if sample is not None and self._answer.contradicts(message.stamp_ns, (tau1, tau2)):
            self.contradicted(TORQUE_COMMAND, f"sample {sample}")
            return
        target = None if self._targets is None else self._targets.of(message.stamp_ns)
        if self._watch.pending:
            tau1 = tau2 = 0.0
            target = None
        if not self._session.command(sample, (tau1, tau2), time.monotonic(), target):
            reason = unexpected_sample(sample, self._session.sample)
            self.drop(TORQUE_COMMAND, reason if self._session.active else "the drives are not enabled")
            return
        if sample == self._session.sample:
            self._latency.note(time.monotonic() - self._read)
        if self._session.overdue:
            self._tick()

    def _on_latch(self, fault: Fault, own: bool) -> None:
        """Publish a fault that has stopped the drives, unless it came from another node."""
        if own and not (self._opens and self._may_try_again):
            self._faults.publish(String(data=str(fault)))
        self._publish_state()
        self.get_logger().error(f"zero torque and quick stop: {fault}")

    def _on_fault(self, message: String) -> None:
        """Stop the drives for another node's fault; this node's own faults arrive here too, without effect.

        Where the blender brakes the robot for it, the drives follow its torque until that is zero.
        """
        if not self._session.active:
            return
        fault = Fault.from_text(message.data)
        if fault.name in BRAKED_FAULTS and self._brake_limit > 0.0:
            self._session.follow_brake(fault, time.monotonic() + self._brake_limit)
        else:
            self._session.latch(fault, own=False)

    def _publish_progress(self) -> None:
        """Publish how far the run is; it ends with its last sample, the first fault, or where it is deactivated."""
        sample = self._session.sample
        if self._outcome == "running":
            if self._session.fault is not None and not (self._failed_to_open and self._may_try_again):
                self._outcome = "failed"
            elif sample >= self._last_sample:
                self._outcome = "completed"
            elif sample > 0 and not self._session.active:
                self._outcome = "failed"
        status = {"state": self._outcome, "sample": sample, "samples": self._last_sample, "pid": os.getpid()}
        if self._progress is not None:
            self._progress.publish(String(data=json.dumps(status)))

    def _publish_state(self) -> None:
        """Publish on drives/state whether the drives follow torque commands, and if not why, when that has changed."""
        text = self._session.state
        if text != self._published_state:
            self._published_state = text
            self._state.publish(String(data=text))

    def _on_emergency_stop(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = self._session.emergency_stop()
        return response

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self.second_publisher:
            response.success, response.message = False, f"still there: {self.second_publisher}"
            return response
        response.success, response.message = self._session.reset(time.monotonic)
        self._publish_state()
        return response

    def _on_enable(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = self._session.enable(time.monotonic)
        self._publish_state()
        return response
