# SPDX-License-Identifier: Apache-2.0
"""Questions for a robot file, with their usual answers and what is allowed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from fivebar_description.errors import InputError
from fivebar_description.shared_settings import LARGEST_COUNTS

Answers = Mapping[str, float]

LARGEST_INERTIA = 1000.0
"""kg m^2, of a leg in a robot file."""


def _no_problem(answers: Answers) -> str | None:
    return None


class Question(NamedTuple):
    """A question whose answer is a number.

    Attributes:
        key: of the answer.
        words: what is asked, with its unit.
        usual: the answer where none is given: a number, or what follows from the answers before.
        at_least, at_most: what is allowed.
        whole: whether it is a whole number.
        problem: returns what is wrong with the answers up to this one, None if nothing.
    """

    key: str
    words: str
    usual: float | Callable[[Answers], float]
    at_least: float
    at_most: float
    whole: bool = False
    problem: Callable[[Answers], str | None] = _no_problem

    def default(self, answers: Answers) -> float:
        """Return the answer where none is given."""
        return float(f"{self.usual(answers):.4g}") if callable(self.usual) else self.usual

    def read(self, text: str, answers: Answers) -> float:
        """Return the answer that a text gives.

        Raises:
            InputError: it is no number, or not allowed.
        """
        value = self._number(text)
        problem = self.problem({**answers, self.key: value})
        if problem is not None:
            raise InputError(f"{text.strip()}: {problem}")
        return value

    def _number(self, text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            raise InputError(f"{text.strip()!r}: expected a number") from None
        if not self.at_least <= value <= self.at_most:
            raise InputError(f"{text.strip()}: expected at least {self.at_least:g}, at most {self.at_most:g}")
        if self.whole and value != round(value):
            raise InputError(f"{text.strip()}: expected a whole number")
        return value


def _counts_of_joint(answers: Answers) -> str | None:
    counts = round(answers["counts"] * answers["gear"])
    if 2 <= counts <= LARGEST_COUNTS:
        return None
    return (
        f"with a gear of {answers['gear']:g} these are {counts} counts in a turn of the joint: expected 2 to"
        f" {LARGEST_COUNTS}"
    )


def inertia_of_leg(answers: Answers, leg: int) -> float:
    """Return the grouped inertia of a leg about its motor axis (kg m^2): rotor, proximal link, half a distal link."""
    length = 1e-3 * answers[f"l_{leg}1"]
    rotor = answers["rotor"] * answers["gear"] ** 2
    return rotor + (answers["proximal_mass"] / 3.0 + 0.5 * answers["distal_mass"]) * length**2


def _inertia_of_joint(answers: Answers) -> str | None:
    inertia = max(inertia_of_leg(answers, leg) for leg in (1, 2))
    if inertia <= LARGEST_INERTIA:
        return None
    return f"with the gear and the links this is {inertia:.4g} kg m^2 at a joint: expected at most {LARGEST_INERTIA:g}"


def _as(key: str) -> Callable[[Answers], float]:
    return lambda answers: answers[key]


LENGTHS = (
    Question("a", "distance between the motor axes (mm)", 118.0, 0.1, 3000.0),
    Question("l_11", "proximal link of leg 1, the left one (mm)", 90.0, 0.1, 3000.0),
    Question("l_12", "distal link of leg 1 (mm)", 90.0, 0.1, 3000.0),
    Question("l_21", "proximal link of leg 2 (mm)", _as("l_11"), 0.1, 3000.0),
    Question("l_22", "distal link of leg 2 (mm)", _as("l_12"), 0.1, 3000.0),
)

OTHERS = (
    Question("platform", "mass at the platform: end effector, pin, payload (kg)", 0.3, 1e-4, 100.0),
    Question("proximal_mass", "mass of a proximal link (kg)", 0.2, 0.0, 100.0),
    Question("distal_mass", "mass of a distal link (kg)", 0.1, 0.0, 100.0),
    Question("gear", "gear: turns of the motor per turn of the joint, 1 for none", 1.0, 0.01, 1000.0),
    Question("rotor", "inertia of a rotor, on the motor's side (kg m^2)", 1e-4, 1e-9, 1.0, problem=_inertia_of_joint),
    Question("torque", "largest torque at the joint, behind the gear (Nm)", 2.0, 1e-3, 500.0),
    Question("speed", "largest speed of the joint (rad/s)", 30.0, 0.01, 1e4),
    Question(
        "counts",
        "counts of a motor's encoder per turn of the motor",
        16384.0,
        2.0,
        LARGEST_COUNTS,
        whole=True,
        problem=_counts_of_joint,
    ),
    Question("rate", "samples per second of the controllers", 500.0, 10.0, 10_000.0, whole=True),
    Question("friction", "Coulomb friction at the joint (Nm)", lambda answers: 0.03 * answers["torque"], 0.0, 400.0),
    Question("frequency", "lowest frequency of the transmissions (Hz), 0 for rigid or unknown", 0.0, 0.0, 2000.0),
    Question("backlash", "backlash at the joint (mrad)", 0.0, 0.0, 100.0),
    Question(
        "imu_rate",
        "gyroscope on the distal link of leg 2: readings per second, 0 for none",
        0.0,
        0.0,
        10_000.0,
        whole=True,
    ),
    Question("imu_noise", "its noise (rad/s), where there is one", 0.01, 0.0, 10.0),
    Question(
        "passive_counts",
        "encoder on the passive joint of leg 2: counts per turn, 0 for none",
        0.0,
        0.0,
        1e9,
        whole=True,
    ),
    Question("known_length", "how exactly each length is known (mm, plus or minus)", 0.3, 0.0, 10.0),
    Question("known_zero", "how exactly the encoders' zeros are known (degrees, plus or minus)", 0.3, 0.0, 57.0),
    Question("tilt", "largest tilt of the base (degrees)", 2.0, 0.0, 89.0),
    Question(
        "push",
        "largest push on the platform, as by a cable (N)",
        lambda answers: 2.0 * (answers["platform"] + answers["distal_mass"]),
        0.0,
        1000.0,
    ),
    Question("passive", "friction of each passive joint (Nm)", 0.003, 0.0, 10.0),
)
