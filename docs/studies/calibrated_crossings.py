# SPDX-License-Identifier: Apache-2.0
"""Robots before and after a calibration by hand: `python docs/studies/calibrated_crossings.py`.

Each robot is drawn as a rig of the sweep has them, led by hand without power through both motions of calibration, and
calibrated from the readings, on request with a few touched points besides. Then random crossings of the sweep are
planned, screened and run on it, with its file as drawn and as calibrated. What a robot is stays the same
throughout: pushes and lost commands differ from crossing to crossing, and there are none while it is led.
docs/calibration.md has the table.
"""

from __future__ import annotations

import argparse
import itertools
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_bringup.calibrate.calibrate import calibrate_bag
from fivebar_bringup.calibrate.result import CalibrationResult
from fivebar_bringup.odds.odds import PEAK_LIMIT, clopper_pearson
from fivebar_bringup.odds.robot_errors import drawn_effects, drawn_gyro_bias, drawn_scales
from fivebar_bringup.recorded.run_directory import new_run_directory
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.guided import GuidedSample, guide, write_guided_bag
from fivebar_control.calibration.closure import GEOMETRY, ZERO_1, locus_rows
from fivebar_control.calibration.result import Calibration
from fivebar_control.model.kinematics import state_from_joints
from fivebar_description.rounding import in_millimetres
from fivebar_description.strict_yaml import validate, yaml_text
from fivebar_sim.effects.settings import PlantSettings
from fivebar_studies.rigs.named import find_rig, shipped_rigs
from fivebar_studies.rigs.rig import Rig, merged
from fivebar_studies.sweep.rows import FEASIBLE, SweepRow
from fivebar_studies.sweep.running import run_case

MOTIONS = {
    "dextar": ("calibration", "calibration_below"),
    "motkin": ("motkin_calibration", "motkin_calibration_below"),
}
"""Motions by robot: above and below the motors' line. What one of them leaves open of the elbow gap is found from
the other."""

TOUCHED = 3
"""Stream of the random numbers that are the errors of touched points."""


class LeftError(NamedTuple):
    """The errors that a calibration leaves of a robot's.

    Attributes:
        length: root mean square of those of lengths and bases (m).
        zero: the larger one of the encoders' zeros (rad).
        gap: largest elbow gap anywhere on the locus (m).
        gap_before: the same before the calibration.
        claimed: half width of the calibration's interval for `gap`.
        tolerance_length, tolerance_zero: of the calibrated robot file (m, rad).
    """

    length: float
    zero: float
    gap: float
    gap_before: float
    claimed: float
    tolerance_length: float
    tolerance_zero: float


class BeforeAndAfter(NamedTuple):
    """A crossing of a robot with its file as drawn and as calibrated."""

    before: SweepRow
    after: SweepRow


def robot_of_rig(rig: Rig, seed: int, number: int) -> dict[str, Any]:
    """Return the section `plant` of a robot of a rig, without push and lost commands."""
    effects = drawn_effects(rig.errors, seed, number, 0.0)
    lasting = {name: keys for name, keys in effects.items() if name not in ("push", "bus")}
    return merged(drawn_scales(rig.errors, seed, number)._asdict() | lasting, rig.plant)


def calibrated(rig: Rig, plant: dict[str, Any], bias: float, touched: float = 0.0) -> CalibrationResult:
    """Return the calibration of a robot with a gyroscope of this bias (rad/s) from both motions by hand.

    With `touched`, the standard deviation (m) of touched points, the first motion's waypoints are such points.
    """
    result: CalibrationResult | None = None
    for name in MOTIONS[rig.robot]:
        content = load_scenario(name).model_dump()
        lasting = {key: value for key, value in plant.items() if key not in ("torque_quantum", "delay_samples")}
        content["plant"] |= lasting
        content["imu"] |= {**rig.scenario["imu"], "gyro_bias": bias}
        scenario = validate(content, Scenario, name)
        with tempfile.TemporaryDirectory() as folder:
            run = new_run_directory(Path(folder) / "led", scenario)
            samples = guide(scenario)
            write_guided_bag(samples, scenario, run.bag)
            points = None
            if touched > 0.0 and result is None:
                points = Path(folder) / "touched.yaml"
                points.write_text(yaml_text(touched_places(scenario, samples, touched)), encoding="utf-8")
            result = calibrate_bag(run.path, touched=points, known=result)
    assert result is not None
    return result


def touched_places(scenario: Scenario, samples: list[GuidedSample], deviation: float) -> dict[str, Any]:
    """Return the content of a file of touched points: where the platform rests, measured to a deviation (m)."""
    random = np.random.default_rng((scenario.plant.seed, TOUCHED))
    robot, points = scenario.actual_robot(), []
    for time in itertools.accumulate(scenario.durations()):
        sample = samples[round(time * scenario.rate_hz)]
        state = state_from_joints(robot, *sample.position, *sample.velocity)
        x, y = state.x + random.normal(0.0, deviation), state.y + random.normal(0.0, deviation)
        points.append({"time": time, "x": x, "y": y})
    return {"deviation_m": deviation, "points": points}


def actual_geometry(found: Calibration, plant: PlantSettings) -> NDArray[np.float64]:
    """Return the geometry of the simulated robot whose file was calibrated: float64[8], m and rad."""
    actual: NDArray[np.float64] = found.start[: len(GEOMETRY)] + np.array(
        [*plant.links[:6], plant.encoders.zero_1, plant.encoders.zero_2]
    )
    return actual


def left_error(result: CalibrationResult) -> LeftError:
    """Return what a calibration leaves, by the geometry of the simulated robot that its scenario has."""
    assert result.scenario is not None
    found, plant, count = result.calibration, result.scenario.plant, len(GEOMETRY)
    actual = actual_geometry(found, plant)
    error, rows, tolerances = found.values[:count] - actual, locus_rows(actual), result.tolerances()
    return LeftError(
        float(np.sqrt(np.mean(error[:ZERO_1] ** 2))),
        float(np.max(np.abs(error[ZERO_1:]))),
        float(np.max(np.abs(rows @ error))),
        float(np.max(np.abs(rows @ (found.start[:count] - actual)))),
        float(np.max(found.locus_half_widths())),
        tolerances.length,
        tolerances.zero,
    )


class RigFiles(NamedTuple):
    """The files of two rigs that have one robot only: with its file as drawn, and with the calibrated one."""

    before: Path
    after: Path


def rigs_of(rig: Rig, plant: dict[str, Any], result: CalibrationResult, folder: Path) -> RigFiles:
    """Write the calibrated robot's file and both rigs.

    Encoder zeros that the calibration finds are those of the drives from then on. The odds of the calibrated robot are
    those of robots within its own tolerances.
    """
    file = folder / "calibrated.yaml"
    file.write_text(yaml_text(result.robot_file().model_dump(mode="json", exclude_none=True)), encoding="utf-8")
    scenario = result.calibrated_scenario(str(file))
    assert scenario is not None
    content = rig.model_dump()
    before = merged(content, {"scenario": {"plant": plant}})
    left = {"links": scenario.plant.links._asdict(), "encoders": scenario.plant.encoders._asdict()}
    known = result.tolerances()
    errors = {"length": known.length, "base": known.base, "zero": known.zero}
    after = merged(before, {"robot": str(file), "errors": errors, "scenario": {"plant": left}})
    del after["scenario"]["tolerances"]
    files = RigFiles(folder / "before.yaml", folder / "after.yaml")
    for path, text in zip(files, (before, after), strict=True):
        path.write_text(yaml_text(text), encoding="utf-8")
    return files


def crossed(
    rig: Rig, seed: int, numbers: Iterable[int], plant: dict[str, Any], result: CalibrationResult
) -> Iterator[BeforeAndAfter]:
    """Yield those crossings of a robot that are accepted once it is calibrated.

    Args:
        rig: whose robot it is.
        seed, numbers: of the motions.
        plant: the robot.
        result: its calibration.
    """
    with tempfile.TemporaryDirectory() as folder:
        files = rigs_of(rig, plant, result, Path(folder))
        for number in numbers:
            (after,) = run_case(seed, number, str(files.after), ("unified",))
            if after.status == FEASIBLE:
                (before,) = run_case(seed, number, str(files.before), ("unified",))
                yield BeforeAndAfter(before, after)


def _left_text(left: list[LeftError]) -> list[str]:
    """Return what calibrations leave, in the median and in nineteen of twenty robots."""
    middle, most = (LeftError(*np.percentile(np.array(left), share, axis=0).tolist()) for share in (50.0, 95.0))
    texts = (
        ("elbow gap before, largest anywhere", 1e3, "mm", "gap_before"),
        ("elbow gap after, largest anywhere", 1e3, "mm", "gap"),
        ("half width of its interval", 1e3, "mm", "claimed"),
        ("lengths and bases, root mean square", 1e3, "mm", "length"),
        ("encoder zeros, larger one", 1e3, "mrad", "zero"),
        ("tolerance of lengths in the file", 1e3, "mm", "tolerance_length"),
        ("tolerance of zeros in the file", 1e3, "mrad", "tolerance_zero"),
    )
    lines = [
        f"{words}: {factor * getattr(middle, name):.3f}, {factor * getattr(most, name):.3f} {unit}"
        for words, factor, unit, name in texts
    ]
    return [*lines, f"gap within its interval: {sum(one.gap < one.claimed for one in left)} of {len(left)} robots"]


def _run_text(words: str, rows: list[SweepRow]) -> str:
    """Return how many runs stay within 2 mm, and their largest errors."""
    good = sum(row.within(PEAK_LIMIT) for row in rows)
    interval = clopper_pearson(good, len(rows))
    errors = [row.error_peak for row in rows if row.error_peak is not None]
    middle, most = np.percentile(errors, (50.0, 95.0)) if errors else (np.nan, np.nan)
    faults = sum(bool(row.fault) for row in rows)
    return (
        f"{words}: {good} of {len(rows)} within 2 mm ({100.0 * interval.low:.1f} to {100.0 * interval.high:.1f} %),"
        f" {faults} stopped, largest error {in_millimetres(middle)}, {in_millimetres(most)} (median, 95 %)"
    )


def main() -> None:
    """Print what calibrations leave, and what becomes of crossings before and after."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--rig",
        default="printed",
        choices=[name for name in shipped_rigs() if find_rig(name).errors.gyro_bias > 0.0],
        help="whose robots (printed)",
    )
    parser.add_argument("--seed", type=int, default=1, help="of robots and motions")
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--touched", type=float, default=0.0, metavar="MM", help="deviation of touched points (none)")
    parser.add_argument("--crossings", type=int, default=10, help="of each robot, that are accepted after calibration")
    given = parser.parse_args()
    rig = find_rig(given.rig)
    left: list[LeftError] = []
    done: list[BeforeAndAfter] = []
    for robot in range(given.robots):
        plant = robot_of_rig(rig, given.seed, robot)
        result = calibrated(rig, plant, drawn_gyro_bias(rig.errors, given.seed, robot), 1e-3 * given.touched)
        # each robot has motions of its own
        numbers = itertools.count(1000 * (robot + 1))
        crossings = list(itertools.islice(crossed(rig, given.seed, numbers, plant, result), given.crossings))
        left.append(left_error(result))
        done += crossings
        good = sum(crossing.after.within(PEAK_LIMIT) for crossing in crossings)
        print(f"robot {robot}: {left[-1]}; {good} of {len(crossings)} within 2 mm", flush=True)
    print(*_left_text(left), sep="\n")
    print(_run_text("after", [one.after for one in done]))
    planned = [one.before for one in done if one.before.controller]
    both = [one for one in done if one.before.status == FEASIBLE]
    print(_run_text("before, as far as planned", planned))
    print(_run_text("before, accepted by planner and screen", [one.before for one in both]))
    print(_run_text("after, of these", [one.after for one in both]))


if __name__ == "__main__":
    main()
