"""Identifies a robot from a bag and writes robot file, figures and page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fivebar_bringup.recorded.results import new_directory
from fivebar_bringup.studies.identify.reading import find_bag, read_record, read_start
from fivebar_bringup.studies.identify.result import IdentificationResult
from fivebar_bringup.studies.study_directory import StudyDirectory
from fivebar_control.identification.identification import NotIdentifiable, identify
from fivebar_control.identification.motor_map import MotorMap, map_motors
from fivebar_description.strict_yaml import InputError

ROBOT_FILE = "identified.yaml"
"""The robot file that `robot:` in a scenario takes."""


SCALED_BY_TORQUE = ("zz_11R", "zz_21R", "m")

LARGEST_RATIO = 300.0
"""Ratio of all inertias and the mass to those of the file before, from which on the torques' unit is doubted."""


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
        found = identify(start.five_bar(), record)
    except NotIdentifiable as error:
        raise InputError(f"{source.bag}: {error}") from error
    result = IdentificationResult(start, source.bag, record.rate_hz, len(record.angles), found)
    _refuse_other_unit(result)
    return result


def _refuse_other_unit(result: IdentificationResult) -> None:
    """Refuse inertias and a mass that are all far from those of the file.

    Raises:
        InputError: they are, as with torques in another unit.
    """
    ratios = [one.value / one.before for one in result.parameters() if one.name in SCALED_BY_TORQUE and one.before]
    if ratios and (min(ratios) > LARGEST_RATIO or max(ratios) < 1.0 / LARGEST_RATIO):
        raise InputError(
            f"{result.bag}: inertias and mass come out {min(ratios):.3g} to {max(ratios):.3g} times those of robot"
            f" {result.start.name}: are the recorded torques in Nm?"
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
    from fivebar_bringup.studies.identify.figures import draw_pictures
    from fivebar_bringup.studies.identify.page import html_page

    directory = StudyDirectory(new_directory(out, f"identify-{findings.start.name}"), "identification")
    pictures = draw_pictures(findings)
    robot = {ROBOT_FILE: findings.parameter_file()}
    directory.write(html_page(findings, pictures), findings.as_json(), pictures, robot)
    return directory
