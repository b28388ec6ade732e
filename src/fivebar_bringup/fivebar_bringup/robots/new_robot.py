"""Asks for what a robot file needs, and writes it with comments."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fivebar_bringup.motions.start import HOME_MODE
from fivebar_bringup.robots.questions import LENGTHS, OTHERS, Answers, Question
from fivebar_bringup.studies.map.map import check_that_legs_meet
from fivebar_control.model.geometry import workspace_bounds
from fivebar_control.planning.postures import place_at
from fivebar_description.errors import InputError
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import RobotFile
from fivebar_description.strict_yaml import parse_versioned, validate, yaml_text

Ask = Callable[[str], str]
"""Shows a question, and returns the line that answers it; raises EOFError where there is none."""

Refuse = Callable[[str], None]
"""Shows why an answer is refused, in a line."""

PLACES = 60
"""Places along each side of the workspace among which the one to rest at is chosen."""

LEAST_WIDTH = 0.02
"""rad/s, of the smoothing of Coulomb friction."""

TURN = 2.0 * math.pi


def asked(ask: Ask, refuse: Refuse) -> dict[str, float]:
    """Return the answers to all questions; one that is refused is asked again, and lengths that do not meet too.

    Raises:
        InputError: there were fewer answers than questions.
    """
    while True:
        answers: dict[str, float] = {}
        _answer(LENGTHS, answers, ask, refuse)
        try:
            check_that_legs_meet(_robot(answers), "these lengths")
        except InputError as error:
            refuse(str(error))
            continue
        break
    _answer(OTHERS, answers, ask, refuse)
    return answers


def robot_text(name: str, answers: Answers) -> str:
    """Return a robot file with comments.

    Raises:
        InputError: the answers make no robot, or it has no place to rest at.
    """
    x, y = home_of(_robot(answers))
    gear, counts = answers["gear"], round(answers["counts"] * answers["gear"])
    if counts < 2:
        raise InputError(f"gear of {gear:g}: {answers['counts']:g} counts: expected at least 2 in a turn of the joint")
    inertias = [_inertia(answers, leg) for leg in (1, 2)]
    # half of what one count in a sample is
    width = max(LEAST_WIDTH, 0.5 * TURN / counts * answers["rate"])
    lengths = ", ".join(f"{one.key}: {_metres(answers[one.key])}" for one in LENGTHS)
    friction = f"{answers['friction']:.6g}"
    lines = [
        f"# {_one_line(name)}: from answers to `fivebar robot new`. Keys: docs/reference/robot.schema.json",
        "format: 1",
        yaml_text({"name": name}).rstrip(),
        "# between the motor axes; proximal and distal link of leg 1 (left), of leg 2 (right)",
        f"lengths_m: {{{lengths}}}",
        f"# about the motor axes: rotor behind a gear of {gear:g}, proximal link as a rod, half of the distal link at",
        "# its elbow; `fivebar identify` measures these, the mass and the friction",
        f"inertias_kg_m2: {{zz_11R: {inertias[0]:.6g}, zz_21R: {inertias[1]:.6g}}}",
        "# at the platform, with half of both distal links",
        f"mass_kg: {{m: {answers['platform'] + answers['distal_mass']:.6g}}}",
        "# Coulomb friction of each motor, its offset, and the width of its smoothing",
        f"friction: {{f_s11: {friction}, f_s21: {friction}, f_off11: 0.0, f_off21: 0.0, width_rad_s: {width:.4g}}}",
        "# where it rests, elbows outwards",
        f"home_m: [{x}, {y}]",
        "drives:",
        f"  torque_limit: {answers['torque']:.6g}         # Nm at the joint",
        f"  joint_speed_limit: {answers['speed']:.6g}    # rad/s",
        f"  encoder_counts: {counts}     # per turn of the joint",
        "  delay_samples: 1          # from a command to its torque",
        "# how exactly it is known, plus or minus: m, m, rad; `fivebar calibrate` makes it smaller",
        f"tolerances: {{length: {_metres(answers['known_length'])}, base: {_metres(answers['known_length'])},"
        f" zero: {math.radians(answers['known_zero']):.4g}}}",
        "# what it has to bear while it crosses: rad, N, Nm in each passive joint",
        f"loads: {{tilt: {math.radians(answers['tilt']):.4g}, push: {answers['push']:.6g},"
        f" passive: {answers['passive']:.6g}}}",
    ]
    lines += _transmission(answers) + _sensors(answers)
    text = "\n".join(lines) + "\n"
    validate(parse_versioned(text, name), RobotFile, name)
    return text


def home_of(robot: FiveBar) -> tuple[float, float]:
    """Return the best conditioned place (m) with elbows outwards, in millimetres without a rest.

    Raises:
        InputError: the robot has none.
    """
    left, right, bottom, top = workspace_bounds(robot)
    grid = [(x, y) for x in np.linspace(left, right, PLACES) for y in np.linspace(max(0.0, bottom), top, PLACES)]
    points = [(round(float(x), 3) + 0.0, round(float(y), 3) + 0.0) for x, y in grid]
    places = [place_at(robot, HOME_MODE, *point) for point in points]
    inside = [one for one in places if min(one.kappa, one.serial) > 0.0]
    if not inside:
        raise InputError("these lengths: with elbows outwards there is no place above the motors that both legs reach")
    best = max(inside, key=lambda one: (round(min(one.kappa, one.serial), 3), -abs(one.x)))
    return best.x, best.y


def default_name(path: Path) -> str:
    """Return the name of the robot of a file."""
    return path.stem


def _answer(questions: tuple[Question, ...], answers: dict[str, float], ask: Ask, refuse: Refuse) -> None:
    for question in questions:
        while question.key not in answers:
            try:
                text = ask(f"{question.words} [{question.default(answers):.10g}]: ")
            except EOFError:
                raise InputError(
                    f"{question.words}: no answer: expected one, or an empty line for the usual one"
                ) from None
            try:
                answers[question.key] = question.read(text, answers)
            except InputError as error:
                refuse(f"{question.words}: {error}")


def _robot(answers: Answers) -> FiveBar:
    """Return the geometry of the robot; its masses play no part in that."""
    content = {
        "name": "new",
        "lengths_m": {one.key: 1e-3 * answers[one.key] for one in LENGTHS},
        "inertias_kg_m2": {"zz_11R": 1.0, "zz_21R": 1.0},
        "mass_kg": {"m": 1.0},
        "friction": dict.fromkeys(("f_s11", "f_s21", "f_off11", "f_off21"), 0.0) | {"width_rad_s": LEAST_WIDTH},
    }
    return RobotFile.model_validate(content).five_bar()


def _inertia(answers: Answers, leg: int) -> float:
    length = 1e-3 * answers[f"l_{leg}1"]
    rotor = answers["rotor"] * answers["gear"] ** 2
    return rotor + (answers["proximal_mass"] / 3.0 + 0.5 * answers["distal_mass"]) * length**2


def _transmission(answers: Answers) -> list[str]:
    if answers["frequency"] == 0.0 and answers["backlash"] == 0.0:
        return ["# rigid as far as is known; `fivebar identify --resonance` finds its frequency"]
    rotor = answers["rotor"] * answers["gear"] ** 2
    share = min(0.98, max(0.02, rotor / _inertia(answers, 1)))
    return [
        "# lowest frequency (Hz), 0 for rigid; backlash (rad); share of the rotor in the inertia",
        f"transmission: {{frequency: {answers['frequency']:.6g}, backlash: {1e-3 * answers['backlash']:.6g},"
        f" rotor_share: {share:.3g}}}",
    ]


def _sensors(answers: Answers) -> list[str]:
    lines = []
    if answers["imu_rate"] > 0.0:
        lines += [
            "# gyroscope on the distal link of leg 2: noise of a reading (rad/s), readings per second, s late",
            f"imu: {{gyro_noise: {answers['imu_noise']:.6g}, rate_hz: {answers['imu_rate']:.0f}, latency: 0.004}}",
        ]
    if answers["passive_counts"] > 0.0:
        lines += [
            "# encoder on the passive joint of leg 2",
            f"passive_encoder: {{leg: 2, counts: {answers['passive_counts']:.0f}}}",
        ]
    return lines


def _metres(millimetres: float) -> str:
    return f"{1e-3 * millimetres:.6g}"


def _one_line(text: str) -> str:
    return "".join(letter if letter.isprintable() else "?" for letter in text)
