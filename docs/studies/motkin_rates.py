# SPDX-License-Identifier: Apache-2.0
"""Random crossings of the MOTKIN bench at low rates of the controllers, behind docs/motkin.md.

`python docs/studies/motkin_rates.py` draws crossings that the planner accepts at 500 Hz, and tells at each rate how
many it accepts for an exact robot, and how many stay within 2 mm: of exact robots with exact sensors, and of robots of
the rig `printed_calibrated`, which have its sensors and estimator. With `--gains` the drives add their own gains to the
torques, 1 A/rad and 0.03 A/(rad/s), which fade near the locus as those of the bridge do.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections import deque
from collections.abc import Iterator

import numpy as np

from fivebar_bringup.drives.ros2_control_files import for_scenario
from fivebar_bringup.odds.robot_errors import with_drawn_robot
from fivebar_bringup.runs.screening import screened
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.offline import simulate
from fivebar_control.hardware.inner_loop import OPEN, InnerLoopSettings, LoopTargets, MotorSetPoint, set_point
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.planning.pacing import Task
from fivebar_control.planning.postures import place_at
from fivebar_control.planning.transfer import Transfer, plan_transfer
from fivebar_control.scenario.guard_settings import motor_torque_limit
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.scenario.motion_limits import scenario_limits
from fivebar_control.scenario.sensors import sensing_if_estimated
from fivebar_control.scenario.start import initial_joints
from fivebar_control.trajectory.refusal import PlanRefused
from fivebar_description.strict_yaml import InputError, validate
from fivebar_sim.effects.timing import BusEffects, lost_commands
from fivebar_sim.plant import Plant
from fivebar_studies.rigs.named import find_rig

RATES = (100, 200, 500, 1000)
WITHIN = 2e-3
"""Largest distance from the reference (m) of a crossing that counts as made."""

MODE = (1, -1)
RIG, SEED = "printed_calibrated", 1

TORQUE_LIMIT = 0.186
"""Largest torque of a motor (Nm)."""
GAINS = {"stiffness": 0.062, "damping": 0.00186}  # Nm/rad, Nm/(rad/s)
LONGEST_PART = 5e-4
"""Longest time (s) between two runs of the drives' own control, which is quicker on the bench."""


def base(**keys: object) -> Scenario:
    """Return a scenario of the bench without its motion, by exact sensors."""
    content = {"name": "rates", "controller": "unified", "robot": "motkin", "waypoints": [[0.0, 0.12], [0.0, 0.0]]}
    return validate({**content, "estimator": "none", **keys}, Scenario, "rates")


def planned(rate_hz: int, start: tuple[float, float], goal: tuple[float, float]) -> Transfer | None:
    """Return the planner's motion between two rests at a rate, None where there is none."""
    scenario = base(rate_hz=rate_hz)
    follower = tuned_controller(scenario)
    limits = scenario_limits(scenario, None, follower, motor_torque_limit(scenario) or 0.0, 40.0)
    task = Task(scenario.five_bar(), MODE, rate_hz, follower, limits, sensing_if_estimated(scenario))
    try:
        return plan_transfer(task._replace(sensing=None), start, goal)
    except (PlanRefused, InputError):
        return None


def drawn(count: int, seed: int = 1) -> Iterator[Transfer]:
    """Yield crossings between random rests that the planner accepts at 500 Hz."""
    robot, generator, found = base().five_bar(), np.random.default_rng(seed), 0
    while found < count:
        ends = [tuple(map(float, generator.uniform((-0.05, -0.02), (0.05, 0.13)))) for _ in range(2)]
        sides = [place_at(robot, MODE, x, y) for x, y in ends]
        if any(not side.kappa > 0.1 or side.serial < 0.2 for side in sides) or sides[0].assembly == sides[1].assembly:
            continue
        motion = planned(500, (ends[0][0], ends[0][1]), (ends[1][0], ends[1][1]))
        if motion is not None and motion.crossings:
            found += 1
            yield motion


class LedRobot(Plant):
    """The simulated robot on drives that add their gains to the torque; their targets come from its exact state."""

    def __init__(self, scenario: Scenario) -> None:
        """Put the robot where its motion starts."""
        rate_hz = scenario.rate_hz
        self._parts = max(1, math.ceil(1.0 / (rate_hz * LONGEST_PART)))
        # a command is late or lost together with its targets, and not part by part
        plant = scenario.plant
        settings = plant._replace(delay_samples=0, bus=BusEffects())
        robot, joints = scenario.five_bar(), initial_joints(scenario)
        super().__init__(robot, joints, rate_hz, settings, scenario.imu, parts=self._parts)
        link = for_scenario({"takes": "gains", "unit": "Nm", "inner_loop": GAINS}, scenario)
        self._gains = validate(link["inner_loop"], InnerLoopSettings, "rates")
        self._targets = LoopTargets(self._gains, round(1e6 / rate_hz))
        self._reference = scenario.plan().path.at
        self._lead, self._rate_hz, self._sample = scenario.lead_samples, rate_hz, 0
        self._lost = lost_commands(plant.bus, plant.seed, rate_hz)
        self._held = (0.0, 0.0), (OPEN, OPEN)
        self._late = deque([self._held] * plant.delay_samples)

    def advance(self, command: tuple[float, float]) -> None:
        """Answer the present sample by torques (Nm) and set points, and go on to the next one."""
        number = self._sample - len(self._late)
        self._late.append((command, self._set_points(command)))
        arrived = self._late.popleft()
        self._held = self._held if number in self._lost else arrived
        torques, points = self._held
        self._sample += 1
        for _ in range(self._parts):
            angles, speeds = self.seen()
            first, second = (
                torque + point.kp * (point.angle - angle) + point.kd * (point.speed - speed)
                for torque, point, angle, speed in zip(torques, points, angles[::2], speeds[::2], strict=True)
            )
            super().advance((first, second))

    def _set_points(self, command: tuple[float, float]) -> tuple[MotorSetPoint, MotorSetPoint]:
        truth, wanted = self.truth(), self._reference((self._sample + self._lead) / self._rate_hz)
        target = self._targets.target(wanted[:4], truth.position, truth.velocity)
        if target is None:
            return OPEN, OPEN
        angles, speeds = self.seen()
        motors = zip(
            command,
            zip(angles[::2], target.positions, strict=True),
            zip(speeds[::2], target.velocities, strict=True),
            strict=True,
        )
        first, second = (
            set_point(self._gains, TORQUE_LIMIT, torque, target.weight, *pairs) for torque, *pairs in motors
        )
        return first, second


def peak(scenario: Scenario, gains: bool = False) -> float:
    """Return the largest distance from the reference (m) in a simulated run, infinite after a fault."""
    run, robot = simulate(scenario, plant=LedRobot(scenario) if gains else None), scenario.actual_robot()
    if run.faults:
        return np.inf
    distances = []
    for sample in run.samples:
        state = state_from_joints(robot, *sample.exact.position, *sample.exact.velocity)
        distances.append(math.hypot(state.x - sample.reference.x, state.y - sample.reference.y))
    return max(distances)


def calibrated(scenario: Scenario, number: int) -> Scenario:
    """Return the scenario of a robot that is drawn from the rig."""
    rig = find_rig(RIG)
    on_rig = validate(rig.content(scenario, "unified"), Scenario, "rates")
    return with_drawn_robot(on_rig, rig.errors, SEED, number, scenario.plan().crossings[0].time)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--rates", type=int, nargs="+", default=RATES)
    parser.add_argument("--gains", action="store_true", help="of the drives, besides the torques")
    chosen = parser.parse_args()
    cases = list(drawn(chosen.cases))
    print("| rate | accepted | exact, within 2 mm | calibrated, within 2 mm |", flush=True)
    for rate_hz in chosen.rates:
        accepted = exact = known = 0
        for number, motion in enumerate(cases):
            keys = {
                "rate_hz": rate_hz,
                "waypoints": [list(point) for point in motion.waypoints],
                "segment_duration": list(motion.durations),
                "time_law": motion.course.time_law,
            }
            scenario = base(**keys)
            try:
                accepted += screened(scenario, scenario.plan()).feasible
                exact += peak(scenario, chosen.gains) <= WITHIN
                known += peak(calibrated(scenario, number), chosen.gains) <= WITHIN
            except InputError as error:
                print(f"{rate_hz} Hz, crossing {number}: {error}", file=sys.stderr)
        print(f"| {rate_hz} Hz | {accepted} | {exact} | {known} |", flush=True)


if __name__ == "__main__":
    main()
