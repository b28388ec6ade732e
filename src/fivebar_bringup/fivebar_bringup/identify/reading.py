# SPDX-License-Identifier: Apache-2.0
"""Reads the record that a robot is identified from out of a bag."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.recording import FloatArray, IntArray, Recording
from fivebar_bringup.errors import BagError
from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_control.identification.equations import Record
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.interface import ACTIVE_JOINTS, JOINT_STATES, JOINTS, MOTOR_STATES, NANOSECONDS, Topic
from fivebar_description.robot_file import RobotFile, read_robot
from fivebar_description.strict_yaml import InputError
from fivebar_description.whole_turns import continuous

LARGEST_GAP = 2e-3
"""Largest gap (m, median) between the tips of both legs at the recorded joint angles, for a robot's own lengths."""

POSTURES = 200
"""Number of postures at which the gap is evaluated."""

QUARTERS = 0.5 * math.pi * np.array([1.0, 0.0, 1.0, 0.0])
"""A quarter of a turn of both proximal links."""

MOST_MISSING = 10
"""Samples of the grid per recorded one, beyond which the stamps are not accepted as a grid."""


def _reversed(*joints: str) -> Callable[[FloatArray], FloatArray]:
    factors = np.array([-1.0 if joint in joints else 1.0 for joint in JOINTS])
    return lambda angles: angles * factors


OTHER_ANGLES: tuple[tuple[str, Callable[[FloatArray], FloatArray]], ...] = (
    *((f"the angles of {joint} have the opposite sign", _reversed(joint)) for joint in JOINTS),
    ("the angles of q11 and q21 have the opposite sign", _reversed(*ACTIVE_JOINTS)),
    ("the angles are in degrees: expected rad", np.radians),
    ("both legs are exchanged", lambda angles: angles[:, [2, 3, 0, 1]]),
    (
        "q12 and q22 count from the x axis: expected from the proximal link",
        lambda angles: angles - angles[:, [0, 0, 2, 2]] * [0.0, 1.0, 0.0, 1.0],
    ),
    ("the angles count from the y axis: expected from the x axis", lambda angles: angles + QUARTERS),
    ("the angles count from the -y axis: expected from the x axis", lambda angles: angles - QUARTERS),
)
"""Other readings of joint angles, [n, 4], that would close the loop, in words."""


class Source(NamedTuple):
    """Where a record comes from: the bag, the run's directory if it lies in one, and the namespace of its topics."""

    bag: Path
    run: RunDirectory | None
    namespace: str | None = None


def find_bag(path: Path, namespace: str | None = None) -> Source:
    """Return the bag that a path names: a bag, or the directory of a run; `namespace` is that of its topics, if known.

    Raises:
        InputError: there is neither.
    """
    if not path.is_dir():
        raise InputError(f"{path}: no such directory: expected a bag or the directory of a run")
    # what is there and is no file is refused where it is read
    if (path / "metadata.yaml").exists():
        run = RunDirectory(path.resolve().parent)
        return Source(path, run if run.scenario.is_file() else None, namespace)
    run = RunDirectory(path)
    if not run.bag.is_dir():
        raise InputError(f"{path}: holds neither a bag (metadata.yaml) nor a run ({run.bag.name}/)")
    return Source(run.bag, run if run.scenario.is_file() else None, namespace)


def read_start(source: Source, robot: str | None) -> RobotFile:
    """Return the robot file that identification starts from: a given one, else that of the run's scenario.

    Raises:
        InputError: there is none, or it does not describe a five-bar.
    """
    if robot is not None:
        return read_robot(robot)
    if source.run is None:
        raise InputError(f"--robot: expected the robot's name or file: {source.bag} lies in no run")
    return read_robot(source.run.read_scenario().robot)


def read_record(source: Source, start: RobotFile) -> Record:
    """Return angles and torques from `motor_states` where the bag has it, else from `joint_states`.

    The passive joints are used for two things only: they give the assembly mode, and must close the robot's loop.

    Raises:
        BagError: the bag cannot be read or does not have the topics.
        InputError: they hold no numbers, no torques, no grid of stamps, or another robot's joints.
    """
    recording = read_bag(source.bag, source.namespace)
    topic = MOTOR_STATES if recording.count(MOTOR_STATES) else JOINT_STATES
    recording.refuse_clock_steps(topic, JOINT_STATES)
    period, numbers = _grid(recording, topic)
    motors = [
        _on_grid(joint_columns(recording, topic, ACTIVE_JOINTS, field), numbers, numbers[-1] + 1)
        for field in ("position", "effort")
    ]
    joints = joint_columns(recording, JOINT_STATES, JOINTS, "position")
    _refuse_foreign(source, start, joints)
    mode = np.sign(np.sin(joints[:, 2] + joints[:, 3] - joints[:, 0] - joints[:, 1]))[:, None]
    first = int(recording.stamps(topic)[0])
    steps, rest = np.divmod(recording.stamps(JOINT_STATES) - first, period)
    assembly = _on_grid(mode, np.where(rest == 0, steps, -1), numbers[-1] + 1)
    return Record(NANOSECONDS / period, motors[0], motors[1], assembly[:, 0])


def _grid(recording: Recording, topic: Topic) -> tuple[int, IntArray]:
    """Return the sampling period (ns) and the numbers of a topic's messages on the grid of its stamps."""
    stamps = recording.stamps(topic)
    steps = np.diff(np.unique(stamps))
    if not steps.size:
        raise BagError(recording.path, f"/{topic.name}: {len(stamps)} samples: too short to identify anything")
    period = int(np.min(steps))
    numbers, rest = np.divmod(stamps - stamps[0], period)
    if np.any(rest) or np.any(numbers < 0) or numbers[-1] > MOST_MISSING * len(stamps):
        raise BagError(recording.path, f"/{topic.name}: its stamps are on no grid: expected those of a sampled run")
    return period, numbers


def joint_columns(recording: Recording, topic: Topic, names: Sequence[str], field: str) -> FloatArray:
    """Return [messages, names] of a topic of JointState, angles of joints without jumps by whole turns."""
    chosen = recording.values(topic, field, names)
    broken = np.argwhere(~np.isfinite(chosen))
    if broken.size:
        message, column = broken[0].tolist()
        value = chosen[message, column]
        raise BagError(recording.path, f"/{topic.name}: {field} of {names[column]} is {value} in message {message + 1}")
    return continuous(chosen) if field == "position" and set(names) <= set(JOINTS) else chosen


def _on_grid(values: FloatArray, numbers: IntArray, count: int) -> FloatArray:
    """Return [count, columns]; of several messages with one number the first is used; NaN where there is none."""
    placed = np.full((count, values.shape[1]), math.nan)
    unique, first = np.unique(numbers, return_index=True)
    inside = (unique >= 0) & (unique < count)
    placed[unique[inside]] = values[first[inside]]
    return placed


def _refuse_foreign(source: Source, start: RobotFile, joints: FloatArray) -> None:
    """Raise where the recorded joints do not close the loop of the robot."""
    loop = ClosedLoop(start.five_bar())
    some = joints[:: max(1, len(joints) // POSTURES)]

    def gap_of(angles: FloatArray) -> float:
        return float(np.median([math.hypot(*loop.tip_gap(q).gap.tolist()) for q in angles]))

    gap = gap_of(some)
    if gap > LARGEST_GAP:
        words = next((words for words, read in OTHER_ANGLES if gap_of(read(some)) <= LARGEST_GAP), None)
        raise InputError(
            f"{source.bag}: with the lengths of robot {start.name} the recorded legs end {1e3 * gap:.1f} mm apart,"
            f" expected at most {1e3 * LARGEST_GAP:.0f} mm: {words or 'is it the robot of the bag?'}"
        )
