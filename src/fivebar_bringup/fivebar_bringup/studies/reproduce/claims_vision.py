"""The future work of the thesis: validation by vision, with a simulated camera beside the simulated IMU."""

from __future__ import annotations

from fivebar_bringup.report.thesis import CARTESIAN
from fivebar_bringup.studies.reproduce.cases import SHOWN, ReproductionCase, ReproductionExtent
from fivebar_bringup.studies.reproduce.rows import Claim, ClaimRow, of
from fivebar_bringup.studies.reproduce.runner import Results
from fivebar_bringup.studies.reproduce.verdicts import within
from fivebar_bringup.studies.reproduce.vision_accuracy import position_errors
from fivebar_bringup.units import error_of, plain
from fivebar_description.camera import CameraSettings
from fivebar_description.robot_file import load_robot

STATIC_LIMIT, MOVING_LIMIT = 5e-5, 2e-4
"""Required accuracy of the camera (m): for a robot at rest, and for one that moves."""

SPEED = 0.3
"""Speed of the platform (m/s), for the accuracy in motion: somewhat more than the crossings' 0.24 m/s."""

PICTURES = 24
"""For each accuracy."""

PLACE = "Future works"
STATEMENT = "proposed: validate the crossing with an external camera (future works); no figure in the text"
RENDERED = "Rendered pictures of 1280 x 960 px over 400 mm, exposed for 1 ms; nothing was measured with a real camera."

CASE = ReproductionCase(CARTESIAN, "middle", SHOWN, imu=True, camera=True)


def _validation(extent: ReproductionExtent, results: Results) -> ClaimRow:
    run = results[CASE]
    summary = run.summary
    rms, peak, true_peak = (
        (None, None, None)
        if summary is None
        else (summary.vision_error_rms_m, summary.vision_error_max_m, summary.vision_true_error_max_m)
    )
    return ClaimRow(
        PLACE,
        "Validation by vision beside the IMU, middle crossing, in simulation only",
        STATEMENT,
        f"camera minus joints {error_of(rms, 'm')} rms, {error_of(peak, 'm')} at most, camera minus exact"
        f" platform {error_of(true_peak, 'm')} at most; beside it the IMU's acceleration error over the whole run"
        f" {plain(run.acceleration_whole, 'm/s²')} rms",
        {
            "vision_error_rms_m": rms,
            "vision_error_max_m": peak,
            "vision_true_error_max_m": true_peak,
            "imu_error_m_s2": run.acceleration_whole,
            "imu_noise_floor_m_s2": run.noise_whole,
        },
        within([peak, true_peak], MOVING_LIMIT),
        RENDERED,
        [run.picture("vision", "Platform by the camera minus that by the joints, and minus the exact one.")],
    )


def _accuracy(name: str, title: str, speed: float, limit: float) -> Claim:
    def make(extent: ReproductionExtent, results: Results) -> ClaimRow:
        errors = position_errors(load_robot("dextar"), CameraSettings(on=True), speed, PICTURES)
        known = [error for error in errors if error is not None]
        middle, largest = (sorted(known)[len(known) // 2], max(known)) if known else (None, None)
        return ClaimRow(
            PLACE,
            title,
            STATEMENT,
            f"{error_of(middle, 'm')} in the median and {error_of(largest, 'm')} at most over {PICTURES} pictures"
            f" at random places, seen in {len(known)}",
            {"median_m": middle, "largest_m": largest, "seen": len(known), "pictures": PICTURES},
            within(errors, limit),
            RENDERED,
        )

    return Claim(name, lambda extent: {}, make)


CLAIMS = (
    Claim("vision", lambda extent: of([CASE], CASE, ("vision",)), _validation),
    _accuracy("vision at rest", "Accuracy of the camera, robot at rest", 0.0, STATIC_LIMIT),
    _accuracy("vision in motion", f"Accuracy of the camera at {SPEED:g} m/s", SPEED, MOVING_LIMIT),
)
