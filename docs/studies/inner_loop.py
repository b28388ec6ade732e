# SPDX-License-Identifier: Apache-2.0
"""A crossing on the emulated motor board with and without its inner loop, in this process and without ROS.

`python docs/studies/inner_loop.py` prints the errors and torques behind docs/motkin.md.
"""

from __future__ import annotations

import argparse
import itertools
import math
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fivebar_bringup.drives.choice import write_drive_files
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import OfflineRun, simulate
from fivebar_control.hardware.drive_interface import ZERO, JointTarget, Torques
from fivebar_control.hardware.inner_loop import OPEN, LoopTargets, away_from_jump, set_point
from fivebar_control.model.kinematics import det_a, state_from_joints
from fivebar_description.robot_file import load_robot
from fivebar_description.rounding import in_millimetres
from fivebar_description.strict_yaml import read_yaml
from fivebar_motkin.board_file import BoardFile, load_board
from fivebar_motkin.board_units import current_limit, joint_angle, joint_torque, motor_current
from fivebar_motkin_emulation.configuration import BoardEmulationFile
from fivebar_motkin_emulation.motor import EmulatedMotor
from fivebar_motkin_emulation.protocol import MotorCommand
from fivebar_sim.plant import Measurement, Plant

SCENARIO = "motkin_middle"
RESOLVED_US = 500
"""Time (us) between two runs of the board's control, which is said to be much faster than the law's."""

ERRORS: dict[str, dict[str, Any]] = {
    "as modelled": {},
    "mass +20 %": {"mass_scale": 1.2},
    "friction doubled": {"friction_scale": 2.0},
    "cogging 2 mNm": {"motors": {"cogging": 2e-3}},
    "all three": {"mass_scale": 1.2, "friction_scale": 2.0, "motors": {"cogging": 2e-3}},
}
"""Differences of the robot from its file."""

SPREAD = 0.01
"""How much mass and friction vary between the draws: on the locus a run's error depends on the last digits of both."""

GAINS = ((0.0, 0.0), (1.0, 0.03), (3.0, 0.1))
"""Stiffness (A/rad) and damping (A/(rad/s)) of the inner loop."""


class PlantOnBoard(Plant):
    """The simulated robot on the motors of the emulated board, as the bridge sees it."""

    def __init__(self, scenario: Scenario, board: BoardFile, emulation: BoardEmulationFile) -> None:
        """Put the robot at the start of its motion."""
        super().__init__(
            load_robot(emulation.robot), emulation.initial_joints, round(1.0 / emulation.tick), emulation.plant()
        )
        self._board, self._ticks = board, emulation.ticks
        self._motors = [EmulatedMotor(facts, emulation.tick) for facts in emulation.pair]
        self._inner_loop = LoopTargets(board.inner_loop, board.period_us)
        self._path, self._rate_hz, self._lead = scenario.plan().path, scenario.rate_hz, scenario.lead_samples
        self._sample = 0
        self._torques: Torques = ZERO
        self._target: JointTarget | None = None
        self._near = [emulation.initial_joints[0], emulation.initial_joints[2]]
        for motor, angle in zip(self._motors, self._near, strict=True):
            motor.place(angle)

    def measure(self) -> Measurement:
        """Return the motors' readings; the passive joints have no encoders."""
        efforts = []
        for number, (motor, drive) in enumerate(zip(self._motors, self._board.pair, strict=True)):
            self._near[number] = joint_angle(drive, motor.state.angle, self._near[number])
            efforts.append(joint_torque(drive, motor.state.current))
        (first, second), (effort1, effort2) = self._near, efforts
        return Measurement((first, 0.0, second, 0.0), (0.0,) * 4, (effort1, 0.0, effort2, 0.0))

    def advance(self, command: tuple[float, float]) -> None:
        """Send the command that answers the sample before, and move on by one period.

        Raises:
            PlantDiverged: the motion is too fast for an accurate integration.
        """
        commands = [self._command(number) for number in range(2)]
        x, y, vx, vy, _, _ = self._path.at((self._sample + self._lead) / self._rate_hz)
        truth = self.truth()
        self._torques = command
        self._target = self._inner_loop.target((x, y, vx, vy), truth.position, truth.velocity)
        self._sample += 1
        for _ in range(self._ticks):
            first, second = (motor.drive(one) for motor, one in zip(self._motors, commands, strict=True))
            super().advance((first, second))
            (q11, _, q21, _), _ = self.seen()
            self._motors[0].sense(q11)
            self._motors[1].sense(q21)

    def _command(self, number: int) -> MotorCommand:
        drive, state, target = self._board.pair[number], self._motors[number].state, self._target
        current = motor_current(drive, self._torques[number])
        point = OPEN
        if target is not None:
            missing = math.remainder(target.positions[number] - self._near[number], math.tau)
            angle = state.angle, state.angle + drive.sign * missing
            speed = state.speed, drive.sign * target.velocities[number]
            point = set_point(
                self._board.inner_loop,
                current_limit(drive),
                current,
                target.weight * away_from_jump(angle[0]),
                angle,
                speed,
            )
        return MotorCommand(point.kp, point.kd, current, point.angle, point.speed)


class Crossed(NamedTuple):
    """A run: largest and RMS error of the platform (m), largest torque of law and motor (Nm), whether it was done."""

    error: float
    rms: float
    law: float
    motor: float
    completed: bool


def crossed(errors: dict[str, Any], gains: tuple[float, float], seed: int) -> Crossed:
    """Return how the scenario goes on a robot with errors, with these gains of the inner loop."""
    content = load_scenario(SCENARIO).model_dump(mode="json")
    random = np.random.default_rng(seed)
    drawn = {
        name: errors.get(name, 1.0) * random.uniform(1.0 - SPREAD, 1.0 + SPREAD)
        for name in ("mass_scale", "friction_scale")
    }
    content["plant"] |= {**errors, **drawn, "seed": seed}
    scenario = Scenario.model_validate(content)
    with tempfile.TemporaryDirectory() as folder:
        files = write_drive_files(scenario, Path(folder))
        board, emulation = load_board(str(files.drives)), read_yaml(files.emulation, BoardEmulationFile)
    stiffness, damping = gains
    loop = board.inner_loop.model_copy(update={"stiffness": stiffness, "damping": damping})
    board = board.model_copy(update={"inner_loop": loop})
    emulation = emulation.model_copy(update={"tick_us": RESOLVED_US})
    return _figures(scenario, simulate(scenario, plant=PlantOnBoard(scenario, board, emulation)))


def _figures(scenario: Scenario, run: OfflineRun) -> Crossed:
    robot, plan = scenario.five_bar(), scenario.plan()
    errors, sides = [], []
    for sample in run.samples:
        state = state_from_joints(robot, *sample.exact.position, *sample.exact.velocity)
        wanted = plan.path.at(sample.number / scenario.rate_hz)
        errors.append(math.hypot(state.x - wanted.x, state.y - wanted.y))
        sides.append(det_a(state) > 0.0)
    changes = sum(before != after for before, after in itertools.pairwise(sides))
    return Crossed(
        max(errors),
        float(np.sqrt(np.mean(np.square(errors)))),
        max(max(map(abs, sample.command)) for sample in run.samples),
        max(max(map(abs, sample.estimated.motors[1])) for sample in run.samples if sample.estimated is not None),
        not run.faults and changes == len(plan.crossings),
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=12, help="draws of mass, friction and the cogging's phase")
    parser.add_argument("robots", nargs="*", default=list(ERRORS), help="names of the rows; by default all")
    given = parser.parse_args()
    print("| robot | kp, kd | completed | error, median and largest | RMS, median | law's torque | motor's torque |")
    print("|---|---|---|---|---|---|---|")
    for name, errors in ((name, ERRORS[name]) for name in given.robots):
        for gains in GAINS:
            runs = [crossed(errors, gains, seed) for seed in range(given.seeds)]
            done = sum(run.completed for run in runs)
            error, rms, law, motor, _ = np.median(np.array(runs, dtype=float), axis=0)
            worst = max(run.error for run in runs)
            torques = f"{law * 1e3:.1f} mNm | {motor * 1e3:.1f} mNm"
            print(
                f"| {name} | {gains[0]:g}, {gains[1]:g} | {done} of {len(runs)}"
                f" | {in_millimetres(error, 3)}, {in_millimetres(worst, 3)} | {in_millimetres(rms, 4)} | {torques} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
