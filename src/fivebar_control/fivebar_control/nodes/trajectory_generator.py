# SPDX-License-Identifier: Apache-2.0
"""Publishes the reference: answers sample k with the reference for sample k + 1, one sample ahead of its use."""

from __future__ import annotations

from typing import Any

from std_msgs.msg import String

from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.model.state import Platform
from fivebar_control.planning.motion_queue import MotionQueue
from fivebar_control.ros.goal_server import GoalServer
from fivebar_control.ros.node_settings import HOLD, TrajectorySettings
from fivebar_control.ros.run_file import declared_motion, plan_values
from fivebar_control.ros.shown_motions import show_plan
from fivebar_control.scenario.keys import GOALS
from fivebar_control.scenario.law_settings import section_law, tuned_controller
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_control.trajectory.hold import Hold
from fivebar_description.interface import (
    ALL_WELL,
    JOINT_STATES,
    JOINTS,
    REFERENCE,
    REFERENCE_AHEAD,
    REFERENCE_MOTION,
    REFERENCE_NAMES,
    RUN_PLAN,
    SAFETY_STATE,
    ahead_names,
)
from fivebar_description.joint_sample import JointSample, fields_of
from fivebar_description.ros.file_parameters import FileParameters
from fivebar_description.ros.run import run_node
from fivebar_description.ros.sampling_node import CAPACITY, Input, SamplingNode
from fivebar_description.run_plan import plan_text
from fivebar_description.shared_settings import REALTIME

AT_REST = (0.0,) * len(JOINTS)


class TrajectoryGenerator(SamplingNode):
    """Rest-to-rest polynomials through waypoints, then requested motions, until a fault stops the robot."""

    in_chain = True
    works_ahead = True

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("trajectory_generator")
        run_file = FileParameters(self, ControlScenario, GOALS, section_law)
        scenario = run_file.file
        settings = self.declare_settings(TrajectorySettings)
        self._motion = declared_motion(self, scenario)
        self._hold = Hold()
        self._references: dict[int, tuple[Platform, ...]] = {}
        self._published = -1
        self._queue = self._new_queue()
        self._goals = GoalServer(
            self,
            scenario,
            settings.mode == REALTIME,
            self._queue,
            lambda sample: self._run.stamp(sample),
            (settings.planner, str(run_file.path)),
        )
        self._reference = self.advertise(REFERENCE)
        self.advertise(RUN_PLAN).publish(String(data=plan_text(plan_values(self._motion, scenario))))
        show_plan(self, self._motion.plan.path, self._motion.rate_hz)
        self._samples_ahead = tuned_controller(scenario).samples_ahead
        if self._samples_ahead:
            self._ahead = self.advertise(REFERENCE_AHEAD)
        self._announces = scenario.scheme().follows_motions
        if self._announces:
            self._whole = self.advertise(REFERENCE_MOTION)
        if settings.after_fault == HOLD:
            # not required for readiness: without a blender there is no fault to hold for
            self.listen(SAFETY_STATE, self._on_safety_state, awaited=False)
        self.join(self._motion.rate_hz, (Input(JOINT_STATES, fields_of(JOINTS, "position")),))

    def restart(self) -> None:
        """Start the plan again."""
        self._hold.begin_run()
        self._published = -1
        self._queue = self._new_queue()
        self._goals.restart(self._queue)

    def prepared(self) -> bool:
        """Return whether the planning process is there, where motions are requested by the clock."""
        return self._goals.prepared()

    def stop(self) -> None:
        """Stop the planning process."""
        self._goals.close()

    def answer(self, sample: int, *values: Any) -> None:
        """Publish the next sample's reference."""
        ((position,),) = values
        left = self._hold.left_at()
        if left is not None:
            self._queue.rest_at(sample + self._motion.lead_samples, *left)
        held: Platform | None = None
        if self._hold.follows:
            place = state_from_joints(self._motion.robot, *position, *AT_REST)
            held = self._hold.reference(place.x, place.y)
        self._goals.update(sample + self._motion.lead_samples, held is not None, (position[0], position[2]))
        # the reference of sample 0 cannot be published ahead of it, nor that of one whose predecessor was not measured
        first = max(self._published + 1, sample + 1 - CAPACITY)
        self._references = {
            number: (held,) * (self._samples_ahead + 1) if held else self._planned(number)
            for number in range(first, sample + 2)
        }
        self._published = sample + 1
        self.repeat()

    def repeat(self) -> None:
        """Publish the same reference again."""
        for sample, references in self._references.items():
            self._publish(sample, *references)

    def _on_safety_state(self, message: String) -> None:
        if message.data == ALL_WELL:
            self._hold.release()
        else:
            self._hold.stop()

    def _planned(self, sample: int) -> tuple[Platform, ...]:
        return self._queue.window(sample + self._motion.lead_samples, self._samples_ahead)

    def _new_queue(self) -> MotionQueue:
        return MotionQueue(self._motion.plan, self._motion.rate_hz)

    def _publish(self, sample: int, reference: Platform, *ahead: Platform) -> None:
        stamp = self._run.stamp(sample)
        if self._announces:
            whole = self._queue.announced(sample + self._motion.lead_samples)
            self._whole.publish(JointSample(stamp, (), position=whole))
        if ahead:
            self._ahead.publish(
                JointSample(
                    stamp,
                    ahead_names(len(ahead)),
                    position=[value for platform in ahead for value in platform[:4]],
                    velocity=[value for platform in ahead for value in platform[2:]],
                )
            )
        x, y, vx, vy, ax, ay = reference
        self._reference.publish(
            JointSample(
                stamp,
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
