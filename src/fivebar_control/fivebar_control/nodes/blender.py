# SPDX-License-Identifier: Apache-2.0
"""Blends the candidate torques into the torque command (4.1, 4.2), and stops the robot after a fault."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticStatus
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fivebar_control.fault import Fault
from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.loop.part_choice import guard_part
from fivebar_control.loop.shared_results import one_robot
from fivebar_control.ros.machine_code import loading
from fivebar_control.ros.node_settings import SHORTEST_DEADLINE_MS, BlenderSettings, runs_compiled
from fivebar_control.ros.releasing import Releasing
from fivebar_control.ros.run_file import start_values
from fivebar_control.safety.watchdog import PauseCompensatedClock, Watchdog
from fivebar_control.scenario.guard_settings import guard_settings
from fivebar_control.scenario.keys import STOPPING
from fivebar_control.scenario.law_settings import section_law
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ALL_WELL,
    CONTROL_QOS,
    DRIVES_STATE,
    ESTIMATE_STATE,
    FAULTS,
    JOINT_STATES,
    JOINTS,
    REFERENCE,
    REFERENCE_NAMES,
    SAFETY_STATE,
    SUPERVISOR_NAMES,
    SUPERVISOR_STATE,
    TORQUE_COMMAND,
    TORQUE_REQUESTED,
    VHC_TORQUE,
)
from fivebar_description.joint_sample import JointSample, fields_of
from fivebar_description.parameters import laden
from fivebar_description.ros.file_parameters import FileParameters
from fivebar_description.ros.publisher_watch import NAME_TIME_AT_REST
from fivebar_description.ros.run import run_node
from fivebar_description.ros.run_agreement import RunAgreement
from fivebar_description.ros.sampling_node import Input, SamplingNode
from fivebar_description.shared_settings import LOCKSTEP

CHECKS_PER_DEADLINE = 2
"""How often within a deadline a timer checks the watchdog. Each sample is a check besides, and the timer wakes two
threads of the control chain each time it fires."""

MIN_CHECKS_PER_DEADLINE = 1.5
"""Least checks within a deadline: a longer interval between two checks is a pause of the process."""


LOCKSTEP_DEADLINE = NAME_TIME_AT_REST + 0.5
"""Timeout for a candidate torque in lockstep (s): longer than a node looks for the name of a second publisher before it
reports it, so that the cause is reported, and shorter than the plant waits for a torque."""

EARLY = 0.25
"""The deadline is a quarter period early, so that the arrival jitter of the sample at which the blender looks at it
does not decide about a whole cycle."""


class Deadlines(NamedTuple):
    """Longest waits (s) for the candidates of a sample, and from one sample to the next."""

    candidates: float
    states: float


def deadlines_of(scenario: ControlScenario, settings: BlenderSettings) -> Deadlines:
    """Return the deadlines of a run: in real time those of the drives, of which the candidates' is a cycle less.

    So the blender, which knows what is missing, reports it.

    Raises:
        InputError: the motion is refused, which decides how long a torque may be held.
    """
    if settings.mode == LOCKSTEP:
        candidates, states = LOCKSTEP_DEADLINE, math.inf
    else:
        # here, because only a run by the clock searches for the time that a torque may be held
        from fivebar_control.scenario.stopping import stop_cycles

        cycles, period = stop_cycles(scenario), 1.0 / scenario.rate_hz
        candidates, states = max(SHORTEST_DEADLINE_MS / 1e3, (cycles - 1 - EARLY) * period), cycles * period
    if settings.candidate_deadline_ms is not None:
        candidates = settings.candidate_deadline_ms / 1e3
    if settings.state_deadline_ms is not None:
        states = settings.state_deadline_ms / 1e3
    return Deadlines(candidates, states)


class Blender(SamplingNode):
    """The last node before the drives.

    While a fault is latched, every sample is answered immediately: with the brake's torque until the robot is at rest
    where its state is sound, else with zero torque. The inputs are still joined, so that a reset can check whether the
    cause is gone.
    """

    in_chain = True
    commands_robot = True

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("blender")
        settings = self.declare_settings(BlenderSettings)
        keys = (*STOPPING, "camera.on", "ekf.camera", "ekf.seen_start")
        scenario = FileParameters(self, ControlScenario, keys, section_law).file
        agreement = RunAgreement(self, scenario.rate_hz, start_values(scenario))
        self._empty = self._robot = one_robot(scenario.five_bar())
        compiled = runs_compiled(settings.mode, scenario.rate_hz, settings.compiled)
        with loading(compiled, self.get_logger().info):
            kind = guard_part(compiled)
            self._guard = kind(self._robot, scenario.working_mode, scenario.rate_hz, guard_settings(scenario))
        deadlines = deadlines_of(scenario, settings)
        shortest = min(deadlines)
        self._deadline_clock = PauseCompensatedClock(time.monotonic, shortest / MIN_CHECKS_PER_DEADLINE)
        self._watchdog = Watchdog(deadlines.candidates, deadlines.states, settings.last_sample)
        # the plant ends with the motion, drives do not
        if settings.last_sample is None and not settings.endless:
            agreement.on_plan = self._end_with_motion
        self._drives_state = self._estimate_state = ALL_WELL
        self._first = 0
        self._reply: JointSample | None = None
        self._requested = self.advertise(TORQUE_REQUESTED)
        self._command = self.advertise(TORQUE_COMMAND)
        self._state = self.advertise(SAFETY_STATE)
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.create_service(Trigger, "~/emergency_stop", self._on_emergency_stop)
        self._releasing = Releasing(
            self,
            scenario,
            self._no_release,
            lambda stamp: self._run.sample(stamp),
            self._reply_with,
            by_the_clock=settings.mode != LOCKSTEP,
        )
        torque, scheme = fields_of(ACTIVE_JOINTS, "effort", allow_nan=True), scenario.scheme()
        inputs = [
            Input(JOINT_STATES, fields_of(JOINTS, "position", "velocity")),
            Input(REFERENCE, fields_of(REFERENCE_NAMES, "position")),
            Input(scheme.nominal.topic, torque),
        ]
        if scheme.blended:
            inputs += [Input(VHC_TORQUE, torque), Input(SUPERVISOR_STATE, fields_of(SUPERVISOR_NAMES, "position"))]
        self.join(scenario.rate_hz, inputs)
        # volatile on this side: faults published before this node started do not concern it
        self.listen(FAULTS._replace(qos=CONTROL_QOS), self._on_fault)
        # not awaited: drives that publish no state hold no fault
        self.listen(DRIVES_STATE, self._on_drives_state, awaited=False)
        if scenario.sees:
            self.listen(ESTIMATE_STATE, self._on_estimate_state, awaited=False)
        self.listen_to_payload(self._carry)
        self.every(shortest / CHECKS_PER_DEADLINE, self._check_deadlines)
        self._publish_state()

    def _end_with_motion(self) -> None:
        if self._run.start is not None:
            self._watchdog.last_sample = self._run.start.samples

    def stop_robot(self, fault: str) -> None:
        """Stop the robot for a fault; where another one is latched already, no brake is left."""
        if self._guard.fault is None:
            self._stop_robot(Fault.from_text(fault))
            return
        super().stop_robot(fault)
        self._releasing.end(fault)
        self._guard.trip(Fault.from_text(fault))
        self._reply_with(self._watchdog.newest, ZERO)

    def hold(self, sample: int) -> None:
        """Answer a sample with zero torque, whatever its candidates will be."""
        self._watchdog.received(sample, self._deadline_clock.read())
        self._watchdog.answered(sample)
        self._releasing.end("a second publisher may be there")
        self._first = max(self._first, sample + 1)
        self._reply_with(sample, ZERO)

    def stop(self) -> None:
        """Command zero torque before the node ends."""
        self._releasing.end("the node ends")
        self._reply_with(self._watchdog.newest, ZERO)

    def health(self) -> tuple[bytes, str]:
        """Return an error while a fault is latched."""
        if self._guard.fault is not None:
            return DiagnosticStatus.ERROR, str(self._guard.fault)
        return super().health()

    def metrics(self) -> Mapping[str, object]:
        """Return in how many samples a limit has reduced the torque."""
        return {"limited_samples": self._guard.limited_samples}

    def restart(self) -> None:
        """Wait for the candidates of a new run; a latched fault stays."""
        self._releasing.end("a new run begins")
        self._watchdog.begin_run()
        self._guard.begin_run()
        self._first = 0

    def admit(self, sample: int, driving: bool, values: Any) -> bool:
        """Start the deadline of a sample; while a fault is latched, answer it immediately with what stops the robot."""
        if driving:
            late = self._watchdog.joined_late(sample)
            self._watchdog.received(sample, self._deadline_clock.read())
            if late is not None and self._guard.fault is None:
                self._stop_robot(late)
            elif self._guard.fault is not None:
                if self._releasing.on:
                    self._releasing.joints(sample, *values)
                else:
                    self._reply_with(sample, self._guard.stop_at(sample, values))
            self._check_deadlines()
        return True

    def answer(self, sample: int, *values: Any) -> None:
        """Publish the torque of a sample; while a fault is latched, only check its inputs."""
        self._watchdog.completed(sample, self._deadline_clock.read())
        if sample < self._first:
            return
        if self._watch.pending:
            self.hold(sample)
            return
        joints, (reference,), (alone,), *rest = values
        nominal, constraint, sigma = Torque(*alone), Torque(*alone), 0.0
        if rest:
            (vhc,), ((sigma, _),) = rest
            constraint = Torque(*vhc)
        stopped = self._guard.fault is not None
        requested, torque = self._guard.answer(sample, joints, reference[:2], sigma, nominal, constraint)
        if stopped:
            return
        if requested is not None:
            self._requested.publish(self._message(sample, requested))
        self._reply_with(sample, torque)
        if self._guard.fault is not None:
            self._announce_fault()

    def repeat(self) -> None:
        """Publish the same command again, or zero torque if a fault has been latched since that does not brake."""
        if self._guard.fault is not None and not self._guard.brakes and not self._releasing.on:
            self._reply = self._message(self.last_sample, ZERO)
        if self._reply is not None:
            self._command.publish(self._reply)

    def _on_fault(self, message: String) -> None:
        """Stop the robot when another node reports a fault; the node's own faults are received too, without effect."""
        known, braked = self._guard.fault, self._guard.brakes
        if known is not None and message.data != str(known):
            self._releasing.end(message.data)
        self._guard.trip(Fault.from_text(message.data))
        if known is not None and braked and not self._guard.brakes:
            # the further fault may concern the state or the drives that the brake relies on
            self._reply_with(self._watchdog.newest, ZERO)
        if known is None:
            # a sample that still waits for its candidates is answered as well
            self._reply_with(self._watchdog.newest, ZERO)
            self._publish_state()

    def _carry(self, payload: float) -> None:
        self._robot = one_robot(laden(self._empty, payload))
        self._guard.carry(self._robot)

    def _on_drives_state(self, message: String) -> None:
        self._drives_state = message.data
        if message.data != ALL_WELL:
            # drives that do not follow their commands brake nothing
            self._guard.stop_braking()
            self._releasing.end(f"the drives are stopped by {message.data}")
        # drives that were off have sent nothing: the deadline of their next sample starts now
        self._watchdog.rearm(self._deadline_clock.read())

    def _on_estimate_state(self, message: String) -> None:
        before, self._estimate_state = self._estimate_state, message.data
        if before != ALL_WELL and message.data == ALL_WELL:
            self._guard.find_again()

    def _check_deadlines(self) -> None:
        """Stop the robot where candidates or the next joint states are overdue."""
        if self._guard.fault is not None:
            return
        now = self._deadline_clock.read()
        overdue = self._watchdog.overdue(now)
        # drives that are off send no samples, and that is no fault
        stale = self._watchdog.stale(now) if self._drives_state == ALL_WELL else None
        if overdue is not None:
            self._stop_robot(self._watchdog.missing(overdue, self.missing_inputs(overdue)))
        elif stale is not None:
            self._stop_robot(stale)

    def _stop_robot(self, fault: Fault) -> None:
        self._guard.trip(fault)
        self._reply_with(self._watchdog.newest, ZERO)
        self._announce_fault()

    def _reply_with(self, sample: int, torque: Torque) -> None:
        self._reply = self._message(sample, torque)
        self._command.publish(self._reply)

    def _message(self, sample: int, torque: Torque) -> JointSample:
        return JointSample(self._run.stamp(sample), ACTIVE_JOINTS, effort=torque)

    def _announce_fault(self) -> None:
        self._faults.publish(String(data=str(self._guard.fault)))
        self._publish_state()
        stop = "brakes" if self._guard.brakes else "zero torque"
        self.get_logger().error(f"{stop}: {self._guard.fault}")

    def _publish_state(self) -> None:
        fault = self._guard.fault
        self._state.publish(String(data=ALL_WELL if fault is None else str(fault)))

    def _on_emergency_stop(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self._guard.fault is None:
            self._stop_robot(Fault("emergency_stop", "requested by blender/emergency_stop"))
        elif self._guard.brakes:
            self._guard.stop_braking()
            self._reply_with(self._watchdog.newest, ZERO)
        elif self._releasing.on:
            self._releasing.end("requested by blender/emergency_stop")
            self._reply_with(self._watchdog.newest, ZERO)
        response.success = True
        response.message = f"zero torque: {self._guard.fault}"
        return response

    def _no_release(self) -> str | None:
        """Return why no release may move the robot, None where it may."""
        if self.second_publisher:
            return self.second_publisher
        if self._guard.fault is None:
            return "no fault is latched: expected a robot that one has stopped"
        if self._guard.brakes:
            return "the robot is being braked"
        if self._drives_state != ALL_WELL:
            return f"the drives are stopped by {self._drives_state}"
        return None

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        fault = self._guard.fault
        reason = self._clear() if fault is not None else None
        response.success = reason is None
        if fault is None:
            response.message = "no fault was latched"
        elif reason is not None:
            response.message = f"not cleared, {reason}; latched is {fault}"
        else:
            response.message = f"cleared {fault}"
            # the present sample has been answered already
            self._first = self._watchdog.newest + 1
            self._watchdog.answered(self._watchdog.newest)
            self._publish_state()
        self.get_logger().info(response.message)
        return response

    def _clear(self) -> str | None:
        """Clear the fault, or return the reason why it cannot be cleared."""
        if self.second_publisher:
            return self.second_publisher
        if self._releasing.on:
            return "a release is under way"
        if self._drives_state != ALL_WELL:
            return f"the drives are stopped by {self._drives_state}"
        return self._watchdog.obstacle(self._deadline_clock.read()) or self._guard.reset()


def main() -> None:
    """Run the node."""
    run_node(Blender)


if __name__ == "__main__":
    main()
