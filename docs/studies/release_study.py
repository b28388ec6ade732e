# SPDX-License-Identifier: Apache-2.0
"""Random rests on the Type 2 locus, and what becomes of the robots that are released from there by their motors.

`python docs/studies/release_study.py [--rests 500] [--rig calibrated --rig good --rig middling]
[--without-gyroscope]`
draws robots of each rig, puts each on a place of its own locus or up to 5 mm beside, lets it come to rest at zero
torque, and releases it by what its encoders and gyroscope read. Half of them rest stretched, half folded; of these the
platform's place is known within 5 mm. A push of the rig comes while it is released. It prints the counts of
docs/motions.md.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections import Counter
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_bringup.odds.odds import clopper_pearson
from fivebar_bringup.odds.robot_errors import drawn_effects
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.robot import later_with_effects
from fivebar_control.compiling import compiled_and_kept
from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.model.geometry import inverse_geometry, workspace_bounds
from fivebar_control.model.kinematics import assembly_mode, det_a, state_from_joints, state_from_platform
from fivebar_control.model.singularity import STRETCHED, distal_links, inverse_condition, parallel_svd, type1_margin
from fivebar_control.model.state import WorkingMode
from fivebar_control.planning.postures import WORKING_MODES
from fivebar_control.planning.release import TYPE_1_MARGIN, ReleaseRefused
from fivebar_control.planning.release_step import ENDINGS, RELEASED, Release, first_memory, has_ended, release_step
from fivebar_control.scenario.release import scenario_release
from fivebar_description.parameters import FiveBar
from fivebar_sim.effects.mechanism import Mechanism, actual_robot, mechanism_of
from fivebar_sim.effects.mechanism_state import MechanismState
from fivebar_sim.effects.motion import resting
from fivebar_sim.effects.observation import joints_of, joints_seen
from fivebar_sim.sensors import counted, encoder_resolution, gyro_errors, gyro_stream, shaped
from fivebar_studies.rigs.named import find_rig
from fivebar_studies.sweep.drawing import PLANNED_FOR, draw

FloatArray = NDArray[np.float64]

BESIDE, SEEN = 5e-3, 5e-3
"""How far (m) beside the locus a stretched robot rests at most, and how exactly a folded one's platform is known."""

SETTLING, LONGEST, AFTERWARDS = 3.0, 12.0, 0.3
"""Times (s): until the robot rests, of a release at most, and after it."""

MOVING = 0.02
"""Speed of a joint (rad/s) from which a robot is not at rest."""

PUSHED_AT = 1.0
"""When the push of the rig comes (s after the release has begun)."""

BRANCHES = ("stretched", "folded")
"""Branches of the locus; a rest of an even number is on the first."""

AWAY = "not near"
"""How the refusal begins of a robot that has come away from the locus before it rested."""

STREAM = 11


class ReleaseRun(NamedTuple):
    """The outcome for a robot.

    Attributes:
        phase: how the release ended.
        assembly: mode that it was found to be in, 0 for neither.
        actual: the one that it is in.
        motor_speed, link_rate, platform_speed: largest ones (rad/s, rad/s, m/s).
        serial: least |sin q_i2|.
        kappa: 1/cond(A) at the end.
        diverged: whether the simulation came to an end.
    """

    phase: int
    assembly: int
    actual: int
    motor_speed: float
    link_rate: float
    platform_speed: float
    serial: float
    kappa: float
    diverged: bool


class Bench(NamedTuple):
    """A robot with its encoders, drives and gyroscope, as numbers."""

    mechanism: Mechanism
    actual: FiveBar
    resolution: float
    quantum: float
    delay: int
    latency: int


class Released(NamedTuple):
    """How a release ended, and the largest values on the way, as numbers."""

    phase: int
    assembly: int
    motor_speed: float
    link_rate: float
    platform_speed: float
    serial: float
    diverged: bool
    state: MechanismState


def settled(bench: Bench, state: MechanismState, samples: int) -> MechanismState:
    """Return a robot after so many samples at zero torque."""
    for _ in range(samples):
        state = later_with_effects(bench.actual, bench.mechanism, 0, 0.0, state, -1, ZERO).state
    return state


def run_release(
    bench: Bench, release: Release, state: MechanismState, errors: FloatArray, rates: FloatArray, afterwards: int
) -> Released:
    """Return what becomes of a release.

    Args:
        bench: the robot.
        release: as numbers.
        state: the robot at rest.
        errors: float64[n], of the gyroscope's readings (rad/s), NaN where none is made; n samples are made at most.
        rates: float64[n], to be filled with the readings.
        afterwards: samples to go on for at zero torque.
    """
    memory = first_memory(release)
    commands = np.zeros((bench.delay + 1, 2))
    motor_speed, link_rate, platform_speed, serial = 0.0, 0.0, 0.0, 1.0
    left, diverged = afterwards, False
    for number in range(errors.shape[0]):
        exact, seen = joints_of(state), joints_seen(state)
        there = state_from_joints(
            bench.actual, exact.q11, exact.q12, exact.q21, exact.q22, exact.dq11, exact.dq12, exact.dq21, exact.dq22
        )
        rates[number] = exact.dq21 + exact.dq22 + errors[number]
        motor_speed = max(motor_speed, abs(exact.dq11), abs(exact.dq21))
        link_rate = max(link_rate, abs(exact.dq11 + exact.dq12), abs(exact.dq21 + exact.dq22))
        platform_speed = max(platform_speed, math.sqrt(there.vx * there.vx + there.vy * there.vy))
        serial = min(serial, abs(math.sin(exact.q12)), abs(math.sin(exact.q22)))
        q11, q21 = counted(seen.q11, bench.resolution), counted(seen.q21, bench.resolution)
        made = number - bench.latency
        torque, memory = release_step(release, memory, q11, q21, rates[made] if made >= 0 else math.nan)
        if has_ended(memory):
            if left == 0:
                break
            left -= 1
        row = number % (bench.delay + 1)
        commands[row, 0], commands[row, 1] = torque.tau1, torque.tau2
        waiting = (number + 1) % (bench.delay + 1)
        after = later_with_effects(
            bench.actual,
            bench.mechanism,
            0,
            0.0,
            state,
            number,
            Torque(
                shaped(commands[waiting, 0], bench.quantum, math.inf),
                shaped(commands[waiting, 1], bench.quantum, math.inf),
            ),
        )
        if math.isinf(after.gap):
            diverged = True
            break
        state = after.state
    return Released(memory.phase, memory.assembly, motor_speed, link_rate, platform_speed, serial, diverged, state)


class DrawnRest(NamedTuple):
    """A robot on its locus: scenario, joints (rad), and by how much (m) its platform is said to be off, if anywhere."""

    scenario: Scenario
    joints: tuple[float, float, float, float]
    said: tuple[float, float] | None


def drawn_rest(rig: str, seed: int, number: int) -> DrawnRest:
    """Return the rest of a number, stretched for even numbers."""
    case, errors = draw(seed, number, rig), find_rig(rig).errors
    scenario = case.with_effects(PLANNED_FOR, drawn_effects(errors, seed, number, PUSHED_AT))
    robot = actual_robot(scenario.five_bar(), scenario.plant)
    random = np.random.default_rng((seed, number, STREAM))
    while True:
        found = _stretched(robot, random) if number % 2 == 0 else _folded(robot, random)
        if found is not None:
            off, heading = SEEN * math.sqrt(random.uniform()), random.uniform(-math.pi, math.pi)
            return DrawnRest(
                scenario, found, (off * math.cos(heading), off * math.sin(heading)) if number % 2 else None
            )


Posture = tuple[float, float, float, float]


def _stretched(robot: FiveBar, random: np.random.Generator) -> Posture | None:
    """Return the joints (rad) of a posture beside the stretched locus, None where the draw has none."""
    mode = WORKING_MODES[random.integers(len(WORKING_MODES))]
    bounds = workspace_bounds(robot)
    one, two = random.uniform((bounds.left, bounds.bottom), (bounds.right, bounds.top), (2, 2))
    off = BESIDE * random.uniform(-1.0, 1.0)
    if not _side(robot, mode, *one) * _side(robot, mode, *two) < 0.0:
        return None
    for _ in range(50):
        middle = 0.5 * (one + two)
        if _side(robot, mode, *middle) * _side(robot, mode, *one) > 0.0:
            one = middle
        else:
            two = middle
    state = state_from_platform(robot, mode, float(one[0]), float(one[1]), 0.0, 0.0)
    if not math.isfinite(state.leg1.dq1) or distal_links(state) != STRETCHED:
        return None
    svd = parallel_svd(state)
    return _posture(robot, mode, state.x + off * svd.t_x, state.y + off * svd.t_y)


def _side(robot: FiveBar, mode: WorkingMode, x: float, y: float) -> float:
    return det_a(state_from_platform(robot, mode, x, y, 0.0, 0.0))


def _folded(robot: FiveBar, random: np.random.Generator) -> Posture | None:
    """Return the joints (rad) of a posture whose elbows are in one place but for the links' errors."""
    a = 0.5 * (robot.leg2.base_x - robot.leg1.base_x)
    place = random.choice((1.0, -1.0)) * math.sqrt(robot.leg1.proximal**2 - a * a)
    phi, shorter = random.uniform(-math.pi, math.pi), 5e-4 + abs(robot.leg1.distal - robot.leg2.distal)
    # the platform is a little nearer than the shorter link, so that the loop closes
    length = min(robot.leg1.distal, robot.leg2.distal) - 0.02 * shorter
    x, y = length * math.cos(phi), place + length * math.sin(phi)
    side1, side2 = (1 if (x - base) * place + y * base > 0.0 else -1 for base in (-a, a))
    return _posture(robot, (side1, side2), x, y)


def _posture(robot: FiveBar, mode: WorkingMode, x: float, y: float) -> Posture | None:
    q = inverse_geometry(robot, mode, x, y)
    if not math.isfinite(q.q12 + q.q22) or min(abs(math.sin(q.q12)), abs(math.sin(q.q22))) < 2.0 * TYPE_1_MARGIN:
        return None
    return q.q11, q.q12, q.q21, q.q22


def released(rest: DrawnRest, gyroscope: bool = True) -> ReleaseRun | str | None:
    """Return what became of a rest, or why it is refused; None where the robot comes to no rest near the locus."""
    scenario, rate_hz = rest.scenario, rest.scenario.rate_hz
    if not gyroscope:
        scenario = scenario.model_copy(update={"ekf": scenario.ekf._replace(gyro=False)})
    bench = bench_of(scenario)
    state = _settled()(bench, resting(*rest.joints), round(SETTLING * rate_hz))
    exact, seen = joints_of(state), joints_seen(state)
    there = state_from_joints(bench.actual, *exact[:4], 0.0, 0.0, 0.0, 0.0)
    if max(map(abs, exact[4:])) > MOVING or type1_margin(there) < TYPE_1_MARGIN:
        return None
    q11, q21 = counted(seen.q11, bench.resolution), counted(seen.q21, bench.resolution)
    platform = None if rest.said is None else (there.x + rest.said[0], there.y + rest.said[1])
    try:
        plan = scenario_release(scenario, q11, q21, platform)
    except ReleaseRefused as error:
        return None if str(error).startswith(AWAY) else str(error)
    stream = gyro_stream(scenario.plant.seed)
    samples = round(LONGEST * rate_hz)
    errors = gyro_errors(scenario.imu, stream, samples)
    every = scenario.imu.schedule(rate_hz).every
    errors[(np.arange(samples) % every != 0) | (not gyroscope)] = math.nan
    one = _run()(bench, plan.release, state, errors, np.zeros(samples), round(AFTERWARDS * rate_hz))
    exact = joints_of(one.state)
    there = state_from_joints(bench.actual, exact.q11, exact.q12, exact.q21, exact.q22, 0.0, 0.0, 0.0, 0.0)
    return ReleaseRun(
        one.phase,
        one.assembly,
        assembly_mode(there),
        one.motor_speed,
        one.link_rate,
        one.platform_speed,
        one.serial,
        inverse_condition(there),
        bool(one.diverged),
    )


def bench_of(scenario: Scenario) -> Bench:
    """Return the robot of a scenario."""
    plant, rate_hz = scenario.plant, scenario.rate_hz
    mechanism = mechanism_of(scenario.five_bar(), plant, rate_hz)
    return Bench(
        mechanism,
        mechanism.robot,
        encoder_resolution(plant),
        plant.torque_quantum,
        plant.delay_samples,
        scenario.imu.schedule(rate_hz).latency,
    )


def _settled() -> Any:
    return compiled_and_kept(settled)


def _run() -> Any:
    return compiled_and_kept(run_release)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rests", type=int, default=500)
    parser.add_argument("--seed", type=int, default=404040)
    parser.add_argument("--rig", action="append")
    parser.add_argument("--without-gyroscope", action="store_true", help="rests with stretched links only")
    options = parser.parse_args(arguments)
    for rig in options.rig or ("calibrated", "good", "middling"):
        for first, branch in enumerate(BRANCHES[:1] if options.without_gyroscope else BRANCHES):
            runs: list[ReleaseRun | str] = []
            numbers = itertools.count(first, len(BRANCHES))
            while len(runs) < options.rests // len(BRANCHES):
                run = released(drawn_rest(rig, options.seed, next(numbers)), not options.without_gyroscope)
                if run is not None:
                    runs.append(run)
            print(line(rig, branch, runs), flush=True)


def line(rig: str, branch: str, runs: Sequence[ReleaseRun | str]) -> str:
    """Return a rig's line of the table."""
    made = [run for run in runs if isinstance(run, ReleaseRun)]
    refused = Counter(run.partition(":")[0] for run in runs if isinstance(run, str))
    done = [one for one in made if one.phase == RELEASED]
    others = Counter(ENDINGS[one.phase].partition(":")[0] for one in made if one.phase > RELEASED)
    endless = sum(one.phase < RELEASED for one in made)
    right = sum(one.assembly == one.actual for one in done)
    harmed = sum(one.diverged or one.serial < 0.01 or one.motor_speed > 50.0 for one in made)
    low, high = clopper_pearson(harmed, len(made))
    fastest = max((one.motor_speed for one in made), default=0.0)
    return (
        f"{rig} {branch}: of {len(runs)} rests {len(made)} released, {len(done)} of these with the mode found,"
        f" right {right};"
        f" damaged {harmed} ({100 * low:.1f} to {100 * high:.1f} %); otherwise {dict(others)}, endless {endless};"
        f" refused {dict(refused)}; motors up to {fastest:.2f} rad/s,"
        f" platform up to {max((one.platform_speed for one in made), default=0.0):.2f} m/s,"
        f" least |sin q_i2| {min((one.serial for one in made), default=1.0):.2f},"
        f" least 1/cond(A) at the end {min((one.kappa for one in done), default=0.0):.3f}"
    )


if __name__ == "__main__":
    main()
