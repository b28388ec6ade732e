# SPDX-License-Identifier: Apache-2.0
"""Publishes sigma and 1/cond(A) for every sample (4.1.2)."""

from __future__ import annotations

from typing import Any

from std_msgs.msg import Float64

from fivebar_control.loop.part_choice import supervisor_part
from fivebar_control.loop.supervisor import SupervisorState
from fivebar_control.ros.machine_code import loading
from fivebar_control.ros.node_settings import ChainSettings, runs_compiled
from fivebar_control.ros.run_file import declared_motion
from fivebar_control.scenario.keys import MOTION
from fivebar_control.scenario.motion_file import MotionFile
from fivebar_description.interface import (
    JOINT_STATES,
    JOINTS,
    SUPERVISOR_NAMES,
    SUPERVISOR_SIGMA,
    SUPERVISOR_STATE,
)
from fivebar_description.joint_sample import JointSample, fields_of
from fivebar_description.ros.file_parameters import FileParameters
from fivebar_description.ros.run import run_node
from fivebar_description.ros.sampling_node import QUEUE_DEPTH, Input, SamplingNode


class SupervisorNode(SamplingNode):
    """The performance-based supervisor, which weights the two candidate torques."""

    in_chain = True

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("supervisor")
        settings = self.declare_settings(ChainSettings)
        scenario = FileParameters(self, MotionFile, MOTION).file
        robot, plan, rate_hz, lead_samples, _ = declared_motion(self, scenario)
        compiled = runs_compiled(settings.mode, rate_hz, settings.compiled)
        with loading(compiled, self.get_logger().info):
            self._supervisor = supervisor_part(compiled)(
                robot, plan, rate_hz, lead_samples, scenario.scheme().weighting
            )
        self._reply: SupervisorState | None = None
        self._state = self.advertise(SUPERVISOR_STATE)
        self._sigma = self.advertise(SUPERVISOR_SIGMA)
        self.join(rate_hz, (Input(JOINT_STATES, fields_of(JOINTS, "position", "velocity")),), QUEUE_DEPTH)

    def answer(self, sample: int, *values: Any) -> None:
        """Publish sigma and 1/cond(A)."""
        (joints,) = values
        self._reply = self._supervisor.answer(sample, joints)
        self._publish(sample, self._reply)

    def repeat(self) -> None:
        """Publish the same values again."""
        if self._reply is not None:
            self._publish(self.last_sample, self._reply)

    def _publish(self, sample: int, reply: SupervisorState) -> None:
        stamp = self._run.stamp(sample)
        self._state.publish(JointSample(stamp, SUPERVISOR_NAMES, position=reply))
        self._sigma.publish(Float64(data=reply.sigma))


def main() -> None:
    """Run the node."""
    run_node(SupervisorNode)


if __name__ == "__main__":
    main()
