# SPDX-License-Identifier: Apache-2.0
"""The calibration on robots whose readings come from the closed-form geometry of the model, an independent path."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from led_robot import BIAS, PATH, led, passive_angles, places, with_errors

from fivebar_control.calibration.by_turning_points import calibrate_by_turning_points, dragged_lag
from fivebar_control.calibration.calibration import calibrate
from fivebar_control.calibration.closure import GEOMETRY, closure, distal_angles, geometry_of, locus_rows
from fivebar_control.calibration.mounting import find_mounting
from fivebar_control.calibration.observability import SCALE, SHIFT, unseen
from fivebar_control.calibration.parameters import COMPLIANCE, PARAMETERS, deviations_before
from fivebar_control.calibration.passive import PassiveReadings, find_passive_zero
from fivebar_control.calibration.record import CalibrationRecord, NotCalibratable, SeenPositions, TouchedPoint
from fivebar_control.calibration.result import Calibration
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.imu import ImuSettings
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import load_robot
from fivebar_description.tolerances import Tolerances
from fivebar_description.transmission import RIGID, Transmission

TOLERANCES = Tolerances(length=3e-4, base=3e-4, zero=3.5e-3)
HELD_BASES = TOLERANCES._replace(base=0.0)
ERRORS = np.array([2.4e-4, -1.9e-4, -2.8e-4, 1.1e-4, 0.0, 0.0])
ZEROS = (2.9e-3, -2.2e-3)
NARROW = ((0.0, 0.12), (0.0, 0.0), (0.02, 0.11), (0.006, 0.01), (-0.02, 0.11), (-0.006, 0.01), (0.04, 0.1), (0.0, 0.0))
"""Passages of the MOTKIN bench (m), elbows outwards."""

CAMERA_AT = np.array([4e-4, -3e-4, 2e-3, 3e-3])
"""The camera's frame in the robot's (m, rad), and the delay of its stamps (s)."""


def errors_of(found: Calibration, robot: FiveBar, zeros: tuple[float, float]) -> np.ndarray:
    actual = geometry_of(robot)
    actual[6:] = zeros
    return found.values[: len(GEOMETRY)] - actual


def gaps(found: Calibration, errors: np.ndarray) -> np.ndarray:
    """Errors of the elbow gap (m) at the crossings."""
    return np.array([row @ errors for _, row in found.crossings])


def test_derivatives_of_the_closure(dextar: FiveBar) -> None:
    random = np.random.default_rng(1)
    geometry = geometry_of(dextar) + random.uniform(-1e-3, 1e-3, 8)
    motors, theta = random.uniform(-2.0, 2.0, (20, 2)), random.uniform(-3.0, 3.0, 20)
    closed, h = closure(geometry, motors, theta), 1e-6

    def slope(*moved: np.ndarray) -> np.ndarray:
        plus = closure(geometry + moved[0], motors + moved[1], theta + moved[2]).gap
        return (plus - closure(geometry - moved[0], motors - moved[1], theta - moved[2]).gap) / (2.0 * h)

    nothing = np.zeros(8), np.zeros(2), np.zeros(1)
    for number in range(8):
        assert closed.by_geometry[:, number] == pytest.approx(slope(h * np.eye(8)[number], *nothing[1:]), abs=1e-8)
    for number in range(2):
        assert closed.by_motors[:, number] == pytest.approx(
            slope(nothing[0], h * np.eye(2)[number], nothing[2]), abs=1e-8
        )
    assert closed.by_theta == pytest.approx(slope(nothing[0], nothing[1], np.full(1, h)), abs=1e-8)


def test_exact_readings_give_the_geometry_where_the_bases_are_known(dextar: FiveBar) -> None:
    robot = with_errors(dextar, ERRORS)
    found = calibrate(dextar, HELD_BASES, led(robot, ZEROS))
    assert np.abs(errors_of(found, robot, ZEROS)).max() < 2e-7  # m and rad
    assert found.values[PARAMETERS.index("gyro_bias")] == pytest.approx(BIAS, abs=1e-5)
    assert len(found.crossings) == len(PATH) - 1
    assert not unseen(found)


def test_rounding_does_not_make_a_smaller_robot_fit_better(dextar: FiveBar) -> None:
    """The scale is not seen, and stays where it was: in standard deviations before."""
    robot = with_errors(dextar, ERRORS)
    record = led(robot, ZEROS, PATH[:5], counts=20_000, imu=ImuSettings(gyro_bias=BIAS, gyro_noise=0.01))
    found = calibrate(dextar, TOLERANCES, record)
    deviations = found.before[: len(GEOMETRY)]
    scale = np.concatenate((found.values[:6], np.zeros(2))) / deviations
    moved = (found.values - found.start)[: len(GEOMETRY)] / deviations
    assert abs(scale @ moved) / np.linalg.norm(scale) < 0.03


def test_without_a_touched_point_scale_and_origin_are_not_seen_and_said_so(dextar: FiveBar) -> None:
    robot = with_errors(dextar, np.array([*ERRORS[:4], 1e-4, -2e-4]))
    record = led(robot, ZEROS)
    found = calibrate(dextar, TOLERANCES, record)
    errors = errors_of(found, robot, ZEROS)
    assert {one.words for one in unseen(found)} == {SCALE, SHIFT}
    assert np.abs(gaps(found, errors)).max() < 1e-8
    # all in proportion, and the same zeros
    assert np.ptp(errors[:4] / found.values[:4]) < 1e-5
    assert np.abs(errors[6:]).max() < 1e-6
    touched = tuple(
        TouchedPoint(q.q11 + ZEROS[0], q.q21 + ZEROS[1], x, y, 1e-6)
        for x, y in ((0.0, 0.14), (0.04, 0.12))
        for q in [inverse_geometry(robot, (1, -1), x, y)]
    )
    found = calibrate(dextar, TOLERANCES, record, touched=touched)
    assert not unseen(found)
    assert np.abs(errors_of(found, robot, ZEROS)).max() < 2e-6


def seen_by_a_camera(place: np.ndarray, times: np.ndarray, seed: int) -> SeenPositions:
    """Every 15th place, in a frame of its own, with late stamps and noise; some were not seen."""
    random, turn = np.random.default_rng(seed), CAMERA_AT[2]
    there = place[::15]
    turned = turn * np.stack((-there[:, 1], there[:, 0]), axis=1)
    seen = there + turned + CAMERA_AT[:2] + random.normal(0, 2e-5, there.shape)
    seen[::7] = np.nan
    return SeenPositions(times[::15] + CAMERA_AT[3], seen, np.full(len(there), 1e-5))


def test_a_cameras_positions_show_the_scale(dextar: FiveBar) -> None:
    """Which angles and rates leave open; with the camera's own frame and clock among the unknowns."""
    inside = []
    for seed in range(2):
        random = np.random.default_rng(seed)
        robot = with_errors(dextar, random.uniform(-3e-4, 3e-4, 6))
        zeros = tuple(random.uniform(-3.5e-3, 3.5e-3, 2).tolist())
        imu = ImuSettings(gyro_bias=BIAS, gyro_noise=0.01)
        record = led(robot, zeros, PATH[:5], counts=20_000, imu=imu, seed=seed)
        seen = seen_by_a_camera(np.array(places(PATH[:5])), record.times, seed)
        blind, found = calibrate(dextar, TOLERANCES, record), calibrate(dextar, TOLERANCES, record, seen=seen)
        assert found.seen > 20
        assert SCALE in {one.words for one in unseen(blind)}
        assert SCALE not in {one.words for one in unseen(found)}
        errors = errors_of(found, robot, zeros)
        lengths, before = found.half_widths[:4], blind.half_widths[:4]
        assert lengths.max() < 0.5 * before.max()
        assert found.values[-2:] == pytest.approx(CAMERA_AT[2:], abs=1e-3)
        inside += [np.abs(errors) < found.half_widths[: len(GEOMETRY)]]
        inside += [np.abs(gaps(found, errors)) < found.gap_half_widths()]
    # 24 values of which 95 % are expected inside
    assert np.mean(np.concatenate(inside)) > 0.86


def test_a_second_recording_in_the_mirrored_mode_tells_the_elbow_gap_all_over_the_locus() -> None:
    """One motion tells it where it crosses: elsewhere it remains open, and the second one begins from what is known."""
    motkin, random = load_robot("motkin"), np.random.default_rng(3)
    robot = with_errors(motkin, random.uniform(-3e-4, 3e-4, 6))
    zeros = tuple(random.uniform(-3.5e-3, 3.5e-3, 2).tolist())
    first, second = (
        led(robot, zeros, path, counts=20_000, imu=ImuSettings(gyro_bias=bias, gyro_noise=0.01), mode=mode)
        for path, bias, mode in ((NARROW, BIAS, (1, -1)), (tuple((x, -y) for x, y in NARROW), 0.0, (-1, 1)))
    )
    one, alone = calibrate(motkin, TOLERANCES, first), calibrate(motkin, TOLERANCES, second)
    both = calibrate(motkin, TOLERANCES, second, known=one)
    assert min(found.locus_half_widths().max() for found in (one, alone)) > 6e-5
    assert both.locus_half_widths().max() < 1.5e-5
    errors = errors_of(both, robot, zeros)
    assert np.abs(locus_rows(both.values[: len(GEOMETRY)]) @ errors).max() < 1e-5
    # the other recording had another bias, which does not carry over
    assert both.values[PARAMETERS.index("gyro_bias")] == pytest.approx(0.0, abs=2e-3)
    assert both.start == pytest.approx(one.start)
    assert {found.words for found in unseen(both)} == {SCALE, SHIFT}


def test_a_light_robots_transmissions_may_bend_as_much_as_a_heavy_ones(dextar: FiveBar) -> None:
    """What is known of a compliance before is that of 40 Hz with the leg's inertia, not one number for all robots."""
    for robot in (dextar, load_robot("motkin")):
        bounds = deviations_before(robot, TOLERANCES)[COMPLIANCE]
        stiffness = [leg.inertia * (2.0 * np.pi * 40.0) ** 2 for leg in (robot.leg1, robot.leg2)]
        assert bounds * stiffness == pytest.approx(1.0)


def test_intervals_cover_and_the_elbow_gap_is_far_below_its_target(dextar: FiveBar) -> None:
    """Robots from +-0.3 mm and +-0.2 deg, 20 000 counts, a gyroscope with 0.01 rad/s of noise."""
    inside, largest = [], 0.0
    for seed in range(4):
        random = np.random.default_rng(seed)
        robot = with_errors(dextar, random.uniform(-3e-4, 3e-4, 6))
        zeros = tuple(random.uniform(-3.5e-3, 3.5e-3, 2).tolist())
        imu = ImuSettings(gyro_bias=BIAS, gyro_noise=0.01)
        found = calibrate(dextar, TOLERANCES, led(robot, zeros, PATH[:5], counts=20_000, imu=imu, seed=seed))
        errors = errors_of(found, robot, zeros)
        largest = max(largest, float(np.abs(gaps(found, errors)).max()))
        inside.append(np.abs(errors) < found.half_widths[: len(GEOMETRY)])
        inside.append(np.abs(gaps(found, errors)) < found.gap_half_widths())
    # 48 values of which 95 % are expected inside
    assert np.mean(np.concatenate(inside)) > 0.88
    assert largest < 1e-5


def test_play_and_compliance_of_the_transmissions_do_not_pass_for_lengths(dextar: FiveBar) -> None:
    robot = with_errors(dextar, ERRORS)
    record = led(robot, ZEROS, counts=20_000)
    speeds = np.gradient(record.motors, record.times, axis=0)
    torques = 0.02 * speeds + 0.3 * np.tanh(speeds / 0.1)
    ahead = 3e-4 * np.sign(speeds) * (np.abs(speeds) > 1e-3) + 5e-4 * torques
    moved = record._replace(motors=record.motors + ahead, torques=torques)
    found = calibrate(dextar, HELD_BASES, moved)
    assert np.abs(gaps(found, errors_of(found, robot, ZEROS))).max() < 5e-6
    stiff = calibrate(dextar, HELD_BASES, moved._replace(torques=0.0 * torques))
    assert np.abs(gaps(stiff, errors_of(stiff, robot, ZEROS))).max() < 3e-5


def test_the_mounting_of_the_imu_comes_from_axis_and_accelerometer(dextar: FiveBar) -> None:
    imu = ImuSettings(
        gyro_bias=BIAS, roll=0.1, pitch=-0.05, yaw=0.4, mount_x=-0.02, mount_y=0.008, bias=(0.2, -0.1, 0.05)
    )
    record = led(dextar, imu=imu)
    mounting = find_mounting(record, calibrate(dextar, TOLERANCES, record, imu))
    assert mounting is not None
    assert mounting.roll[0] == pytest.approx(0.1, abs=1e-6)
    assert mounting.pitch[0] == pytest.approx(-0.05, abs=1e-6)
    assert mounting.yaw[0] == pytest.approx(0.4, abs=2e-3)
    assert mounting.mount_x[0] == pytest.approx(-0.02, abs=2e-4)
    assert mounting.mount_y[0] == pytest.approx(0.008, abs=2e-4)


def test_the_zero_of_a_passive_joints_encoder_is_what_it_reads_beyond_its_angle(dextar: FiveBar) -> None:
    """Counts, at half the rate, a turn away: to the interval, which is mostly that of the motor's own zero."""
    robot, zero, count = with_errors(dextar, ERRORS), 0.013, 2.0 * np.pi / 16384
    record = led(robot, ZEROS, PATH[:5], counts=65536)
    found = calibrate(dextar, HELD_BASES, record)
    for leg in (1, 2):
        read = np.floor((passive_angles(robot, leg, PATH[:5]) + zero + 2.0 * np.pi) / count) * count
        passive = find_passive_zero(record, found, PassiveReadings(leg, record.times[::2], read[::2]))
        assert passive.leg == leg
        assert abs(passive.value - zero) < passive.half_width < 2e-3
    with pytest.raises(NotCalibratable, match="too short a time"):
        find_passive_zero(record, found, PassiveReadings(2, record.times[:100], read[:100]))


def test_encoders_alone_give_the_elbow_gap_from_the_turning_points(dextar: FiveBar) -> None:
    robot = with_errors(dextar, ERRORS)
    found = calibrate_by_turning_points(dextar, TOLERANCES, led(robot, ZEROS, counts=20_000))
    assert len(found.crossings) == len(PATH) - 1
    assert np.abs(found.gaps_before()).max() > 3e-4
    left = gaps(found, errors_of(found, robot, ZEROS))
    assert np.abs(left).max() < 1.5e-5
    assert np.all(np.abs(left) < found.gap_half_widths())


def test_encoders_that_lag_behind_their_links_leave_a_wider_interval(dextar: FiveBar) -> None:
    """A lag of both motors that every passage has alike."""
    assert dragged_lag(dextar, RIGID) == 0.0
    stiffness = dextar.leg2.inertia * (math.tau * 60.0) ** 2
    lag = dragged_lag(dextar, Transmission(frequency=60.0, backlash=4e-4))
    assert lag == pytest.approx(2e-4 + dextar.leg2.coulomb / stiffness)
    robot = with_errors(dextar, ERRORS)
    # nearly as much as is possible, and to either side
    record = led(robot, (ZEROS[0] + 0.8 * lag, ZEROS[1] - 0.8 * lag), counts=20_000)
    exact, wider = (calibrate_by_turning_points(dextar, TOLERANCES, record, one) for one in (0.0, lag))
    errors = [np.abs(gaps(one, errors_of(one, robot, ZEROS))) for one in (exact, wider)]
    assert np.any(errors[0] > exact.gap_half_widths())
    assert np.all(errors[1] < wider.gap_half_widths())
    assert wider.gap_half_widths().max() < 4.0 * lag * dextar.leg1.proximal


def refused(robot: FiveBar, record: CalibrationRecord) -> str:
    with pytest.raises(NotCalibratable) as caught:
        calibrate(robot, TOLERANCES, record)
    return str(caught.value)


def test_what_cannot_be_calibrated_is_refused_by_name(dextar: FiveBar) -> None:
    above = led(dextar, path=((0.0, 0.15), (0.04, 0.12), (-0.04, 0.13), (0.0, 0.15)))
    assert refused(dextar, above).startswith("no crossing: ")
    with pytest.raises(NotCalibratable, match="no crossing: "):
        calibrate_by_turning_points(dextar, TOLERANCES, above)
    record = led(dextar, path=PATH[:3])
    still = record._replace(angular_velocity=0.0 * record.angular_velocity)
    assert refused(dextar, still).startswith("the distal link hardly turns")
    late = record._replace(imu_times=record.imu_times + 0.5)
    assert refused(dextar, late).startswith("too short")
    half = record._replace(motors=record.motors * [1.0, 0.5])
    assert "the loop stays open by" in refused(dextar, half)


@pytest.mark.extra
@pytest.mark.parametrize(
    ("motors", "offset", "rates", "words"),
    [
        (
            [1, 1],
            0.0,
            [1, -1, -1],
            "is it mounted upside down (imu.roll: 3.14159), or do both encoders count backwards?",
        ),
        (
            [-1, -1],
            0.0,
            [1, 1, 1],
            "is it mounted upside down (imu.roll: 3.14159), or do both encoders count backwards?",
        ),
        ([-1, 1], 0.0, [1, 1, 1], "the readings of q11 have the opposite sign: its encoder counts backwards"),
        ([1, -1], 0.0, [1, 1, 1], "the readings of q21 have the opposite sign: its encoder counts backwards"),
        ([57.29578] * 2, 0.0, [1, 1, 1], "the readings of the motors are in degrees: expected rad"),
        ([1, 1], 0.0, [57.29578] * 3, "the gyroscope's readings are in degrees per second: expected rad/s"),
        ([1, 1], np.pi / 2, [1, 1, 1], "the angles of both motors count from the -y axis: expected from the x axis"),
    ],
)
def test_sensors_that_are_mounted_or_signed_otherwise_are_named(
    dextar: FiveBar, motors: list[float], offset: float, rates: list[float], words: str
) -> None:
    record = led(dextar, ZEROS, path=PATH[:5])
    other = record._replace(motors=record.motors * motors + offset, angular_velocity=record.angular_velocity * rates)
    assert refused(dextar, other).startswith("the recording contradicts the robot: ")
    assert words in refused(dextar, other)


BY_TURNING_POINTS = {
    "the readings of q11 have the opposite sign: its encoder counts backwards or the readings of q21 have the opposite"
    " sign": lambda motors: motors * [-1, 1],
    "q11 and q21 are exchanged": lambda motors: motors[:, ::-1],
    "the readings of the motors are in degrees: expected rad": lambda motors: np.degrees(motors),
    "the readings of q11 are offset by half a turn": lambda motors: motors + np.array([np.pi, 0.0]),
    "the angles of both motors count from the -y axis: expected from the x axis": lambda motors: motors + np.pi / 2,
    "the elbows come ": lambda motors: motors * [-0.9, 1.1],
}


@pytest.mark.parametrize(("words", "change"), BY_TURNING_POINTS.items())
def test_encoders_that_are_signed_otherwise_are_named_without_a_gyroscope(
    dextar: FiveBar, words: str, change: Callable[[np.ndarray], np.ndarray]
) -> None:
    record = led(dextar, ZEROS, path=PATH[:5])
    with pytest.raises(NotCalibratable) as caught:
        calibrate_by_turning_points(dextar, TOLERANCES, record._replace(motors=change(record.motors)))
    assert str(caught.value).startswith(f"the recording contradicts the robot: {words}")


def test_exchanged_motors_are_named_and_a_gyroscope_upside_down_may_be_declared(dextar: FiveBar) -> None:
    record = led(dextar, ZEROS, path=PATH[:5])
    assert refused(dextar, record._replace(motors=record.motors[:, ::-1])).endswith("q11 and q21 are exchanged")
    below = record._replace(angular_velocity=record.angular_velocity * [1.0, -1.0, -1.0])
    found = calibrate(dextar, TOLERANCES, below, ImuSettings(roll=np.pi))
    assert found.values == pytest.approx(calibrate(dextar, TOLERANCES, record).values, abs=1e-12)


def test_both_distal_angles_close_the_loop_in_their_assembly_modes(dextar: FiveBar) -> None:
    record = led(dextar, path=PATH[:2])
    away = record.motors[:50]
    both = distal_angles(geometry_of(dextar), away)
    for column, sign in ((0, -1.0), (1, 1.0)):
        closed = closure(geometry_of(dextar), away, both[:, column])
        assert np.abs(closed.gap).max() < 1e-12
        assert set(np.sign(closed.across)) == {sign}
