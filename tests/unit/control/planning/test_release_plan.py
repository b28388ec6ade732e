# SPDX-License-Identifier: Apache-2.0
"""Off the Type 2 locus from rest: what a torque does there, and releases, against MuJoCo's dynamics."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from rest_motion import rest_motion

from fivebar_control.model.geometry import direct_geometry, inverse_geometry
from fivebar_control.model.kinematics import assembly_mode, det_a, state_from_joints, state_from_platform
from fivebar_control.model.singularity import inverse_condition, parallel_svd
from fivebar_control.model.state import State
from fivebar_control.planning.release import CLEAR, ReleasePlan, ReleaseRefused, ReleaseTask, finished, plan_in_slices
from fivebar_control.planning.release_drive import (
    NO_DRIVE,
    ReleaseDrive,
    drive_torque,
    height_of,
    reach_of,
    state_at,
    wrong_side,
)
from fivebar_control.planning.release_step import (
    NO_GYROSCOPE,
    NOT_AT_REST,
    RELEASED,
    STUCK,
    TOO_FAR,
    TOO_FAST,
    UNDECIDED,
    ReleaseMemory,
    first_memory,
    has_ended,
    release_step,
)
from fivebar_control.planning.standstill import standstill_at
from fivebar_control.safety.settings import Area, SafetySettings
from fivebar_control.safety.stages import Limits, guard_limits_of
from fivebar_description.loads import NO_LOADS, Loads
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import UNKNOWN
from fivebar_description.tolerances import Tolerances
from fivebar_mujoco.mujoco_motion import MujocoMotion
from fivebar_sim.effects.friction import FrictionEffects
from fivebar_sim.effects.loads import Tilt
from fivebar_sim.effects.settings import PlantSettings

RATE = 500
LIMITS = guard_limits_of(SafetySettings(torque_limit=2.0), RATE)
KNOWN, CALIBRATED = Tolerances(length=1e-4), Tolerances(length=2e-5)
COMMON = 0.0, math.sqrt(0.09**2 - 0.059**2)
"""Where both elbows of DexTAR are in one place (m)."""

STRETCHED = {"centre": (0.0, 1), "aside": (0.025, 1), "below": (0.0, -1)}
"""Places on the stretched locus in working mode (1, -1), by x and the sign of y."""


def on_the_locus(robot: FiveBar, x: float, sign: int, beside: float = 0.0) -> State:
    """A robot at rest that is beside the stretched locus along t_s (m)."""
    low, high = sign * 0.05, sign * 0.1
    for _ in range(60):
        middle = 0.5 * (low + high)
        ends = [det_a(state_from_platform(robot, (sign, -sign), x, y, 0.0, 0.0)) for y in (low, middle)]
        low, high = (middle, high) if ends[0] * ends[1] > 0.0 else (low, middle)
    at = state_from_platform(robot, (sign, -sign), x, low, 0.0, 0.0)
    svd = parallel_svd(at)
    return state_from_platform(robot, (sign, -sign), x + beside * svd.t_x, low + beside * svd.t_y, 0.0, 0.0)


def folded(robot: FiveBar, heading: float) -> State:
    """A robot at rest whose elbows are 2 um apart, with its platform in a direction from them."""
    x, y = COMMON[0] + 0.08999 * math.cos(heading), COMMON[1] + 0.08999 * math.sin(heading)
    one, two = (1 if (x - base) * COMMON[1] + y * base > 0.0 else -1 for base in (-0.059, 0.059))
    return state_from_platform(robot, (one, two), x, y, 0.0, 0.0)


def in_mujoco(robot: FiveBar, state: State, **effects: object) -> MujocoMotion:
    q = [state.leg1.q1, state.leg1.q2, state.leg2.q1, state.leg2.q2]
    return MujocoMotion(robot, PlantSettings(**effects), RATE, q)  # type: ignore[arg-type]


def state_in(robot: FiveBar, motion: MujocoMotion) -> State:
    return state_from_joints(robot, *motion.joints[0].tolist(), *motion.joints[1].tolist())


@pytest.mark.parametrize("at", [*STRETCHED, "folded"])
def test_a_torque_at_rest_moves_the_robot_as_the_equations_say(dextar: FiveBar, at: str) -> None:
    """Without friction: along v1, not along t_s, and off the locus with the square of the time."""
    smooth = FiveBar(dextar.leg1._replace(offset=0.0), dextar.leg2._replace(offset=0.0), dextar.mass)
    state = folded(smooth, 0.4) if at == "folded" else on_the_locus(smooth, *STRETCHED[at], beside=1e-8)
    svd, torque = parallel_svd(state), (0.3, 0.8)
    expected = rest_motion(smooth, state, *torque)
    assert abs(expected.lost) < 20.0 * inverse_condition(state) * abs(expected.along) + 1e-12
    motion = in_mujoco(smooth, state, friction_scale=0.0)
    motion.advance(torque)
    motion.advance(torque)
    now, time = state_in(smooth, motion), 2.0 / RATE
    assert svd.v_x * now.vx + svd.v_y * now.vy == pytest.approx(time * expected.along, rel=5e-3)
    assert abs(svd.t_x * now.vx + svd.t_y * now.vy) < 0.01 * time * abs(expected.along)
    moved = 0.5 * time**2 * expected.determinant
    largest = 0.5 * time**2 * abs(expected.along) / 0.09
    assert det_a(now) - det_a(state) == pytest.approx(moved, rel=0.02, abs=0.02 * largest)


@pytest.mark.parametrize("torque", [0.3, -0.3])
def test_at_the_centre_either_torque_leaves_the_locus_to_one_side_with_the_fourth_power_of_time(
    dextar: FiveBar, torque: float
) -> None:
    """There v1 is tangent to the locus: from exact rest, without friction, in MuJoCo."""
    smooth = FiveBar(dextar.leg1._replace(offset=0.0), dextar.leg2._replace(offset=0.0), dextar.mass)
    motion = in_mujoco(smooth, on_the_locus(smooth, *STRETCHED["centre"]), friction_scale=0.0)
    beside = []
    for _ in range(60):
        motion.advance((torque, torque))
        beside.append(det_a(state_in(smooth, motion)))
    assert beside[29] == pytest.approx(1.086e-3, rel=5e-3)
    assert beside[59] / beside[29] == pytest.approx(16.0, rel=5e-3)


@pytest.mark.parametrize("x", [0.0, 0.025])
def test_the_press_makes_a_displacement_grow_like_a_rod_that_buckles(dextar: FiveBar, x: float) -> None:
    """Against the difference of two MuJoCo robots that began on either side, in which all else cancels."""
    smooth = FiveBar(dextar.leg1._replace(offset=0.0), dextar.leg2._replace(offset=0.0), dextar.mass)
    beside, torque, samples = 2e-5, (-1.0, 1.1), 60
    ends = []
    for side in (1.0, -1.0):
        motion = in_mujoco(smooth, on_the_locus(smooth, x, 1, side * beside), friction_scale=0.0)
        for _ in range(samples):
            motion.advance(torque)
        ends.append(det_a(state_in(smooth, motion)))
    begin = [det_a(on_the_locus(smooth, x, 1, side * beside)) for side in (1.0, -1.0)]
    rate = math.sqrt(rest_motion(smooth, on_the_locus(smooth, x, 1), *torque).growth)
    grown = math.cosh(rate * samples / RATE)
    assert grown > 5.0
    assert (ends[0] - ends[1]) / (begin[0] - begin[1]) == pytest.approx(grown, rel=0.05)


@pytest.mark.parametrize("x", [0.0, 0.025])
def test_friction_in_all_passive_joints_holds_twice_the_moment_over_the_press(dextar: FiveBar, x: float) -> None:
    """By virtual work along t_s: both elbows turn once with the displacement, the platform's joint twice."""
    beside, step, press, moment = 3e-4, 1e-6, 1.0, 1.0
    before, at, after = (on_the_locus(dextar, x, 1, beside + one * step) for one in (-1.0, 0.0, 1.0))

    def turned(angle: Callable[[State], float]) -> float:
        return (angle(after) - angle(before)) / (2.0 * step)

    done = press * (at.leg1.b * turned(lambda one: one.leg1.q1) + at.leg2.b * turned(lambda one: one.leg2.q1))
    angles: list[Callable[[State], float]] = [
        lambda one: one.leg1.q2,
        lambda one: one.leg2.q2,
        lambda one: one.leg2.q1 + one.leg2.q2 - one.leg1.q1 - one.leg1.q2,
    ]
    lost = moment * sum(abs(turned(angle)) for angle in angles)
    # the work grows with the displacement, the friction does not
    assert abs(done) > 0.0
    assert beside * lost / abs(done) * press / moment == pytest.approx(2.0, rel=0.02)


def test_folded_links_do_not_buckle_and_differ_with_the_lengths(dextar: FiveBar) -> None:
    assert rest_motion(dextar, folded(dextar, 0.4), 0.5, -0.2).growth == pytest.approx(0.0, abs=1e-9)
    longer = dextar._replace(leg2=dextar.leg2._replace(distal=0.1))
    assert rest_motion(longer, folded(longer, 0.4), 0.5, -0.2).growth != 0.0


def driven_plan(
    robot: FiveBar, state: State, tolerances: Tolerances = CALIBRATED, loads: Loads = NO_LOADS, limits: Limits = LIMITS
) -> ReleasePlan:
    """A release without a gyroscope."""
    q11, q21 = state.leg1.q1, state.leg2.q1
    return finished(plan_in_slices(ReleaseTask(robot, tolerances, limits, UNKNOWN, RATE, loads), q11, q21, None, False))


def driven_along(robot: FiveBar, state: State, length: float, duration: float) -> ReleaseDrive:
    """A drive from the locus along v1, against it for a negative length."""
    svd, sign = parallel_svd(state), math.copysign(1.0, length)
    return NO_DRIVE._replace(
        mode=(1, -1),
        x=state.x,
        y=state.y,
        d_x=sign * svd.v_x,
        d_y=sign * svd.v_y,
        length=abs(length),
        duration=duration,
        bandwidth=40.0,
        cap1=3.0,
        cap2=3.0,
    )


def height_driven(robot: FiveBar, state: State, drive: ReleaseDrive, **effects: object) -> float:
    """Return how far (m) MuJoCo's platform is off the elbows' line after a drive, positive towards mode +."""
    motion, speeds = in_mujoco(robot, state, **effects), [0.0, 0.0]
    last = motion.joints[0][[0, 2]]
    for number in range(round(drive.duration * RATE)):
        angles = motion.joints[0][[0, 2]]
        speeds = 0.6 * np.array(speeds) + 0.4 * RATE * (angles - last)
        last = angles
        motion.advance(drive_torque(robot, drive, number / RATE, *angles.tolist(), *speeds.tolist()))
    end = state_in(robot, motion)
    elbows = [np.array((end.x - 0.09 * leg.u_x, end.y - 0.09 * leg.u_y)) for leg in (end.leg1, end.leg2)]
    line, to = elbows[1] - elbows[0], np.array((end.x, end.y)) - elbows[0]
    return float((line[0] * to[1] - line[1] * to[0]) / np.hypot(*line))


@pytest.mark.parametrize(
    ("at", "length", "height"),
    [("centre", 0.03, 6.4), ("centre", -0.03, 6.4), ("aside", 0.02, 7.45), ("aside", -0.02, -1.5)],
)
def test_a_drive_along_v1_leaves_the_locus_by_geometry_to_a_side_that_is_known(
    dextar: FiveBar, at: str, length: float, height: float
) -> None:
    """At the centre to the same side either way, with the square of the way; whatever its pace and the friction."""
    state = on_the_locus(dextar, *STRETCHED[at], beside=1e-8)
    for duration in (0.15, 0.3):
        drive = driven_along(dextar, state, length, duration)
        plain = height_driven(dextar, state, drive)
        assert 1e3 * plain == pytest.approx(height, abs=0.1)
        assert height_of(dextar, state_at(dextar, drive, duration)) == pytest.approx(plain, rel=0.12, abs=5e-4)
        for scale in (0.8, 1.2):
            assert height_driven(dextar, state, drive, friction_scale=scale) == pytest.approx(plain, abs=4e-4)
    if at == "centre":
        half = height_driven(dextar, state, driven_along(dextar, state, 0.5 * length, 0.3))
        assert plain / half == pytest.approx(4.0, rel=0.05)


@pytest.mark.parametrize("beside", [1e-3, -2e-3])
def test_what_a_rest_beside_the_line_and_a_tilt_add_to_a_drive_is_that_of_a_free_mass(
    dextar: FiveBar, beside: float
) -> None:
    state, duration = on_the_locus(dextar, *STRETCHED["centre"], beside=1e-8), 0.25
    drive = driven_along(dextar, state, 0.03, duration)
    plain = height_driven(dextar, state, drive)
    off = height_driven(dextar, on_the_locus(dextar, *STRETCHED["centre"], beside=beside), drive)
    assert off - plain == pytest.approx(beside, rel=0.05)
    one, other = (height_driven(dextar, state, drive, tilt=Tilt(0.005, sign * math.pi / 2.0)) for sign in (1.0, -1.0))
    # the line turns meanwhile, so that a way along t_s is a little less above it
    assert abs(one - other) == pytest.approx(0.96 * 9.81 * 0.005 * duration**2, rel=0.01)
    assert 0.5 * (one + other) == pytest.approx(plain, abs=3e-5)


@pytest.mark.parametrize(("at", "length"), [("centre", 0.03), ("aside", 0.02), ("aside", -0.02)])
@pytest.mark.parametrize("duration", [0.15, 0.25])
def test_passive_friction_takes_from_a_drive_what_is_counted(
    dextar: FiveBar, at: str, length: float, duration: float
) -> None:
    state = on_the_locus(dextar, *STRETCHED[at], beside=1e-8)
    drive = driven_along(dextar, state, length, duration)
    lost = height_driven(dextar, state, drive) - height_driven(
        dextar, state, drive, friction=FrictionEffects(passive=0.002)
    )
    free, dragged = (finished(reach_of(dextar, drive, Loads(passive=moment))) for moment in (0.0, 0.002))
    assert abs(lost) > 3e-4
    assert free - dragged == pytest.approx(lost, rel=0.15) or dragged == 0.0
    tilted = finished(reach_of(dextar, drive, Loads(tilt=0.002)))
    taken = 0.5 * 9.81 * 0.002 * duration**2
    assert abs(free) - abs(tilted) == pytest.approx(min(taken, abs(free)), rel=1e-3)


def test_the_odds_of_the_side_are_those_of_rests_that_the_encoders_take_for_the_line(dextar: FiveBar) -> None:
    """Rests whose elbows' distance is measured with a known deviation, either side alike."""
    state = on_the_locus(dextar, *STRETCHED["centre"])
    stand = standstill_at(dextar, KNOWN, state.leg1.q1, state.leg2.q1)
    assert stand is not None
    random = np.random.default_rng(2)
    gaps = stand.gap + random.normal(0.0, stand.gap_deviation, 400_000)
    # the height of two links of 90 mm whose ends are nearer by the gap than when they are stretched
    heights = np.sqrt(np.clip(0.09**2 - (0.09 - 0.5 * gaps) ** 2, 0.0, None)) * random.choice((1.0, -1.0), len(gaps))
    for reach in (1e-3, 3e-3, 4e-3):
        assert wrong_side(dextar, stand, reach) == pytest.approx(np.mean(heights < -reach), rel=0.05)
    assert wrong_side(dextar, stand, 0.0) == 0.5


@pytest.mark.parametrize("at", ["centre", "aside"])
@pytest.mark.parametrize("beside", [1e-6, 1.2e-3, -1.2e-3])
def test_without_a_gyroscope_the_platform_is_driven_to_the_side_that_is_likely(
    dextar: FiveBar, at: str, beside: float
) -> None:
    state = on_the_locus(dextar, *STRETCHED[at], beside=beside)
    loads = Loads(tilt=0.002, passive=0.001)
    plan = driven_plan(dextar, on_the_locus(dextar, *STRETCHED[at]), loads=loads)
    drive = plan.release.drive
    assert plan.odds > 0.999
    assert plan.modes == (drive.side, -drive.side)
    assert 0.01 < drive.length <= 0.03
    downhill = -math.pi / 2.0 * drive.side
    effects = {"friction": FrictionEffects(passive=loads.passive), "tilt": Tilt(loads.tilt, downhill)}
    motion, memory, largest = in_mujoco(dextar, state, **effects), first_memory(plan.release), 0.0
    for _ in range(2000):
        q11, _, q21, _ = motion.joints[0].tolist()
        torque, memory = release_step(plan.release, memory, q11, q21, math.nan)
        if has_ended(memory):
            break
        largest = max(largest, *map(abs, torque))
        motion.advance(torque)
    end = state_in(dextar, motion)
    assert (memory.phase, memory.assembly) == (RELEASED, drive.side)
    assert assembly_mode(end) == drive.side
    assert inverse_condition(end) > CLEAR
    assert math.dist((end.x, end.y), plan.ends[0]) < 0.01
    assert memory.fastest_motor < 2.8
    assert largest <= max(drive.cap1, plan.release.cap1, plan.release.cap2)


def test_a_drive_whose_side_is_not_sure_is_refused(dextar: FiveBar) -> None:
    centre = on_the_locus(dextar, *STRETCHED["centre"])

    def refusal(state: State = centre, **more: object) -> str:
        with pytest.raises(ReleaseRefused) as caught:
            driven_plan(dextar, state, **more)  # type: ignore[arg-type]
        return str(caught.value)

    assert "leaves the elbows' line by 4.6 mm at least, which is the right side with a probability of 0.998" in refusal(
        tolerances=KNOWN
    )
    assert "by 0.0 mm at least, which is the right side with a probability of 0.500" in refusal(loads=Loads(tilt=0.02))
    assert "where the distal links are folded: expected a hand, or a gyroscope" in refusal(folded(dextar, 0.4))
    weak = LIMITS._replace(torque_limit=0.5)
    assert "no drive along the distal links stays within reach and keeps the limits" in refusal(limits=weak)
    above = LIMITS._replace(workspace=Area(-0.1, 0.1, 0.08, 0.2))
    assert "in assembly mode - the robot would come to where a limit is: out_of_workspace" in refusal(limits=above)
    # with a gyroscope nothing is driven
    assert plan_of(dextar, centre).release.drive == NO_DRIVE


def test_a_drive_that_the_motors_do_not_follow_is_given_up(dextar: FiveBar) -> None:
    plan = driven_plan(dextar, on_the_locus(dextar, *STRETCHED["centre"]))
    one = plan.release

    def nothing(number: int) -> float:
        return math.nan

    memory, largest = steps(plan, lambda number: (one.q11, one.q21), nothing)
    assert memory.phase == STUCK
    assert largest == pytest.approx(one.drive.cap1)
    # followed, it goes on to press, from where the motors are then
    end = state_at(dextar, one.drive, one.drive.duration)

    def followed(number: int) -> tuple[float, float]:
        time = min(max(0.0, (number - 150) / RATE), one.drive.duration)
        state = state_at(dextar, one.drive, time)
        way = min(2e-5 * max(0, number - 290), 1.01 * one.way)
        return state.leg1.q1 + one.per_way1 * way, state.leg2.q1 + one.per_way2 * way

    memory, _ = steps(plan, followed, nothing)
    assert (memory.phase, memory.assembly) == (RELEASED, one.drive.side)
    assert (memory.base1, memory.base2) == pytest.approx((end.leg1.q1, end.leg2.q1), abs=1e-3)


def test_a_plan_of_a_drive_leaves_time_between_its_slices(dextar: FiveBar) -> None:
    state = on_the_locus(dextar, *STRETCHED["centre"])
    q11, q21 = state.leg1.q1, state.leg2.q1
    task = ReleaseTask(dextar, CALIBRATED, LIMITS, UNKNOWN, RATE, Loads(passive=0.001))
    planned = plan_in_slices(task, q11, q21, None, False)
    assert sum(1 for _ in planned) > 20
    pressed = plan_in_slices(task, q11, q21)
    assert sum(1 for _ in pressed) == 0


def plan_of(
    robot: FiveBar, state: State, limits: Limits = LIMITS, platform: tuple[float, float] | None = None
) -> ReleasePlan:
    return finished(
        plan_in_slices(ReleaseTask(robot, KNOWN, limits, UNKNOWN, RATE), state.leg1.q1, state.leg2.q1, platform)
    )


def release(robot: FiveBar, plan: ReleasePlan, motion: MujocoMotion) -> tuple[ReleaseMemory, State]:
    """Carry a release out; the gyroscope has a bias and noise."""
    random = np.random.default_rng(4)
    memory = first_memory(plan.release)
    for _ in range(4000):
        (q11, _, q21, _), (_, _, dq21, dq22) = motion.joints
        rate = dq21 + dq22 + 0.02 + random.normal(0.0, 0.01)
        torque, memory = release_step(plan.release, memory, float(q11), float(q21), float(rate))
        if has_ended(memory):
            break
        assert math.isfinite(motion.advance(torque))
    return memory, state_in(robot, motion)


@pytest.mark.extra
@pytest.mark.parametrize("at", STRETCHED)
@pytest.mark.parametrize("beside", [1e-6, 3e-3, -3e-3])
def test_pressed_elbows_drop_the_platform_to_a_side_that_the_gyroscope_tells(
    dextar: FiveBar, at: str, beside: float
) -> None:
    state = on_the_locus(dextar, *STRETCHED[at], beside=beside)
    plan = plan_of(dextar, state)
    assert plan.modes == (1, -1)
    loads = {"friction": FrictionEffects(passive=0.003), "tilt": Tilt(0.01, 2.0)}
    memory, end = release(dextar, plan, in_mujoco(dextar, state, **loads))
    assert memory.phase == RELEASED
    assert memory.assembly == assembly_mode(end)
    if abs(beside) > 1e-3:
        assert memory.assembly == assembly_mode(state)
    assert inverse_condition(end) > CLEAR
    assert math.dist((end.x, end.y), plan.ends[plan.modes.index(memory.assembly)]) < 0.01
    assert memory.fastest_motor < 1.0


@pytest.mark.parametrize("heading", [0.4, *(pytest.param(one, marks=pytest.mark.extra) for one in (1.3, -2.5))])
def test_elbows_in_one_place_are_opened_to_the_mode_that_was_planned(dextar: FiveBar, heading: float) -> None:
    state = folded(dextar, heading)
    plan = plan_of(dextar, state, platform=(state.x + 0.004, state.y - 0.003))
    assert plan.pivot
    memory, end = release(dextar, plan, in_mujoco(dextar, state, friction=FrictionEffects(passive=0.003)))
    assert (memory.phase, memory.assembly) == (RELEASED, plan.modes[0])
    assert assembly_mode(end) == plan.modes[0]
    assert math.dist((end.x, end.y), plan.ends[0]) < 0.005
    assert inverse_condition(end) > CLEAR


def test_what_is_not_known_is_refused_with_the_reason(dextar: FiveBar) -> None:
    centre, together = on_the_locus(dextar, 0.0, 1), folded(dextar, 0.4)
    away = state_from_platform(dextar, (1, -1), 0.0, 0.12, 0.0, 0.0)
    place = together.x, together.y
    above = LIMITS._replace(workspace=Area(-0.1, 0.1, 0.08, 0.2))

    def refusal(state: State, **more: object) -> str:
        with pytest.raises(ReleaseRefused) as caught:
            plan_of(dextar, state, **more)  # type: ignore[arg-type]
        return str(caught.value)

    assert refusal(away).startswith("not near the Type 2 locus: the platform is 33.4 mm beside")
    beside = state_from_platform(dextar, (-1, 1), 0.0, 0.12, 0.0, 0.0)
    assert refusal(beside).startswith("not near the Type 2 locus")
    assert "anywhere on a circle" in refusal(together)
    assert "from the elbows: expected 90.0 mm within 10 mm" in refusal(together, platform=(0.0, 0.0))
    assert "in assembly mode - the robot would come to where a limit is: out_of_workspace" in refusal(
        centre, limits=above
    )
    assert refusal(centre, limits=LIMITS._replace(torque_limit=1.0)).startswith("the motors need 1.3 Nm")
    with pytest.raises(ReleaseRefused, match=r"elbows_pass: false"):
        task = ReleaseTask(dextar, KNOWN, LIMITS, False, RATE)
        finished(plan_in_slices(task, together.leg1.q1, together.leg2.q1, place))


def steps(plan: ReleasePlan, angles: object, rate: object, samples: int = 3000) -> tuple[ReleaseMemory, float]:
    """Take samples until the release ends; return its memory and the largest torque."""
    memory, largest = first_memory(plan.release), 0.0
    for number in range(samples):
        torque, memory = release_step(plan.release, memory, *angles(number), rate(number))  # type: ignore[operator]
        largest = max(largest, abs(torque.tau1), abs(torque.tau2))
        if has_ended(memory):
            assert tuple(torque) == (0.0, 0.0)
            assert tuple(release_step(plan.release, memory, *angles(number), 0.0)[0]) == (0.0, 0.0)  # type: ignore[operator]
            break
    return memory, largest


def test_it_gives_up_with_zero_torque_at_every_limit(dextar: FiveBar) -> None:
    plan = plan_of(dextar, on_the_locus(dextar, 0.0, 1))
    one = plan.release

    def at_rest(number: int) -> tuple[float, float]:
        return one.q11, one.q21

    def on_the_way(pace: float) -> object:
        return lambda number: (
            one.q11 + one.per_way1 * min(pace * max(0, number - 160), 1.01 * one.way),
            one.q21 + one.per_way2 * min(pace * max(0, number - 160), 1.01 * one.way),
        )

    def still(number: int) -> float:
        return 0.01

    assert steps(plan, at_rest, lambda number: math.nan)[0].phase == NO_GYROSCOPE
    memory, largest = steps(plan, at_rest, still)
    assert memory.phase == STUCK
    assert largest == pytest.approx(max(one.cap1, one.cap2), rel=1e-3)
    assert steps(plan, on_the_way(1e-5), still)[0].phase == UNDECIDED
    assert steps(plan, on_the_way(1e-5), lambda number: 0.0 if number < 200 else 20.0)[0].phase == TOO_FAST
    assert steps(plan, on_the_way(1e-5), lambda number: 0.0 if number < 200 else -math.inf)[0].phase == TOO_FAST
    assert steps(plan, lambda number: (one.q11 + 0.01 * max(0, number - 160), one.q21), still)[0].phase == TOO_FAST
    assert steps(plan, lambda number: (one.q11 + 1e-4 * number, one.q21), still)[0].phase == NOT_AT_REST
    assert steps(plan, at_rest, lambda number: 0.0 if number < 100 else 2.0)[0].phase == NOT_AT_REST
    assert steps(plan, at_rest, lambda number: math.inf)[0].phase == NOT_AT_REST
    drift = 1.1 * one.travel
    assert (
        steps(plan, lambda number: (one.q11, one.q21 - drift * min(1.0, max(0, number - 160) / 200)), still)[0].phase
        == TOO_FAR
    )


@pytest.mark.parametrize("assembly", [1, -1])
def test_the_gyroscope_decides_between_two_hypotheses_that_the_encoders_fit_alike(
    dextar: FiveBar, assembly: int
) -> None:
    plan = plan_of(dextar, on_the_locus(dextar, 0.0, 1))
    one = plan.release

    def angles(number: int) -> tuple[float, float]:
        way = min(2e-5 * max(0, number - 160), 1.01 * one.way)
        return one.q11 + one.per_way1 * way, one.q21 + one.per_way2 * way

    def turned(number: int) -> float:
        q11, q21 = angles(number)
        x, y = direct_geometry(dextar, assembly, q11, q21)
        at = inverse_geometry(dextar, (1, -1), x, y)
        return one.start if math.isnan(x) else at.q21 + at.q22

    memory, _ = steps(plan, angles, lambda number: RATE * math.remainder(turned(number) - turned(number - 1), math.tau))
    assert (memory.phase, memory.assembly) == (RELEASED, assembly)
    right, wrong = (memory.misfit_plus, memory.misfit_minus)[::assembly]
    assert right < 0.1 < 0.3 < wrong
