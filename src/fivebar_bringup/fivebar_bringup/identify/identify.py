# SPDX-License-Identifier: Apache-2.0
"""Identifies a robot from a bag and writes robot file, figures and page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fivebar_bringup.identify.reading import find_bag, read_record, read_start
from fivebar_bringup.identify.result import IdentificationResult
from fivebar_bringup.pages.study_directory import StudyDirectory
from fivebar_bringup.recorded.results import new_directory
from fivebar_control.identification.identification import NotIdentifiable, identify
from fivebar_control.identification.motor_map import MotorMap, map_motors
from fivebar_description.strict_yaml import InputError

ROBOT_FILE = "identified.yaml"
"""The robot file that `robot:` in a scenario takes."""


SCALED_BY_TORQUE = ("zz_11R", "zz_21R", "m", "f_s11", "f_s21")
"""Keys that are off by one factor where the torques are: no robot differs from its file in all by the same one."""

LEAST_FACTOR = 2.5
"""Factor from which on the torques' unit is doubted: a file of estimates may be off by two."""

SPREAD = 0.5
"""Largest ratio of two of these factors, as a power of what they have in common."""

LEAST_EQUAL_FACTOR = 1.5
"""Factor from which on it is doubted where these factors are equal, which estimates never are; beyond it are torque
constants."""

EQUAL_SPREAD = 1.02
"""Largest ratio of two factors that are equal but for what noise makes of them."""


def identify_bag(path: Path, robot: str | None = None, namespace: str | None = None) -> IdentificationResult:
    """Identify the robot of a bag or of a run's directory, starting from the run's robot file or a given one.

    Raises:
        InputError: the bag, the robot or the motion is unsuitable.
        BagError: the bag cannot be read or lacks a topic.
    """
    source = find_bag(path, namespace)
    start = read_start(source, robot)
    record = read_record(source, start)
    try:
        identification = identify(start.five_bar(), record)
    except NotIdentifiable as error:
        raise InputError(f"{source.bag}: {error}") from error
    result = IdentificationResult(start, source.bag, record.rate_hz, len(record.angles), identification)
    _refuse_other_unit(result)
    return result


def _refuse_other_unit(result: IdentificationResult) -> None:
    """Refuse inertias, a mass and friction that differ from those of the file by one and the same factor.

    Raises:
        InputError: they do, as with torques in another unit.
    """
    named = [parameter for parameter in result.parameters() if parameter.name in SCALED_BY_TORQUE]
    ratios = [parameter.value / parameter.before for parameter in named if parameter.before > 0.0]
    if not ratios or min(ratios) <= 0.0:
        return
    factor, spread = float(np.exp(np.mean(np.log(ratios)))), max(ratios) / min(ratios)
    apart = max(factor, 1.0 / factor)
    equal = spread <= EQUAL_SPREAD
    if apart < (LEAST_EQUAL_FACTOR if equal else LEAST_FACTOR) or spread > max(EQUAL_SPREAD, apart**SPREAD):
        return
    times = f"all {factor:.3g}" if equal else f"{min(ratios):.3g} to {max(ratios):.3g}"
    raise InputError(
        f"{result.bag}: inertias, mass and friction come out {times} times those of"
        f" robot {result.start.name}: are the recorded torques in Nm? Expected are those at the joints, not a motor's"
        " current or its torque before the gear; where the file has guesses, weigh the platform and enter mass_kg.m"
    )


def map_bag(
    path: Path, robot: str | None, harmonics: Sequence[int], namespace: str | None = None
) -> tuple[MotorMap, MotorMap]:
    """Map the motors of the robot of a bag, whose lengths, inertias and mass are those of its file or of a given one.

    Args:
        path: a bag, or the directory of a run.
        robot: name or file of the robot, None for that of the run.
        harmonics: periods of cogging in a turn.
        namespace: of the topics, None for the one that the bag has.

    Raises:
        InputError: the bag, the robot or the motion is unsuitable.
        BagError: the bag cannot be read or lacks a topic.
    """
    source = find_bag(path, namespace)
    start = read_start(source, robot)
    try:
        return map_motors(start.five_bar(), read_record(source, start), harmonics)
    except NotIdentifiable as error:
        raise InputError(f"{source.bag}: {error}") from error


def write_identification(findings: IdentificationResult, out: Path | None) -> StudyDirectory:
    """Write robot file, figures, page and JSON into a new directory.

    Raises:
        InputError: the directory cannot be used.
    """
    # here, because matplotlib takes as long to load as all the rest of the command
    from fivebar_bringup.identify.figures import draw_pictures
    from fivebar_bringup.identify.page import html_page

    directory = StudyDirectory(new_directory(out, f"identify-{findings.start.name}"), "identification")
    pictures = draw_pictures(findings)
    robot = {ROBOT_FILE: findings.parameter_file()}
    directory.write(html_page(findings, pictures), findings.as_json(), pictures, robot)
    return directory
