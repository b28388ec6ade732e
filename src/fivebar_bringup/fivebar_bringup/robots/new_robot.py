# SPDX-License-Identifier: Apache-2.0
"""Asks for what a robot file needs, and writes it with comments."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import numpy as np

from fivebar_bringup.map.map import check_that_legs_meet
from fivebar_bringup.motions.start import HOME_MODE
from fivebar_bringup.robots.questions import LENGTHS, OTHERS, Answers, inertia_of_leg
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

LEAST_WIDTH, LARGEST_WIDTH = 0.02, 1e3
"""rad/s, of the smoothing of Coulomb friction."""

TURN = 2.0 * math.pi


BACK = ("<", "back")
"""Answers that go back to the question before."""

WATER = 1e3
"""Density of water (kg/m^3)."""

BACKLASH_FREQUENCY = 300.0
"""Frequency (Hz) that is written for transmissions with backlash of which none is known: that of a stiff gear."""


def new_robot(name: str, ask: Ask, refuse: Refuse, check: Callable[[str], object]) -> str:
    """Ask for a robot until its answers make a file that passes a check, and return the file's text.

    Where all answers together are refused, the questions come again with these answers as the usual ones.

    Args:
        name: of the robot.
        ask: shows a question and returns the answer.
        refuse: shows why an answer is refused, or what follows from it.
        check: raises InputError where the text of a file is no robot that the commands can work with.

    Raises:
        InputError: there were fewer answers than questions.
    """
    typed: dict[str, str] = {}
    while True:
        answers = asked(ask, refuse, typed)
        try:
            text = robot_text(name, answers)
            check(text)
        except InputError as error:
            refuse(f"{error}: change an answer, from the first question on")
            continue
        if answers["frequency"] < frequency_of(answers):
            refuse(f"transmission.frequency: backlash needs one: {BACKLASH_FREQUENCY:g} Hz is assumed")
        return text


def asked(ask: Ask, refuse: Refuse, typed: dict[str, str] | None = None) -> dict[str, float]:
    """Return the answers to all questions; one that is refused is asked again, and lengths that do not meet too.

    Args:
        ask: shows a question and returns the answer; one of `BACK` goes back to the question before.
        refuse: shows why an answer is refused.
        typed: earlier answers by the questions' keys, which an empty answer repeats; it gets the new ones.

    Raises:
        InputError: there were fewer answers than questions.
    """
    typed = {} if typed is None else typed
    answers: dict[str, float] = {}
    questions = (*LENGTHS, *OTHERS)
    place = 0
    while place < len(questions):
        question = questions[place]
        usual = typed.get(question.key, f"{question.default(answers):.10g}")
        try:
            text = ask(f"{question.words} [{usual}]: ").strip()
        except EOFError:
            raise InputError(f"{question.words}: no answer: expected one, or an empty line for the usual one") from None
        if text in BACK:
            place = max(0, place - 1)
            continue
        try:
            answers[question.key] = question.read(text or usual, answers)
        except InputError as error:
            typed.pop(question.key, None)
            refuse(f"{question.words}: {error}")
            continue
        if text:
            typed[question.key] = text
        place += 1
        if place == len(LENGTHS):
            try:
                home_of(_robot(answers))
            except InputError as error:
                refuse(str(error))
                for length in LENGTHS:
                    typed.pop(length.key, None)
                place = 0
    return answers


def robot_text(name: str, answers: Answers) -> str:
    """Return a robot file with comments.

    Raises:
        InputError: the answers make no robot, or it has no place to rest at.
    """
    x, y = home_of(_robot(answers))
    gear, counts = answers["gear"], round(answers["counts"] * answers["gear"])
    inertias = [inertia_of_leg(answers, leg) for leg in (1, 2)]
    # half of what one count in a sample is
    width = min(LARGEST_WIDTH, max(LEAST_WIDTH, 0.5 * TURN / counts * answers["rate"]))
    lengths = ", ".join(f"{length.key}: {_metres(answers[length.key])}" for length in LENGTHS)
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


@lru_cache(maxsize=8)
def home_of(robot: FiveBar) -> tuple[float, float]:
    """Return the best conditioned place (m) with elbows outwards, in millimetres without a rest.

    Raises:
        InputError: the robot has none, or its legs never meet.
    """
    check_that_legs_meet(robot, "these lengths")
    left, right, bottom, top = workspace_bounds(robot)
    grid = [(x, y) for x in np.linspace(left, right, PLACES) for y in np.linspace(max(0.0, bottom), top, PLACES)]
    points = [(round(float(x), 3) + 0.0, round(float(y), 3) + 0.0) for x, y in grid]
    places = [place_at(robot, HOME_MODE, *point) for point in points]
    inside = [place for place in places if min(place.kappa, place.serial) > 0.0]
    if not inside:
        raise InputError("these lengths: with elbows outwards there is no place above the motors that both legs reach")
    best = max(inside, key=lambda place: (round(min(place.kappa, place.serial), 3), -abs(place.x)))
    return best.x, best.y


def default_name(path: Path) -> str:
    """Return the name of the robot of a file."""
    return path.stem


def _robot(answers: Answers) -> FiveBar:
    """Return the geometry of the robot; its masses, some that go with the lengths, play no part in that.

    Raises:
        InputError: these are no lengths of one robot.
    """
    lengths = {length.key: 1e-3 * answers[length.key] for length in LENGTHS}
    link = sum(lengths[length.key] for length in LENGTHS[1:]) / 4.0
    mass = WATER * link**3
    content = {
        "format": 1,
        "name": "new",
        "lengths_m": lengths,
        "inertias_kg_m2": dict.fromkeys(("zz_11R", "zz_21R"), mass * link**2),
        "mass_kg": {"m": mass},
        "friction": dict.fromkeys(("f_s11", "f_s21", "f_off11", "f_off21"), 0.0) | {"width_rad_s": LEAST_WIDTH},
    }
    return validate(content, RobotFile, "these lengths").five_bar()


def frequency_of(answers: Answers) -> float:
    """Return the frequency (Hz) of the transmissions: the answer, or what backlash needs where none is known."""
    return BACKLASH_FREQUENCY if answers["frequency"] == 0.0 < answers["backlash"] else answers["frequency"]


def _transmission(answers: Answers) -> list[str]:
    frequency = frequency_of(answers)
    if frequency == 0.0:
        return ["# rigid as far as is known; `fivebar identify --resonance` finds its frequency"]
    rotor = answers["rotor"] * answers["gear"] ** 2
    share = min(0.98, max(0.02, rotor / inertia_of_leg(answers, 1)))
    assumed = ", assumed, since backlash needs one" if answers["frequency"] == 0.0 else ""
    return [
        f"# lowest frequency (Hz){assumed}; `fivebar identify --resonance` finds it",
        "# backlash (rad); share of the rotor in the inertia",
        f"transmission: {{frequency: {frequency:.6g}, backlash: {1e-3 * answers['backlash']:.6g},"
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
