# SPDX-License-Identifier: Apache-2.0
"""A simulated robot to practise on: emulated motors in this process, moved by commands or by a hand, in simulated time.

What it is like stands in a file that no step reads: the steps know it by its drives, its gyroscope and the person's
answers alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Annotated, Any, Protocol

import numpy as np
from pydantic import Field

from fivebar_bringup.drives.run_files import GATHER_FRACTION
from fivebar_bringup.motions.start import HOME_MODE
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory
from fivebar_bringup.recorded.summary import Summary
from fivebar_bringup.runs.offline import run_offline
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.guided import DAMPING, GuidedSample, pulled, write_guided_bag
from fivebar_bringup.simulation.mechanism_code import compiled_motion
from fivebar_commission.bench import opened_drives
from fivebar_commission.limits import Allowed, AllowedDrives
from fivebar_commission.person import Lead, Person, PutAt, Task, Turn
from fivebar_commission.record import imu_keys
from fivebar_control.hardware.drive_interface import set_up_or_closed
from fivebar_control.hardware.motors_file import load_motors
from fivebar_control.hardware.two_motors import PairAnswer, PairCommand, ShaftReading, TwoMotors
from fivebar_control.model.geometry import direct_geometry, inverse_geometry
from fivebar_control.model.kinematics import assembly_mode, state_from_joints
from fivebar_control.model.state import Platform, State
from fivebar_control.scenario.guard_settings import motor_torque_limit
from fivebar_control.trajectory.time_scaling import rest_to_rest
from fivebar_description.errors import InputError
from fivebar_description.imu import ImuSettings
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import RobotFile, read_robot
from fivebar_description.settings import Section
from fivebar_description.strict_yaml import read_yaml
from fivebar_sim.effects.links import with_another_model
from fivebar_sim.effects.mechanism import actual_robot
from fivebar_sim.motors.configuration import MotorsEmulationFile
from fivebar_sim.motors.motors import EmulatedMotors, ShaftState
from fivebar_sim.plant import Measurement
from fivebar_sim.sensors import ImuReading, ReadingQueue, imu_queue
from fivebar_studies.engine.running import silent

DEGREE = math.pi / 180.0

GRIP = 10.0
"""Largest stiffness of a hand that puts the platform on a mark, relative to that of one that leads it."""

STEADY = 1.5
"""Part of the platform's speed that the hand may take within a period: with 2 it swings."""

LOADING = 600.0
"""Longest time (s) by the clock until the simulated motors have power."""

HAND_TIME, REST_TIME = 1.5, 1.0
"""Times (s) in which a hand moves the platform, and holds it there."""


class PracticeFile(MotorsEmulationFile):
    """The simulated robot with its drives; see `MotorsEmulationFile` for the other keys.

    Attributes:
        imu: its gyroscope on the distal link of leg 2; none when left out.
        placing: by how much the person is wrong who puts the robot on its mark: of both motors (rad).
    """

    imu: Section[ImuSettings] | None = None
    placing: Annotated[tuple[float, float], Field(strict=False)] = (0.0, 0.0)


def drawn_practice(robot: str, seed: int, rate_hz: int = 500, counts: int = 20_000) -> dict[str, Any]:
    """Return the content of a practice file with a robot that is drawn at random by a number.

    Lengths are wrong by up to 0.3 mm, the zero by 0.3 degrees, masses by 20 %, friction by 50 %; transmissions have 60
    to 250 Hz and up to 0.03 degrees of play; one motor counts the other way round; the IMU is turned by quarters of a
    turn, or upside down, and its clock is up to 10 ms off.
    """
    file, random = read_robot(robot), np.random.default_rng((seed, 41))

    def within(bound: float) -> float:
        return float(random.uniform(-bound, bound))

    five_bar, counted = file.five_bar(), file.drives.encoder_counts or counts
    start = inverse_geometry(five_bar, HOME_MODE, *file.home_m)
    reversed_motor = int(random.integers(2))
    size = max(five_bar.leg1.coulomb, five_bar.leg2.coulomb, 1e-6)
    effects = {
        "seed": seed,
        "links": {name: within(3e-4) for name in ("l_11", "l_12", "l_21", "l_22", "base_1", "base_2")},
        "friction": {"passive": min(0.003, 0.01 * size)},
        "transmission": {
            "frequency": float(random.uniform(60.0, 250.0)),
            "rotor_share": float(random.uniform(0.5, 0.85)),
            "backlash": float(random.uniform(0.0, 0.03 * DEGREE)),
        },
    }
    upside_down = bool(random.integers(2))
    part = file.imu or ImuSettings(gyro_noise=0.01, noise=0.05, rate_hz=min(250, rate_hz), latency=0.004)
    imu = part._replace(
        gyro_bias=within(0.02),
        clock_offset=within(0.01),
        roll=(math.pi if upside_down else 0.0) + (-1.0 if upside_down else 1.0) * abs(within(3.0 * DEGREE)),
        pitch=within(3.0 * DEGREE),
        yaw=0.5 * math.pi * float(random.integers(-1, 3)),
        mount_x=within(0.02),
        mount_y=within(0.01),
    )
    motors = {
        joint: {
            "id": number + 1,
            "counts_per_revolution": counted,
            "sign": -1 if number == reversed_motor else 1,
            "zero_rad": within(2.0),
        }
        for number, joint in enumerate(("q11", "q21"))
    }
    return {
        "name": f"{file.name}_{seed}",
        "robot": robot,
        "initial_joints": [float(angle) for angle in start],
        "mass_scale": 1.0 + within(0.2),
        "inertia_scale": 1.0 + within(0.2),
        "friction_scale": 1.0 + within(0.5),
        "effects": effects,
        "period_us": 1_000_000 // rate_hz,
        "motors": motors,
        "imu": imu_keys(imu),
        "placing": [within(0.3 * DEGREE), within(0.3 * DEGREE)],
    }


def assumed_drives(practice: PracticeFile, torque_limit: float) -> dict[str, Any]:
    """Return the drives as somebody sets them up who does not know which way they count, nor from where."""
    cycles = practice.watchdog_ms * 1000 // practice.period_us
    motors = {
        joint: {
            "id": motor.id,
            "counts_per_revolution": motor.counts_per_revolution,
            "gear_ratio": motor.gear_ratio,
            "torque_constant": motor.torque_constant,
            "torque_limit_nm": torque_limit,
        }
        for joint, motor in zip(("q11", "q21"), practice.pair, strict=True)
    }
    return {
        "name": practice.name,
        "interface": practice.interface or "practice",
        "pace": practice.pace,
        "period_us": practice.period_us,
        "gather_deadline_us": int(GATHER_FRACTION * practice.period_us),
        # less than the watchdog waits, so that the bridge, which knows what is missing, reports the fault
        "missing_limit": max(1, cycles - 3),
        "watchdog_ms": practice.watchdog_ms,
        "link": dict(practice.link),
        "motors": motors,
    }


class _Wires:
    """The `MotorDriver` of emulated motors in the same process."""

    def __init__(self, robot: PracticeRobot) -> None:
        self._robot = robot

    def exchange(self, command: PairCommand, timeout: float) -> PairAnswer:
        first, second = self._robot.commanded(command.power, command.torques)
        powered = all(motor.powered for motor in self._robot.motors.motors)
        return PairAnswer((_reading(first), _reading(second)), powered)

    def clear(self) -> None:
        """Do nothing: simulated drives have no errors."""

    def close(self) -> None:
        """Leave the motors without power."""
        for motor in self._robot.motors.motors:
            motor.command(False, 0.0)


class _Motors(TwoMotors):
    """Both motors in simulated time, which does not pass while machine code is loaded or compiled."""

    def enable(self, timeout: float) -> None:
        super().enable(LOADING)


def _reading(state: ShaftState) -> ShaftReading:
    return ShaftReading(state.position, state.velocity, state.torque)


class PracticeRobot:
    """The simulated robot in simulated time."""

    def __init__(self, file: PracticeFile, machine_code: bool, now: float = 0.0) -> None:
        """Put it home at a time (s); with `machine_code` it moves twenty times as fast, once that has been compiled."""
        self.file = file
        self.period = file.period_us / 1e6
        self.samples = 0
        self.motors = EmulatedMotors(file, now, imu=file.imu)
        if machine_code:
            self.motors.plant.use_machine_code(compiled_motion())
        self.actual: FiveBar = actual_robot(read_robot(file.robot).five_bar(), file.plant())

    def commanded(self, power: bool, torques: tuple[float, float]) -> tuple[ShaftState, ShaftState]:
        """Command both drives, which moves the robot on by a period; return what they found."""
        self.samples += 1
        first, second = (
            self.motors.command(number, power, torque, self.samples * self.period)
            for number, torque in enumerate(torques)
        )
        return first, second

    @property
    def state(self) -> State:
        """Where the robot is."""
        truth = self.motors.plant.truth()
        return state_from_joints(self.actual, *truth.position, *truth.velocity)

    def by_hand(self, wanted: Callable[[float], Platform], seconds: float, grip: float = 1.0) -> None:
        """Let a hand move the platform without power, to where it is wanted at each time (s).

        Raises:
            InputError: the robot moves too fast to be simulated.
        """
        for number in range(round(seconds / self.period)):
            x, y = pulled(self.actual, self.state, wanted(number * self.period))
            self.motors.pull(grip * x, grip * y)
            self.commanded(False, (0.0, 0.0))
        self.motors.pull(0.0, 0.0)
        if all(motor.faulty for motor in self.motors.motors):
            raise InputError(f"{self.file.name}: moved by hand, the robot moves too fast to be simulated")

    @property
    def firmest_grip(self) -> float:
        """The grip of a hand whose force, held for a period, does not make the robot swing where it is."""
        actual, state, springs = self.actual, self.state, self.file.effects.transmission
        of_links = 1.0 - springs.rotor_share if springs.frequency > 0.0 else 1.0
        moved = actual.mass * np.eye(2)
        for parameters, leg in ((actual.leg1, state.leg1), (actual.leg2, state.leg2)):
            moved += of_links * parameters.inertia / leg.b**2 * np.outer((leg.u_x, leg.u_y), (leg.u_x, leg.u_y))
        steady = STEADY * float(np.linalg.eigvalsh(moved)[0]) / (DAMPING * actual.mass * self.period)
        return max(1.0, min(GRIP, steady))

    def moved_to(self, x: float, y: float) -> None:
        """Let a hand put the platform in a place, and let go of it there."""
        begin = self.state

        def wanted(time: float) -> Platform:
            share = rest_to_rest(time / HAND_TIME)[0]
            return Platform(begin.x + share * (x - begin.x), begin.y + share * (y - begin.y), 0.0, 0.0, 0.0, 0.0)

        self.by_hand(wanted, HAND_TIME + REST_TIME, self.firmest_grip)

    def does(self, task: Task) -> None:
        """Let a hand do a task at the robot, as well as it can; a motion along waypoints is left to the bench."""
        match task:
            case Turn(motor, angle):
                state = self.state
                angles = [state.leg1.q1, state.leg2.q1]
                angles[motor] += angle
                self.moved_to(*direct_geometry(self.actual, assembly_mode(state), *angles))
            case PutAt(x, y):
                first, second = self.file.placing
                joints = inverse_geometry(self.actual, HOME_MODE, x, y)
                mode = assembly_mode(self.state)
                self.moved_to(*direct_geometry(self.actual, mode, joints.q11 + first, joints.q21 + second))
            case Lead():
                pass


class HandledRobot(Protocol):
    """A simulated robot that a hand may move."""

    def does(self, task: Task) -> None:
        """Let a hand do a task at the robot, and return when it is done."""
        ...


class SimulatedPerson:
    """The person at the simulated robot: agrees to everything, and acts as well as a hand can."""

    def __init__(self, robot: HandledRobot) -> None:
        """Stand at a robot."""
        self._robot = robot
        self.asked = 0

    def agrees(self, key: str, question: str) -> bool:
        """Agree."""
        self.asked += 1
        return True

    def does(self, key: str, request: str, task: Task) -> None:
        """Do it."""
        self.asked += 1
        self.act(task)

    def act(self, task: Task) -> None:
        """Carry out the task at once, without a question."""
        self._robot.does(task)


class PracticeBench:
    """The `RobotBench` of a simulated robot."""

    def __init__(self, file: PracticeFile, machine_code: bool = True) -> None:
        """Put the robot home."""
        self.robot = PracticeRobot(file, machine_code)
        self._file = file
        self._drawn: RobotFile = read_robot(file.robot)

    @property
    def imu(self) -> ImuSettings | None:
        """Data sheet of the gyroscope: its rate, range and low-pass, and how late its readings come."""
        true = self._file.imu
        if true is None:
            return None
        return ImuSettings(
            rate_hz=true.rate_hz,
            latency=true.latency,
            gyro_bandwidth_hz=true.gyro_bandwidth_hz,
            gyro_range=true.gyro_range,
        )

    @property
    def time(self) -> float:
        """Simulated time so far (s)."""
        return self.robot.samples * self.robot.period

    def opened(self, drives: Path, allowed: Allowed) -> AbstractContextManager[AllowedDrives]:
        """Open the drives for a block."""
        motors = _Motors(load_motors(str(drives)), _Wires(self.robot))
        return opened_drives(lambda: set_up_or_closed(motors), allowed)

    def wait(self) -> None:
        """Do nothing: simulated time advances with each cycle."""

    def record_by_hand(
        self, person: Person, key: str, request: str, scenario: Scenario, drives: Path, out: Path
    ) -> RunDirectory:
        """Record a motion by hand."""
        person.does(key, request, Lead(scenario))
        as_it_is, robot = self._as_it_is(scenario), self.robot
        path, rate_hz = scenario.plan().path, scenario.rate_hz
        plant = as_it_is.plant
        queue: ReadingQueue[ImuReading] = imu_queue(as_it_is.imu, plant.gyroscope, rate_hz, plant.seed)
        samples = []
        with self.opened(drives, Allowed(motor_torque_limit(scenario) or 0.0, math.inf)) as allowed_drives:
            for number in range(path.samples(rate_hz) + 1):
                truth, reading = robot.motors.plant.truth(), robot.motors.plant.measure_imu()
                pull_x, pull_y = pulled(robot.actual, robot.state, path.at(number / rate_hz))
                robot.motors.pull(pull_x, pull_y)
                first, second = allowed_drives.exchange().readings
                assert first is not None and second is not None, "wires lose nothing"
                arrived = queue.arrived(number, reading) if self._file.imu is not None else []
                angles = first.position, second.position
                force = math.hypot(pull_x, pull_y)
                samples.append(GuidedSample(angles, arrived, truth.position, truth.velocity, force))
            robot.motors.pull(0.0, 0.0)
        run = new_run_directory(out, scenario)
        write_guided_bag(samples, as_it_is, run.bag)
        return run

    def close(self) -> None:
        """Do nothing: nothing is left open."""

    def run(self, scenario: Scenario, drives: Path, out: Path, page: bool) -> tuple[RunDirectory, Summary]:
        """Run a scenario in simulated time, through the drives."""
        allowed = Allowed(motor_torque_limit(scenario) or math.inf, scenario.safety.joint_speed_limit)
        with self.opened(drives, allowed) as allowed_drives:
            allowed_drives.enable(LOADING)
            driven = _DrivenRobot(self.robot, allowed_drives)
            run, summary = run_offline(self._as_it_is(scenario), out, silent, page, plant=driven)
        return run, summary

    def _as_it_is(self, scenario: Scenario) -> Scenario:
        """Return a scenario that says what the robot is like beside its file, for judging its run by the truth."""
        links = with_another_model(self._file.effects.links, self._drawn.five_bar(), scenario.five_bar())
        imu = scenario.imu
        if self._file.imu is not None:
            imu = imu._replace(clock_offset=self._file.imu.clock_offset, lost=self._file.imu.lost)
        plant = scenario.plant._replace(links=links, gyroscope=self._file.effects.gyroscope)
        return scenario.model_copy(update={"plant": plant, "imu": imu})


class _DrivenRobot:
    """The `SampledRobot` behind drives: a command acts from the next sample on."""

    def __init__(self, robot: PracticeRobot, drives: AllowedDrives) -> None:
        self._robot, self._drives = robot, drives
        self._truth = robot.motors.plant.truth()
        self._imu = ImuReading((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    def measure(self) -> Measurement:
        plant = self._robot.motors.plant
        self._truth, self._imu = plant.truth(), plant.measure_imu()
        first, second = self._drives.exchange().readings
        assert first is not None and second is not None, "wires lose nothing"
        nan = math.nan
        return Measurement(
            (first.position, nan, second.position, nan),
            (first.velocity, nan, second.velocity, nan),
            (first.torque, 0.0, second.torque, 0.0),
        )

    def measure_imu(self) -> ImuReading:
        return self._imu

    def truth(self) -> Measurement:
        return self._truth

    def advance(self, command: tuple[float, float]) -> None:
        self._drives.write(command)


def read_practice(path: Path) -> PracticeFile:
    """Read a practice file.

    Raises:
        InputError: it is missing, or malformed.
    """
    return read_yaml(path, PracticeFile, ("robot",))
