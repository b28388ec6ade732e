# SPDX-License-Identifier: Apache-2.0
"""How a commissioning begins or is resumed: from the command's options to a session."""

from __future__ import annotations

import math
import re
import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from fivebar_bringup.drives.choice import run_files_of
from fivebar_bringup.recorded.results import write_errors
from fivebar_commission.bench import RobotBench
from fivebar_commission.clocked import ClockedBench, by_the_clock
from fivebar_commission.drives_file import DrivesFile, configuration_path
from fivebar_commission.person import Answer, Person, PersonAtTerminal, PersonByFile
from fivebar_commission.practice import (
    PracticeBench,
    PracticeFile,
    SimulatedPerson,
    assumed_drives,
    drawn_practice,
    read_practice,
)
from fivebar_commission.real import RealBench
from fivebar_commission.record import STATE_FILE, CommissionState, resumed
from fivebar_commission.session import DRIVES_FILE, ROBOT_FILE, TOLERATED, Session
from fivebar_commission.steps.sequence import STEPS
from fivebar_control.hardware.connection import interface_of
from fivebar_description.drive_kinds import confirm_installed, drive_kind
from fivebar_description.files import is_yaml_path, write_file
from fivebar_description.robot_file import RobotFile, read_robot
from fivebar_description.strict_yaml import InputError, load_yaml, parse_yaml, validate, yaml_text
from fivebar_description.suggestion import expected_one_of

PRACTICE_FILE = "practice.yaml"
"""The simulated robot: what the steps are to find out."""


def begun(
    *,
    robot: str,
    torque: float,
    speed: float,
    drives: str | None,
    practice: str | None,
    answers: str | None,
    again: str | None,
    last: str | None,
    out: Path | None,
    imu_rate_hz: int,
    tell: Callable[[str], None],
    read: Callable[[], str],
    realtime: bool = False,
) -> Session:
    """Return the session of a command's options; see the command.

    Args:
        robot, torque, speed, drives, practice, answers, again, last, out, imu_rate_hz, realtime: as given.
        tell: prints a line.
        read: reads a line of standard input.

    Raises:
        InputError: an option is wrong, or the directory is that of something else.
    """
    names = [step.name for step in STEPS]
    for option, name in (("--again", again), ("--until", last)):
        if name is not None and name not in names:
            raise InputError(f"{option}: {name!r}: {expected_one_of(name, names)}")
    for option, value in (("--torque", torque), ("--speed", speed)):
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"{option}: {value}: expected a positive number")
    file = read_robot(robot)
    if practice is not None and drives is not None:
        raise InputError("--drives: expected without --practice, whose drives are simulated")
    if practice is not None and imu_rate_hz:
        raise InputError("--imu-rate: expected without --practice, whose IMU is simulated")
    if realtime and practice is None:
        raise InputError("--realtime: expected with --practice; a real robot follows the clock anyhow")
    stem = re.sub(r"[^\w.-]+", "-", file.name)
    folder = out or Path("runs") / f"commission-{stem}"
    chosen = _drives_of(file, drives) if practice is None else ""
    asked = CommissionState(
        robot=robot,
        drives=chosen,
        practice=practice or "",
        realtime=realtime,
        torque_nm=torque,
        speed_rad_s=speed,
    )
    state = resumed(folder, asked)
    if again is not None:
        state = state.before(again)
    with write_errors(folder), _nothing_left_of(folder):
        folder.mkdir(parents=True, exist_ok=True)
        return _session(folder, robot, file, state, answers, imu_rate_hz, tell, read)


@contextmanager
def _nothing_left_of(folder: Path) -> Iterator[None]:
    """Leave a folder missing or empty as it was, where a block that begins there is refused or interrupted."""
    existed, resumes = folder.exists(), (folder / STATE_FILE).exists()
    try:
        yield
    except BaseException:
        if not resumes:
            shutil.rmtree(folder, ignore_errors=True)
            if existed:
                folder.mkdir(exist_ok=True)
        raise


def _session(
    folder: Path,
    robot: str,
    file: RobotFile,
    state: CommissionState,
    answers: str | None,
    imu_rate_hz: int,
    tell: Callable[[str], None],
    read: Callable[[], str],
) -> Session:
    """Write the files that are not in the folder yet, and return the session."""
    torque, speed, practice = state.torque_nm, state.speed_rad_s, state.practice
    if not (folder / ROBOT_FILE).exists():
        content = file.model_dump(mode="json", exclude_none=True)
        content["drives"] = content.get("drives", {}) | {"torque_limit": torque, "joint_speed_limit": speed}
        if not file.tolerances.declared:
            content["tolerances"] |= TOLERATED
        write_file(folder / ROBOT_FILE, yaml_text(content))
    bench: RobotBench
    person: Person | None
    known = {} if answers is None else _answers_in(answers)
    if practice:
        simulated = _practice_in(folder, robot, practice, torque, state.realtime)
        practised: ClockedBench | PracticeBench
        practised = ClockedBench(folder / PRACTICE_FILE) if state.realtime else PracticeBench(simulated)
        bench, person = practised, SimulatedPerson(practised.robot)
    else:
        _write_drives(folder, state.drives, torque)
        bench = RealBench(DrivesFile(folder / DRIVES_FILE).rate_hz, imu_rate_hz)
        person = PersonAtTerminal(read, tell) if answers is None else None
    if answers is not None:
        person = PersonByFile(known, answers, person)
    assert person is not None, "somebody answers"
    state.write(folder)
    return Session(folder, state, bench, person, tell)


def _drives_of(file: RobotFile, drives: str | None) -> str:
    """Return the configuration of real drives, by name or path.

    Raises:
        InputError: none is given, and the robot has none of its own; or the drives are on a board behind a serial port.
    """
    named = drives and interface_of(drives)
    kind = drive_kind(named or file.drives.interface)
    confirm_installed(kind)
    files = run_files_of(kind)
    if files.has_port:
        raise InputError(f"{kind.name}: a board behind a serial port: expected --drives of another kind, or --practice")
    configuration = drives or files.real_drives
    if not configuration:
        raise InputError(f"--drives: expected the configuration of the {kind.name} drives, or --practice")
    return configuration


def _write_drives(folder: Path, configuration: str, torque: float) -> None:
    """Write the drives' file once, with limits within the allowed torque."""
    path = folder / DRIVES_FILE
    if not path.exists():
        file = DrivesFile(configuration_path(configuration))
        file.limit(torque)
        file.write(path)


def _practice_in(folder: Path, robot: str, practice: str, torque: float, realtime: bool) -> PracticeFile:
    """Return the simulated robot of a directory, which is written there once, as are its drives."""
    path = folder / PRACTICE_FILE
    if not path.exists():
        if practice.isdecimal():
            named = str(Path(robot).absolute()) if is_yaml_path(robot) else robot
            content = drawn_practice(named, int(practice))
        else:
            loaded = load_yaml(Path(practice))
            content = loaded if isinstance(loaded, dict) else {}
        if realtime:
            content = by_the_clock(content)
        validate(content, PracticeFile, practice)
        write_file(path, yaml_text(content))
    file = read_practice(path)
    if not (folder / DRIVES_FILE).exists():
        write_file(folder / DRIVES_FILE, yaml_text(assumed_drives(file, torque)))
    return file


def _answers_in(source: str) -> dict[str, Answer]:
    """Return answers by their keys.

    Raises:
        InputError: the file is none, or has something else.
    """
    content = parse_yaml(sys.stdin.read(), "standard input") if source == "-" else load_yaml(Path(source))
    content = {} if content is None else content
    if not isinstance(content, dict) or not all(
        isinstance(value, str | int | float | bool) for value in content.values()
    ):
        raise InputError(f"{source}: expected answers by the keys of questions, such as 'parts.emergency_stop: yes'")
    return {str(key): answer for key, answer in content.items()}
