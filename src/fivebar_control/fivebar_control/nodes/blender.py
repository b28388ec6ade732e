"""Blends the candidate torques into the command (4.1, 4.2), and commands zero torque once something is wrong."""

from __future__ import annotations

import math
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fivebar_control.controllers.guard import Guard
from fivebar_control.controllers.torque import ZERO, Torque
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.nodes.motion_parameters import RATE, ROBOT
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    AWAY_TORQUE,
    CONTROL_QOS,
    CTC_TORQUE,
    FAULTS,
    JOINT_STATES,
    JOINTS,
    REFERENCE,
    REFERENCE_NAMES,
    SUPERVISOR_NAMES,
    SUPERVISOR_STATE,
    TORQUE_COMMAND,
    VHC_TORQUE,
    sample_stamp_ns,
)
from fivebar_description.parameters import load_robot
from fivebar_description.ros.messages import joint_state
from fivebar_description.ros.parameters import Spec
from fivebar_description.ros.run import run_node
from fivebar_description.ros.sampling_node import Input, SamplingNode, fields_of

DEADLINE_LOOKS = 4
"""How often within a deadline the blender looks whether it has passed."""

BLENDED = "blended"

SPECS = (
    ROBOT,
    RATE,
    Spec(
        "candidates",
        BLENDED,
        "Blend ctc/torque and vhc/torque by sigma, or take ctc/torque or unified/torque alone.",
        choices=(BLENDED, *AWAY_TORQUE),
    ),
    Spec(
        "candidate_deadline_ms",
        2000.0,
        "Longest wait for the candidates of a sample, on the steady clock; then zero torque and a fault.",
        "ms",
        1.0,
        60_000.0,
    ),
    Spec(
        "tracking_error_limit",
        0.05,
        "Distance from the reference beyond which the blender gives up: zero torque and a fault.",
        "m",
        1e-6,
        10.0,
    ),
)


class Blender(SamplingNode):
    """The last node before the drives."""

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("blender")
        values = self.parameters(SPECS)
        self._robot = load_robot(values["robot"])
        self._deadline = values["candidate_deadline_ms"] / 1e3
        self._guard = Guard(values["tracking_error_limit"])
        self._waiting_since: dict[int, float] = {}
        self._reply: JointState | None = None
        self._command = self.advertise(TORQUE_COMMAND)
        self._faults = self.advertise(FAULTS)
        self.create_service(Trigger, "~/reset", self._on_reset)
        torque = fields_of(ACTIVE_JOINTS, "effort", allow_nan=True)
        inputs = [
            Input(JOINT_STATES, fields_of(JOINTS, "position", "velocity")),
            Input(REFERENCE, fields_of(REFERENCE_NAMES, "position")),
            Input(AWAY_TORQUE.get(values["candidates"], CTC_TORQUE), torque),
        ]
        if values["candidates"] == BLENDED:
            inputs += [Input(VHC_TORQUE, torque), Input(SUPERVISOR_STATE, fields_of(SUPERVISOR_NAMES, "position"))]
        self.join(values["rate_hz"], inputs)
        # volatile on this side: faults of the past are the business of whoever reset them
        self.listen(FAULTS._replace(qos=CONTROL_QOS), self._on_fault)
        self.every(self._deadline / DEADLINE_LOOKS, self._look_for_missing)

    def stop(self) -> None:
        """Command zero torque as the last word."""
        self._command.publish(self._message(max(self.last_sample, 0), ZERO))

    def health(self) -> tuple[bytes, str]:
        """Return an error while a fault is latched."""
        if self._guard.fault is not None:
            return DiagnosticStatus.ERROR, str(self._guard.fault)
        return super().health()

    def restart(self) -> None:
        """Wait for the candidates of a new run; a latched fault stays."""
        self._waiting_since.clear()

    def admit(self, sample: int, driving: bool) -> bool:
        """Start the deadline of a sample; while a fault is latched, answer it at once with zero torque."""
        if self._guard.fault is not None:
            if driving:
                self._reply_with(sample, ZERO)
            return False
        if driving:
            self._waiting_since.setdefault(sample, time.monotonic())
            self._look_for_missing()
        return self._guard.fault is None

    def answer(self, sample: int, *values: Any) -> None:
        """Publish the blended torque of a sample."""
        (position, velocity), (reference,), (alone,), *rest = values
        state = state_from_joints(self._robot, *position, *velocity)
        error = math.hypot(state.x - reference[0], state.y - reference[1])
        away = Torque(*alone)
        if rest:
            (vhc,), ((sigma, _),) = rest
            torque = self._guard.command(sample, error, sigma, away, Torque(*vhc))
        else:
            torque = self._guard.command(sample, error, 0.0, away, away)
        self._reply_with(sample, torque)
        if self._guard.fault is not None:
            self._announce_fault()

    def repeat(self) -> None:
        """Publish the same command again, or zero torque where another node's fault has come since."""
        if self._guard.fault is not None:
            self._reply = self._message(self.last_sample, ZERO)
        if self._reply is not None:
            self._command.publish(self._reply)

    def _on_fault(self, message: String) -> None:
        """Stop the robot when another node reports a fault; one's own comes back too and changes nothing."""
        name, _, detail = message.data.partition(": ")
        self._guard.trip(name, detail)
        # a sample that still waits for its candidates would wait for ever: they are left out while a fault is latched
        if self._waiting_since:
            self._reply_with(max(self._waiting_since), ZERO)

    def _look_for_missing(self) -> None:
        """Give up on a sample whose candidates are overdue."""
        if self._guard.fault is not None or not self._waiting_since:
            return
        sample = min(self._waiting_since)
        if time.monotonic() - self._waiting_since[sample] < self._deadline:
            return
        missing = ", ".join(self.missing_inputs(sample))
        self._guard.trip("candidate_missing", f"no {missing} for sample {sample} within {self._deadline * 1e3:g} ms")
        self._reply_with(max(self._waiting_since), ZERO)
        self._announce_fault()

    def _reply_with(self, sample: int, torque: Torque) -> None:
        self.close_sample(sample)
        for answered in [number for number in self._waiting_since if number <= sample]:
            del self._waiting_since[answered]
        self._reply = self._message(sample, torque)
        self._command.publish(self._reply)

    def _message(self, sample: int, torque: Torque) -> JointState:
        return joint_state(sample_stamp_ns(sample, self.rate_hz), ACTIVE_JOINTS, effort=torque)

    def _announce_fault(self) -> None:
        self._faults.publish(String(data=str(self._guard.fault)))
        self.get_logger().error(f"zero torque: {self._guard.fault}")

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        fault = self._guard.fault
        self._guard.reset()
        response.success = True
        response.message = f"cleared {fault}" if fault is not None else "no fault was latched"
        self.get_logger().info(response.message)
        return response


def main() -> None:
    """Run the node."""
    run_node(Blender)


if __name__ == "__main__":
    main()
