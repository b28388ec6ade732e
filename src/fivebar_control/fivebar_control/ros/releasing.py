# SPDX-License-Identifier: Apache-2.0
"""A release from the Type 2 locus on behalf of the blender, which a service begins and `release/status` reports."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from sensor_msgs.msg import Imu
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.errors import InputError
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    IMU_DATA,
    MOTOR_STATES,
    RELEASE_BEGINS,
    RELEASE_PRESSES,
    RELEASE_RESTS,
    RELEASE_STATUS,
)
from fivebar_description.joint_sample import JointSample, MessageError
from fivebar_description.ros.node import GraphNode

if TYPE_CHECKING:
    from fivebar_control.planning.release import PlannedInSlices
    from fivebar_control.scenario.release import RobotRelease

LONGEST_GAP = 5
"""Samples in a row that may be missing."""

Values = tuple[float, ...]


class Releasing:
    """The release of a run's robot, at most one at a time.

    With an estimator it goes by `motor_states`, which come whether the estimator knows the robot or not, and by the
    gyroscope, if there is one; these topics are subscribed to with the first request. Else `joint_states` have all that
    it needs.
    """

    def __init__(
        self,
        node: GraphNode,
        scenario: ControlScenario,
        obstacle: Callable[[], str | None],
        sample_of: Callable[[int], int | None],
        reply: Callable[[int, Torque], None],
        by_the_clock: bool,
    ) -> None:
        """Offer the service `~/release`.

        Args:
            node: the blender.
            scenario: of the run.
            obstacle: returns why there must be no torque, None where there may be.
            sample_of: returns the sample of a stamp (ns), None for one off the grid.
            reply: commands a torque in answer to a sample.
            by_the_clock: whether samples wait for nobody, so that what plans a release has to be loaded before.
        """
        if by_the_clock:
            import fivebar_control.scenario.release  # noqa: F401
        self._node, self._scenario, self._obstacle = node, scenario, obstacle
        self._sample_of, self._reply = sample_of, reply
        self._status: Any = None
        self._listens = self._wanted = False
        self._rate = math.nan
        self._plan: PlannedInSlices | None = None
        self._release: RobotRelease | None = None
        self._last = 0
        node.create_service(Trigger, "~/release", self._on_release)

    @property
    def on(self) -> bool:
        """Whether a release is under way: then the torque of each sample is its own."""
        return self._wanted

    def end(self, reason: str) -> None:
        """End a release that is under way; the torque is zero from the next sample on."""
        if self._wanted:
            self._finish(f"ended: {reason}")

    def joints(self, sample: int, position: Values, velocity: Values) -> None:
        """Take the joint states of a sample, from which a release without an estimator goes on."""
        if self._wanted and not self._scenario.estimated:
            q11, q12, q21, q22 = position
            state = state_from_joints(self._scenario.five_bar(), q11, q12, q21, q22, 0.0, 0.0, 0.0, 0.0)
            self._take(sample, q11, q21, velocity[2] + velocity[3], (state.x, state.y))

    def _on_release(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        reason = "a release is under way" if self._wanted else self._obstacle()
        response.success = reason is None
        if reason is None:
            self._listen()
            self._wanted, self._plan, self._release, self._rate = True, None, None, math.nan
            self._say(RELEASE_BEGINS)
            response.message = f"begins with the next sample: {RELEASE_STATUS.name} tells what becomes of it"
        else:
            response.message = f"not released: {reason}"
        self._node.get_logger().info(response.message)
        return response

    def _listen(self) -> None:
        if self._listens:
            return
        self._listens = True
        self._status = self._node.advertise(RELEASE_STATUS)
        if self._scenario.estimated:
            self._node.listen(MOTOR_STATES, self._on_motors, awaited=False)
            self._node.listen(IMU_DATA, self._on_imu, awaited=False)

    def _on_motors(self, message: JointSample) -> None:
        if not self._wanted or self._node.refuses(MOTOR_STATES):
            return
        try:
            ((q11, q21),) = message.read(ACTIVE_JOINTS, ("position",))
        except MessageError as error:
            self._node.drop(MOTOR_STATES, str(error))
            return
        sample = self._sample_of(message.stamp_ns)
        if sample is not None:
            rate, self._rate = self._rate, math.nan
            self._take(sample, q11, q21, rate, None)

    def _on_imu(self, message: Imu) -> None:
        vector = message.angular_velocity
        rate = self._scenario.imu.usable_rate((vector.x, vector.y, vector.z))
        if not math.isnan(rate):
            self._rate = rate

    def _take(self, sample: int, q11: float, q21: float, rate: float, platform: tuple[float, float] | None) -> None:
        reason = self._obstacle()
        if reason is not None:
            self._finish(f"ended: {reason}")
            return
        if self._release is None and not self._planned(sample, q11, q21, platform):
            return
        assert self._release is not None
        if sample <= self._last:
            return
        if sample - self._last > LONGEST_GAP:
            self._finish(f"ended: samples {self._last + 1} to {sample - 1} are missing")
            return
        self._last, pressed = sample, self._release.presses
        self._reply(sample, self._release.step(q11, q21, rate))
        if self._release.has_ended:
            self._finish(self._release.result(q11, q21))
        elif self._release.presses and not pressed:
            self._say(RELEASE_PRESSES)

    def _planned(self, sample: int, q11: float, q21: float, platform: tuple[float, float] | None) -> bool:
        """Go on by a slice with the plan that this or an earlier sample has begun; return whether it is there.

        Until then samples are answered with zero torque: by the clock nobody waits for a plan.
        """
        # here, because hardly any run has a release, and it needs the planner
        from fivebar_control.scenario.release import RobotRelease, release_in_slices

        if self._plan is None:
            self._plan = release_in_slices(self._scenario, q11, q21, platform)
        try:
            next(self._plan)
        except StopIteration as planned:
            self._release = RobotRelease(self._scenario.five_bar(), planned.value)
            self._last = sample - 1
            self._say(RELEASE_RESTS)
            return True
        except InputError as error:
            self._finish(f"refused: {error}")
            return False
        self._reply(sample, ZERO)
        return False

    def _finish(self, text: str) -> None:
        self._wanted, self._plan, self._release = False, None, None
        self._say(text)

    def _say(self, text: str) -> None:
        self._status.publish(String(data=text))
        self._node.get_logger().info(f"release {text}")
