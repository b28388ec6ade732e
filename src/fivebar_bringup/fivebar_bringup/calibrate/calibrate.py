# SPDX-License-Identifier: Apache-2.0
"""Calibrates a robot from a bag and writes robot file, drives' file, scenario, figures and page."""

from __future__ import annotations

from pathlib import Path

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.calibrate.reading import read_passive, read_record, read_seen, read_touched
from fivebar_bringup.calibrate.result import CalibrationResult
from fivebar_bringup.identify.reading import find_bag, read_start
from fivebar_bringup.pages.study_directory import StudyDirectory
from fivebar_bringup.recorded.results import new_directory
from fivebar_control.calibration.by_turning_points import calibrate_by_turning_points, dragged_lag
from fivebar_control.calibration.calibration import calibrate
from fivebar_control.calibration.mounting import find_mounting
from fivebar_control.calibration.observability import unseen
from fivebar_control.calibration.passive import find_passive_zero
from fivebar_control.calibration.record import NOT_SEEN, NotCalibratable
from fivebar_control.hardware.configuration import DriveFile, load_drives
from fivebar_description.imu import ImuSettings
from fivebar_description.strict_yaml import InputError, yaml_text
from fivebar_description.tolerances import EXACT, Tolerances

ROBOT_FILE, SCENARIO_FILE, DRIVES_FILE = "calibrated.yaml", "scenario.yaml", "drives.yaml"
"""The robot file that `robot:` in a scenario takes; the run's scenario with it; the drives with corrected zeros."""

PUT_TOGETHER = Tolerances(length=3e-4, base=3e-4, zero=5e-3)
"""Tolerances before the calibration of a robot whose file and scenario declare none."""


def calibrate_bag(
    path: Path,
    robot: str | None = None,
    touched: Path | None = None,
    encoders_only: bool = False,
    camera: bool = True,
    known: CalibrationResult | None = None,
    namespace: str | None = None,
) -> CalibrationResult:
    """Calibrate the robot of a bag or of a run's directory, starting from the run's robot file or a given one.

    Args:
        path: of bag or run.
        robot: name or file of the robot before.
        touched: file of touched points.
        encoders_only: use the motors' turning points on the Type 2 locus alone.
        camera: use the platform's positions by a camera, where the bag has them.
        known: the calibration from earlier bags of the same robot.
        namespace: of the topics, None for the one that the bag has.

    Raises:
        InputError: the bag, the robot or the motion is unsuitable.
        BagError: the bag cannot be read or lacks a topic.
    """
    source = find_bag(path, namespace)
    start = read_start(source, robot)
    if known is not None and (encoders_only or start.five_bar() != known.start.five_bar()):
        raise InputError(f"{source.bag}: expected the robot of {known.bag} before its calibration, and a gyroscope")
    scenario = None if source.run is None else source.run.read_scenario()
    declared = start.tolerances
    if scenario is not None and scenario.tolerances != EXACT:
        declared = scenario.tolerances
    tolerances = PUT_TOGETHER if declared == EXACT else declared
    recording = read_bag(source.bag, namespace)
    record = read_record(recording, with_imu=not encoders_only)
    points = () if touched is None else read_touched(touched, record)
    imu = ImuSettings() if scenario is None else scenario.imu
    try:
        if encoders_only:
            lag = dragged_lag(start.five_bar(), start.transmission)
            calibration = calibrate_by_turning_points(start.five_bar(), tolerances, record, lag)
        else:
            seen = read_seen(recording) if camera else NOT_SEEN
            calibration = calibrate(
                start.five_bar(), tolerances, record, imu, points, seen, None if known is None else known.calibration
            )
        leg = 0 if scenario is None or encoders_only else scenario.passive.leg
        passive = read_passive(recording, leg) if leg else None
        zero = None if passive is None else find_passive_zero(record, calibration, passive)
    except NotCalibratable as error:
        raise InputError(f"{source.bag}: {error}") from error
    mounting = None if encoders_only else find_mounting(record, calibration)
    return CalibrationResult(start, source.bag, calibration, unseen(calibration), mounting, len(points), scenario, zero)


def corrected_drives(result: CalibrationResult, drives: str) -> DriveFile:
    """Return a configuration of the drives with the encoders' zeros corrected by the calibration.

    Raises:
        InputError: the file is missing or not a configuration.
    """
    file = load_drives(drives)
    pair = {
        joint: drive.model_copy(update={"home_offset_rad": round(drive.home_offset_rad - zero, 9)})
        for joint, drive, zero in zip(("q11", "q21"), file.pair, result.zeros(), strict=True)
    }
    return file.model_copy(update={"drives": file.drives.model_copy(update=pair)})


def write_calibration(result: CalibrationResult, out: Path | None, drives: str | None = None) -> StudyDirectory:
    """Write robot file, figures, page and JSON into a new directory; with `drives` also their corrected file.

    Raises:
        InputError: the directory cannot be used, or the drives' file is not one.
    """
    # here, because matplotlib takes as long to load as all the rest of the command
    from fivebar_bringup.calibrate.figures import draw_pictures
    from fivebar_bringup.calibrate.page import html_page

    corrected = None if drives is None else corrected_drives(result, drives)
    directory = StudyDirectory(new_directory(out, f"calibrate-{result.start.name}"), "calibration")
    pictures = draw_pictures(result)
    files = {ROBOT_FILE: result.parameter_file()}
    if corrected is not None:
        files[DRIVES_FILE] = yaml_text(corrected.model_dump(mode="json"))
    scenario = result.calibrated_scenario(str(directory.path / ROBOT_FILE))
    if scenario is not None:
        files[SCENARIO_FILE] = scenario.to_yaml()
    directory.write(html_page(result, pictures), result.as_json(), pictures, files)
    return directory
