# SPDX-License-Identifier: Apache-2.0
"""The calibration by motion: several crossings under control, whose recording must confirm the calibration by hand."""

from __future__ import annotations

from fivebar_bringup.calibrate.calibrate import calibrate_bag
from fivebar_commission.crossings import crossing_base
from fivebar_commission.motions import crossing_points, through_all
from fivebar_commission.session import TOLERATED, Session
from fivebar_commission.step import Findings, GateClosed, GatedStep
from fivebar_commission.steps.calibration import figures_of, take
from fivebar_commission.steps.identification import finished
from fivebar_commission.steps.rehearsal import chosen_crossings
from fivebar_description.files import write_file
from fivebar_description.robot_file import read_robot
from fivebar_description.strict_yaml import yaml_text

CONFIRMED = 0.05e-3
"""Elbow gap (m) that is left at most for the calibration by hand to count as confirmed as it is."""

LARGEST_GAP = 0.3e-3
"""Elbow gap (m) beyond which both calibrations contradict each other."""


def run(session: Session) -> Findings:
    """Cross at several places, calibrate once more, and take the result where the elbow gap is not confirmed."""
    if session.imu is None:
        return Findings("no gyroscope: what crossings under control would tell is not seen without one")
    robot, home = session.five_bar, session.robot.home_m
    pace = sum(chosen_crossings(session)[0].durations()) / 2.0
    points = through_all(robot, home, crossing_points(robot, home))
    scenario = crossing_base(session, "calibration", waypoints=points, segment_duration=round(pace, 3))
    folder, summary = session.run(scenario, "calibration")
    finished(summary, folder)
    # begun from the lengths that are known, but with tolerances as before, so that it is a calibration of its own
    start, wide = read_robot(str(folder.robot)), folder.path / "wide.yaml"
    tolerances = start.tolerances._replace(**TOLERATED)
    content = start.model_copy(update={"tolerances": tolerances}).model_dump(mode="json", exclude_none=True)
    write_file(wide, yaml_text(content))
    result = calibrate_bag(folder.path, str(wide))
    figures = figures_of(result)
    gap = float(abs(result.calibration.gaps_before()).max())
    figures["elbow gap after the calibration by hand, mm"] = round(1e3 * gap, 4)
    pages = (str(folder.path.relative_to(session.folder)),)
    if gap > LARGEST_GAP:
        raise GateClosed(
            "calibrations_differ",
            f"by motion the elbow gap is {1e3 * gap:.2f} mm off what it is by hand: play, a loose link, or a slipping"
            " zero",
            figures,
        )
    if gap <= CONFIRMED:
        return Findings(f"the elbow gap is confirmed to {1e3 * gap:.3f} mm", figures, pages)
    take(session, result, folder.path)
    return Findings(f"the elbow gap was {1e3 * gap:.3f} mm off, and is corrected", figures, pages)


BY_MOTION = GatedStep(
    name="motion",
    title="Calibration by motion",
    does="crosses at several places under control, and calibrates once more from that",
    cost="a minute",
    risk="as the first crossing, at other places",
    gate=f"the motion is finished, and the elbow gap agrees with that by hand to {1e3 * LARGEST_GAP:.1f} mm",
    run=run,
)
