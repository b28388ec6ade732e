"""Publishes the reference: answers sample k with the reference for sample k + 1, one hop ahead of its use."""

from __future__ import annotations

from typing import Any

from fivebar_control.nodes.motion_parameters import declare_motion
from fivebar_description.interface import JOINT_STATES, JOINTS, REFERENCE, REFERENCE_NAMES, sample_stamp_ns
from fivebar_description.ros.messages import joint_state
from fivebar_description.ros.run import run_node
from fivebar_description.ros.sampling_node import Input, SamplingNode, fields_of


class TrajectoryGenerator(SamplingNode):
    """Rest-to-rest fifth-order polynomials through waypoints."""

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("trajectory_generator")
        self._motion = declare_motion(self)
        self._reference = self.advertise(REFERENCE)
        self.join(self._motion.rate_hz, (Input(JOINT_STATES, fields_of(JOINTS, "position")),))

    def answer(self, sample: int, *values: Any) -> None:
        """Publish the next sample's reference."""
        # nobody could publish the reference of sample 0 ahead of it
        if sample == 0:
            self._publish(0)
        self._publish(sample + 1)

    def repeat(self) -> None:
        """Publish the same reference again."""
        self.answer(self.last_sample)

    def _publish(self, sample: int) -> None:
        x, y, vx, vy, ax, ay = self._motion.plan.path.at((sample + self._motion.lead_samples) / self.rate_hz)
        self._reference.publish(
            joint_state(
                sample_stamp_ns(sample, self.rate_hz),
                REFERENCE_NAMES,
                position=(x, y, vx, vy),
                velocity=(vx, vy, ax, ay),
            )
        )


def main() -> None:
    """Run the node."""
    run_node(TrajectoryGenerator)


if __name__ == "__main__":
    main()
