# SPDX-License-Identifier: Apache-2.0
"""The limits of a feasible motion, and how they depend on who follows it."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.estimation.encoder import count_angle
from fivebar_control.laws.law import MIN_AUTHORITY
from fivebar_control.laws.registry import TunedController
from fivebar_control.model.singularity import NEAR_LOCUS
from fivebar_control.planning.risk import Risk
from fivebar_control.safety.settings import EVERYWHERE, Area, SafetySettings
from fivebar_control.trajectory.path_distance import TIMED
from fivebar_description.forbidden import NamedBounds
from fivebar_description.known_drives import USUAL_TORQUE_LIMIT
from fivebar_description.loads import NO_LOADS, Loads
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import UNKNOWN, ElbowsPass
from fivebar_description.tolerances import Tolerances

COARSE_SPEED_STEP = 0.04
"""Speed resolution (rad/s) of the encoders up to which a blended controller may dwell near the locus for 0.2 s."""


ESTIMATED_DWELL = 0.15
"""Longest dwell near the locus (s) where an estimator follows: it gives up after 0.2 s, and the robot is not exactly on
its reference."""

ESTIMATED_SPEED_SHARE = 0.8
"""Part of the speed limit that a reference may need where an estimator follows: near Type 1 a small error of the
platform's velocity is a large one of a motor's."""


LEAST_APPROACH = 5.0
"""Time constants 1 / sqrt(kp) of the feedback between a rest and the locus that a robot with encoders needs at least:
what is quicker is feed-forward, whose errors no feedback has the time to correct."""

BISECTIONS = 40

GIVEN_SERIAL = 0.05
"""Least |sin q_i2| of a motion that is given, by a robot that is known exactly: 0.06 mm from the boundary of DexTAR."""


ERROR_TOLERANCE = 2e-3
"""Largest distance (m) of a robot within its tolerances, unless its user says otherwise."""

PREDICTED_SHARE = 0.5
"""Part of the error tolerance that a predicted run may use; the rest is for what the prediction does not know."""


class MotionLimits(NamedTuple):
    """Limits of a feasible motion.

    Attributes:
        torque: what each motor can give (Nm).
        torque_share: the part of it that the reference may need; the rest is for the errors.
        motor_speed: of either motor joint (rad/s), beyond which the robot is stopped.
        speed_share: the part of it that the reference may need; the rest is for the errors.
        serial_margin: least |sin q_i2|, 0 at Type 1.
        dwell: longest time near the Type 2 locus (s).
        rest: least kappa where the platform rests. It is at least that at the edge of the widest blending zone, too,
            for a blended controller `rest_room` times that.
        rest_room: see `rest`. With less than twice that kappa, motions that arrive quickly may end beside the goal or
            fall back across the locus.
        zone_stay: longest time in a blending zone (s), for the blended controllers: there the motion along the path is
            free. A passage at a steady rate takes 80 ms by a zone duration of 40 ms; one that comes in along the locus
            takes longer.
        authority: least |n . v1| at a crossing, for the blended controllers: below it the direction across the path
            cannot be held on the locus.
        clearance: least kappa wherever a law acts that is undefined on the locus: 0.12 mm from it on the middle path.
        approach: least time between a rest and a crossing, in time constants 1 / sqrt(kp) of the law's feedback.
        judge: by which distance of the platform the motion is judged, that from its reference or that from its path.
        tracking_error: distance from the reference beyond which the robot is stopped (m).
        error_tolerance: largest distance of a robot within its tolerances (m).
        risk: of a robot within its tolerances.
        loads: which the robot has to bear at a crossing.
        forbidden: postures that it keeps clear of.
        workspace: in which the reference stays, beyond which the robot is stopped.
        elbows_pass: whether the elbows may pass each other; what is unknown is allowed.
    """

    torque: float = USUAL_TORQUE_LIMIT
    torque_share: float = 0.85
    motor_speed: float = SafetySettings().joint_speed_limit
    speed_share: float = 0.9
    serial_margin: float = 0.15
    dwell: float = 0.2
    rest: float = 1.2 * NEAR_LOCUS
    rest_room: float = 2.0
    zone_stay: float = 0.12
    authority: float = MIN_AUTHORITY
    clearance: float = 0.01
    approach: float = 0.0
    judge: str = TIMED
    tracking_error: float = SafetySettings().tracking_error_limit
    error_tolerance: float = ERROR_TOLERANCE
    risk: Risk = Risk()
    loads: Loads = NO_LOADS
    forbidden: tuple[NamedBounds, ...] = ()
    workspace: Area = EVERYWHERE
    elbows_pass: ElbowsPass = UNKNOWN

    @property
    def certain_loads(self) -> Loads:
        """The loads that a crossing must bear: along t_s, all but the risked share of what is declared."""
        share = exceeded_share(self.risk.load)
        return self.loads._replace(tilt=share * self.loads.tilt, push=share * self.loads.push)

    def without_loads(self) -> MotionLimits:
        """Return the limits for a motion whose loads are judged by its odds: no displacement is beyond them."""
        return self._replace(risk=self.risk._replace(load_share=math.inf))

    @property
    def predicted_error(self) -> float:
        """Largest distance by which the motion is judged in a predicted run (m)."""
        return min(PREDICTED_SHARE * self.error_tolerance, self.tracking_error)


def exceeded_share(probability: float) -> float:
    """Return the share of one declared load that acts along a given direction with a probability, or more.

    Two independent loads together exceed the same share of their sum less often (docs/motions.md). With the magnitude
    uniform from 0 to 1 and the direction uniform, a share f is exceeded with the probability 2 / pi (acos f - f
    arcosh(1 / f)).
    """
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        beyond = (math.acos(middle) - middle * math.acosh(1.0 / middle)) / (0.5 * math.pi)
        low, high = (middle, high) if beyond > probability else (low, middle)
    return high


def speed_step_of(rate_hz: int, counts: int | None) -> float:
    """Return the least difference (rad/s) of speeds from encoders with so many counts, 0 for exact sensors (None)."""
    return rate_hz * count_angle(counts or 0)


ANY_MOTION = MotionLimits()
"""The limits of a motion of which nothing is said."""


def motion_limits_of(
    follower: TunedController,
    torque: float = MotionLimits().torque,
    motor_speed: float = MotionLimits().motor_speed,
    speed_step: float = 0.0,
    given_reach: float | None = None,
    allowed: MotionLimits = ANY_MOTION,
) -> MotionLimits:
    """Return the limits that a controller needs, of a motion that is chosen or given.

    A blended controller works in the motors' angles away from the locus, and what is small there is large in the plane
    near the locus: its rests keep further away, and where the measured speeds come in coarse steps (2 pi rate / counts)
    its torque rattles between the drives' limits, so its crossings have to be quicker and straighter.

    A planner that can choose keeps away from the singularities. A motion that is given is judged by what it asks for:
    with exact sensors rests and dwells near the locus, and postures near Type 1, are left to the torque, the motor
    speeds and the predicted run. With encoders the estimator needs the same limits on rests and dwells for both.

    Args:
        follower: the controller.
        torque: what each motor can give (Nm).
        motor_speed: allowed for either motor joint (rad/s).
        speed_step: least difference between two measured joint speeds (rad/s), 0 for exact ones (`speed_step_of`).
        given_reach: of a motion that is given, and whose run can be predicted, the least |sin q_i2| with encoders of a
            law that is regular at Type 1 (`reach_within`); None for any other.
        allowed: the limits that do not depend on the controller; the others are the usual ones.
    """
    limits = allowed._replace(torque=torque, motor_speed=motor_speed)
    if speed_step > 0.0:
        limits = limits._replace(dwell=ESTIMATED_DWELL, speed_share=ESTIMATED_SPEED_SHARE)
    if follower.controller.blended:
        if speed_step > COARSE_SPEED_STEP:
            limits = limits._replace(dwell=0.06, authority=0.5)
        limits = limits._replace(rest=0.1)
    elif speed_step > 0.0:
        limits = limits._replace(approach=LEAST_APPROACH)
    if given_reach is None:
        return limits
    if speed_step > 0.0:
        return limits._replace(serial_margin=given_reach) if follower.controller.meets_type_1 else limits
    return limits._replace(serial_margin=GIVEN_SERIAL, dwell=math.inf, rest=0.0, rest_room=1.0)


def reach_within(robot: FiveBar, tolerances: Tolerances) -> float:
    """Return the least |sin q_i2| of a leg that reaches its place though it is shorter by its tolerances.

    The links may be shorter by `length` each, and the base further away by `base`. At least the margin of a robot that
    is known exactly, and at most that of a chosen motion, which is also that of a robot without declared tolerances.
    """
    chosen = MotionLimits().serial_margin
    short = 2.0 * tolerances.length + tolerances.base
    if short == 0.0:
        return chosen
    sines = [GIVEN_SERIAL]
    for leg in (robot.leg1, robot.leg2):
        proximal, distal = leg.proximal, leg.distal
        cosine = ((proximal + distal - short) ** 2 - proximal * proximal - distal * distal) / (2.0 * proximal * distal)
        sines.append(math.sqrt(max(1.0 - cosine * cosine, 0.0)) if cosine > 0.0 else 1.0)
    return min(max(sines), chosen)
