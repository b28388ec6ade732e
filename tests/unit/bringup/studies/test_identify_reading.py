# SPDX-License-Identifier: Apache-2.0
"""From bags to records: which topics count, gaps, and bags that cannot serve."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from fivebar_bringup.bag import serialize
from fivebar_bringup.bag.writer import BagWriter
from fivebar_bringup.errors import BagError
from fivebar_bringup.identify.reading import Source, read_record
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.interface import ACTIVE_JOINTS, JOINT_STATES, JOINTS, MOTOR_STATES, sample_stamp_ns
from fivebar_description.robot_file import read_robot
from fivebar_description.strict_yaml import InputError

Array = NDArray[np.float64]

RATE = 500
SAMPLES = 30


def postures(count: int = SAMPLES) -> Array:
    """[count, 4] joints of dextar on its way down."""
    robot = read_robot("dextar").five_bar()
    return np.array([inverse_geometry(robot, (1, -1), 0.01, 0.15 - 1e-3 * k) for k in range(count)])


def bag_of(
    path: Path,
    joints: Array,
    efforts: Array | None = None,
    samples: list[int] | None = None,
    names: tuple[str, ...] = JOINTS,
    motors: Array | None = None,
    shift_ns: int = 0,
) -> Source:
    """Write joints [n, 4] with efforts [n, 4], and motors [n, 2] (torques: the same numbers) where given."""
    numbers = samples if samples is not None else list(range(len(joints)))
    topics = [JOINT_STATES] if motors is None else [JOINT_STATES, MOTOR_STATES]
    with BagWriter(path / "bag", topics) as bag:
        for row, number in enumerate(numbers):
            stamp = sample_stamp_ns(number, RATE) + shift_ns * row
            effort = (0.1, 0.0, 0.2, 0.0) if efforts is None else tuple(efforts[row].tolist())
            message = serialize.joint_state(stamp, names, tuple(joints[row].tolist()), (), effort)
            bag.write(JOINT_STATES, stamp, message)
            if motors is not None:
                pair = (float(motors[row, 0]), float(motors[row, 1]))
                bag.write(MOTOR_STATES, stamp, serialize.joint_state(stamp, ACTIVE_JOINTS, pair, effort=pair))
        bag.close({})
    return Source(path / "bag", None)


def test_motors_and_assembly_mode_of_joint_states(tmp_path: Path) -> None:
    efforts = np.arange(4.0 * SAMPLES).reshape(SAMPLES, 4)
    record = read_record(bag_of(tmp_path, postures(), efforts), read_robot("dextar"))
    assert record.rate_hz == RATE
    assert np.array_equal(record.angles, postures()[:, [0, 2]])
    assert np.array_equal(record.torques, efforts[:, [0, 2]])
    assert set(record.assembly.tolist()) == {1.0}


def test_the_mode_changes_where_the_platform_crosses_the_locus(tmp_path: Path) -> None:
    """On the vertical axis the locus is at sqrt(0.0081 - 0.000961) = 0.0845 m."""
    record = read_record(bag_of(tmp_path, postures(100)), read_robot("dextar"))
    change = np.flatnonzero(np.diff(record.assembly))
    assert len(change) == 1
    assert 0.15 - 1e-3 * change[0] == pytest.approx(0.0845, abs=2.5e-3)


def test_motor_states_come_first(tmp_path: Path) -> None:
    motors = np.stack([np.arange(SAMPLES), -np.arange(SAMPLES)], axis=1) / 7.0
    record = read_record(bag_of(tmp_path, postures(), motors=motors), read_robot("dextar"))
    assert np.array_equal(record.angles, motors)
    assert np.array_equal(record.torques, motors)


def test_angles_that_were_wrapped_to_one_turn_are_continuous(tmp_path: Path) -> None:
    motors = np.stack([np.linspace(2.5, 4.0, SAMPLES), np.linspace(-2.5, -7.0, SAMPLES)], axis=1)
    wrapped = np.remainder(motors + math.pi, math.tau) - math.pi
    assert np.max(np.abs(np.diff(wrapped, axis=0))) > 6.0
    record = read_record(bag_of(tmp_path, postures(), motors=wrapped), read_robot("dextar"))
    assert record.angles == pytest.approx(motors, abs=1e-12)


def test_missing_samples_are_unknown_and_repeated_ones_count_once(tmp_path: Path) -> None:
    joints = postures()
    numbers = [0, 0, *range(1, 10), *range(12, 30)]
    rows = np.array([joints[number] for number in numbers])
    rows[1] += 0.001
    record = read_record(bag_of(tmp_path, rows, samples=numbers), read_robot("dextar"))
    assert len(record.angles) == 30
    assert np.flatnonzero(np.isnan(record.angles[:, 0])).tolist() == [10, 11]
    assert np.isnan(record.torques[10:12]).all()
    assert np.array_equal(record.angles[0], joints[0, [0, 2]])
    assert np.array_equal(record.angles[29], joints[29, [0, 2]])


def test_a_number_that_is_none_is_named(tmp_path: Path) -> None:
    joints = postures()
    joints[4, 2] = math.nan
    with pytest.raises(BagError, match=r"/joint_states: position of q21 is nan in message 5$"):
        read_record(bag_of(tmp_path, joints), read_robot("dextar"))


def test_an_endless_torque_is_named(tmp_path: Path) -> None:
    efforts = np.zeros((SAMPLES, 4))
    efforts[7, 0] = math.inf
    with pytest.raises(BagError, match=r"/joint_states: effort of q11 is inf in message 8$"):
        read_record(bag_of(tmp_path, postures(), efforts), read_robot("dextar"))


def test_a_bag_without_torques_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="/joint_states: holds no effort of its joints"):
        read_record(bag_of(tmp_path, postures(), np.zeros((SAMPLES, 0))), read_robot("dextar"))


def test_other_joints_are_refused(tmp_path: Path) -> None:
    source = bag_of(tmp_path, postures(), names=("q11", "q12", "q31", "q32"))
    with pytest.raises(BagError, match="/joint_states: has no q21"):
        read_record(source, read_robot("dextar"))


TURN = np.array([np.pi / 2, 0.0, np.pi / 2, 0.0])


@pytest.mark.parametrize(
    ("angles", "words"),
    [
        (postures() * [1, 1, -1, 1], "the angles of q21 have the opposite sign"),
        (postures() * [1, -1, 1, 1], "the angles of q12 have the opposite sign"),
        (postures() * [-1, 1, -1, 1], "the angles of q11 and q21 have the opposite sign"),
        (np.degrees(postures()), "the angles are in degrees: expected rad"),
        (postures()[:, [2, 3, 0, 1]], "both legs are exchanged"),
        (postures()[:, [0, 0, 2, 2]] + postures() * [0, 1, 0, 1], "q12 and q22 count from the x axis"),
        (postures() - TURN, "the angles count from the y axis"),
        (0.5 * postures(), "is it the robot of the bag?"),
    ],
)
def test_angles_that_are_counted_otherwise_are_named(angles: Array, words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=f"mm apart, expected at most 2 mm: {re.escape(words)}"):
        read_record(bag_of(tmp_path, angles), read_robot("dextar"))


def test_stamps_off_the_grid_are_refused(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="its stamps are on no grid"):
        read_record(bag_of(tmp_path, postures(), samples=[0, *range(3, 32)], shift_ns=13), read_robot("dextar"))


def test_one_sample_is_too_short(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="1 samples: too short"):
        read_record(bag_of(tmp_path, postures(1)), read_robot("dextar"))


def test_an_empty_bag_says_so(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="/joint_states"):
        read_record(bag_of(tmp_path, postures(0).reshape(0, 4)), read_robot("dextar"))
