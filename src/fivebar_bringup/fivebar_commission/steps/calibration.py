# SPDX-License-Identifier: Apache-2.0
"""Lengths, bases, zeros and the IMU's mounting, from the motion by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fivebar_bringup.calibrate.calibrate import calibrate_bag
from fivebar_bringup.calibrate.result import CalibrationResult
from fivebar_commission.drives_file import DrivesFile
from fivebar_commission.record import imu_keys
from fivebar_commission.session import DRIVES_FILE, ROBOT_FILE, Session
from fivebar_commission.step import Findings, GateClosed, GatedStep
from fivebar_description.interface import ACTIVE_JOINTS

LARGEST_SHIFT = 6.0
"""Correction of a length or zero, in its tolerances before, beyond which the gate closes."""

WIDEST_GAP = 0.3e-3
"""Half width (m) of the elbow gap's interval beyond which a crossing is a matter of luck."""


def run(session: Session) -> Findings:
    """Calibrate from the motion by hand, and write robot and drives."""
    led = session.state.outcome_of("sensors")
    assert led is not None and led.pages, "the step before has recorded it"
    folder = session.folder / led.pages[0]
    # by the files as they were then, so that a repetition finds the same
    result = calibrate_bag(folder, str(folder / ROBOT_FILE), encoders_only=session.imu is None)
    figures = figures_of(result)
    _refuse_implausible(result, figures)
    take(session, result, folder)
    gap = 1e3 * float(abs(result.calibration.gaps_before()).max())
    left = 1e3 * float(result.calibration.gap_half_widths().max())
    return Findings(f"the elbow gap was up to {gap:.3f} mm and is known to {left:.3f} mm", figures)


def figures_of(result: CalibrationResult) -> dict[str, Any]:
    """Return what a calibration has found, for the report."""
    figures: dict[str, Any] = {
        f"{parameter.name}, {parameter.unit}": parameter.text() for parameter in result.parameters()
    }
    return figures | dict(result.mounting_rows())


def take(session: Session, result: CalibrationResult, folder: Path) -> None:
    """Write what a calibration from a folder has found into the files of robot and drives; keep mounting and play."""
    session.learn_robot(result.robot_file())
    file = DrivesFile(folder / DRIVES_FILE)
    for joint, zero in zip(ACTIVE_JOINTS, result.zeros(), strict=True):
        file.change(joint, zero=round(file.facts(joint).zero - zero, 9))
    file.write(session.drives_path)
    mounting, imu = result.mounting, session.imu
    if mounting is not None and imu is not None:
        update = {name: getattr(mounting, name)[0] for name in ("roll", "pitch", "yaw", "mount_x", "mount_y")}
        session.learn(imu=imu_keys(imu._replace(**update)))
    values = {parameter.name: parameter for parameter in result.parameters()}
    plays = [values[name] for name in ("play_1", "play_2") if name in values]
    if plays and session.state.transmissions:
        play = max(0.0, *(2e-3 * play_of_gear.value for play_of_gear in plays))
        session.learn(transmissions=session.state.transmissions | {"backlash": min(play, 0.1)})


def _refuse_implausible(result: CalibrationResult, figures: dict[str, Any]) -> None:
    for parameter in result.parameters():
        shift = abs(parameter.value - parameter.before)
        if parameter.name.startswith(("l_", "base_", "zero_")) and shift > LARGEST_SHIFT * max(
            parameter.half_width_before, 1e-9
        ):
            raise GateClosed(
                "implausible",
                f"{parameter.name} comes out {parameter.value:.4g} {parameter.unit} instead of {parameter.before:.4g}:"
                " measure it, or declare wider tolerances in the robot file",
                figures,
            )
    widest = float(result.calibration.gap_half_widths().max())
    if widest > WIDEST_GAP:
        raise GateClosed(
            "elbow_gap_unknown",
            f"the elbow gap is known to {1e3 * widest:.2f} mm only, expected {1e3 * WIDEST_GAP:.2f}: lead the platform"
            " through the locus at more places",
            figures,
        )


CALIBRATION = GatedStep(
    name="calibration",
    title="Lengths and zeros",
    does="calibrates lengths, bases, encoder zeros, the IMU's mounting and the play from the motion by hand",
    cost="half a minute of computing",
    risk="none: nothing moves",
    gate=f"nothing is far from its tolerances, and the elbow gap is known to {1e3 * WIDEST_GAP:.1f} mm",
    run=run,
)
