# SPDX-License-Identifier: Apache-2.0
"""The effects of the simulated robot, one line each: their sizes from small to large, and what robots have of them.

Every effect is raised alone, on a robot that is otherwise exact. Where an effect gets worse as its number falls, like
the frequency of a transmission, the sizes fall.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from fivebar_bringup.scenario import Scenario
from fivebar_control.estimation.readings import longest_gap
from fivebar_sim.effects.loads import LOCUS
from fivebar_studies.sweep.drawing import RATE_HZ

STEPS = 12
"""Sizes of an effect."""

PUSH_LENGTH = 0.05
"""s. The push is centred on the crossing."""

LOSSES = 0.2
"""s, centred on the crossing, in which commands are lost."""

STIFF_GEAR = 250.0
"""Frequency (Hz) of the transmission that backlash needs: flanks that touch have a stiffness."""

STIFF_LOOP = 1e6
"""Stiffness (N/m) of the loop that clearance needs."""

TABLE = 15.0
"""Frequency (Hz) of a table that vibrates."""

ANCHOR, SLACK = 0.3, 0.25
"""Distance (m) of a cable's anchor from the middle of the crossing, and length from which on the cable is taut."""

MIDDLE_Y = 0.085
"""y (m) of that middle, near the locus."""

AXES_APART, DISTAL_LINK = 0.118, 0.09
"""Distance of the motor axes and length of a distal link (m) of the robot whose tolerances are declared: DexTAR."""

WARM_UP = 0.5
"""J, after which 63 % of the change of friction are reached: within a crossing."""

SCALES = {"mm": 1e-3, "µm": 1e-6, "mrad": 1e-3, "°": math.pi / 180.0, "%": 0.01, "g": 1e-3, "ms": 1e-3, "ms/s": 1e-3}
"""Units that are not SI units, in these."""

LONGEST_BURST = longest_gap(RATE_HZ)
"""Periods for which a torque is held by default at this rate, and after which an estimate without readings is lost."""

BURST = ("lost", "missing")
"""Arrays of a compiled case: samples whose commands do not reach the drives, and samples that the controller misses."""

SOUND_GYROSCOPE: dict[str, Any] = {"imu": {"gyro_bias": 0.0}}
"""The gyroscope of robots that lose commands or samples; all others have an offset."""

FRICTION, GEAR, JOINT = "friction", "transmission", "platform_joint"
"""Sections of the simulated robot."""

FOUR = ((1, -1, 1, -1), (-1, 1, -1, 1), (1, -1, -1, 1), (-1, 1, 1, -1))
"""Signs of the lengths of the proximal and distal link of leg 1 and 2 in each draw."""

TWO = ((1, -1), (-1, 1), (1, 1), (-1, -1))
"""Signs of what both motors have in each draw."""

DRAWS = len(FOUR)

Keys = Mapping[str, Any]


class Condition(NamedTuple):
    """The conditions of an effect in one run.

    Attributes:
        draw: number, from 0.
        time: when what has a begin begins (s).
        motor: 1 or 2, whose encoder is concerned.
        sign: +1 or -1.
    """

    draw: int
    time: float
    motor: int
    sign: int

    @property
    def heading(self) -> float:
        """A quarter of a turn (rad) further with each draw."""
        return 0.5 * math.pi * self.draw


def condition_of(draw: int, time: float) -> Condition:
    """Return the conditions of a draw: signs alternate, and after two draws motors."""
    return Condition(draw, time, 1 + draw // 2 % 2, 1 - 2 * (draw % 2))


Change = Callable[[float, Condition], Keys]


class Effect(NamedTuple):
    """An effect.

    Attributes:
        name: as in `--effects`.
        words: what it is.
        unit: in which sizes are shown, "" for numbers.
        sizes: from the smallest effect to the largest, in `unit`.
        good, middling: what a good and a middling robot have, in `unit`; None: nothing of it.
        change: returns what a size in SI units changes: keys of the section `plant`, and in the sections `imu` and
            `tolerances` those of the scenario's; of `BURST` the first sample, and how many these are.
        needs_gyro: whether only robots with a gyroscope have it.
        before: how long before the crossing it begins (s).
        every: samples from one draw to the next, which begins so much later; 0 where draws differ in signs, directions
            and noise.
        first: number of the first draw.
    """

    name: str
    words: str
    unit: str
    sizes: tuple[float, ...]
    good: float | None
    middling: float | None
    change: Change
    needs_gyro: bool = False
    before: float = 0.0
    every: int = 0
    first: int = 0

    def draws(self, usual: int, duration: float) -> range:
        """Return the draws of a crossing of a duration (s): so many, or as many as begin within it."""
        return range(self.first, math.ceil(round(duration * RATE_HZ) / self.every)) if self.every else range(usual)

    def keys(self, size: float, draw: int, crossing: float) -> Keys:
        """Return what a size in `unit` changes in a draw, on a motion that crosses the locus at a time (s)."""
        if self.every:
            condition = condition_of(0, draw * self.every / RATE_HZ)
        else:
            condition = condition_of(draw, max(0.0, crossing - self.before))
        return self.change(size * self.scale, condition)

    @property
    def scale(self) -> float:
        """The unit in SI units."""
        return SCALES.get(self.unit, 1.0)

    @property
    def falls(self) -> bool:
        """Whether the effect gets worse as its number falls."""
        return self.sizes[-1] < self.sizes[0]

    def shown(self, size: float | None) -> str:
        """Return a size for a person."""
        return "0" if size is None else f"{size:.3g} {self.unit}".rstrip()


def with_keys(scenario: Scenario, keys: Keys) -> Scenario:
    """Return a scenario whose robot has the keys of an effect besides what it has already.

    Tolerances are declared as in the scenario, or as large as they are.
    """
    plant, imu, tolerances = scenario.plant, scenario.imu, scenario.tolerances
    for name, value in keys.items():
        if name == "imu":
            imu = imu._replace(**value)
        elif name == "tolerances":
            larger = {key: max(size, getattr(tolerances, key)) for key, size in value.items()}
            tolerances = tolerances._replace(**larger)
        elif name not in BURST:
            changed: dict[str, Any] = {
                name: getattr(plant, name)._replace(**value) if isinstance(value, Mapping) else value
            }
            plant = plant._replace(**changed)
    return scenario.model_copy(update={"plant": plant, "imu": imu, "tolerances": tolerances})


def grid(first: float, last: float, steps: int = STEPS) -> tuple[float, ...]:
    """Return sizes in geometric progression, of two digits."""
    return tuple(float(f"{size:.2g}") for size in np.geomspace(first, last, steps).tolist())


def _key(section: str, name: str, **others: float) -> Change:
    """Return the change of a key of a section to a size, and of others that it needs."""
    return lambda size, at: {section: {**others, name: size}}


def _signed(section: str, name: str, **others: float) -> Change:
    """Return the change of a key of a section to plus or minus a size, and of others that it needs."""
    return lambda size, at: {section: {**others, name: at.sign * size}}


def _headed(section: str, name: str, **others: float) -> Change:
    """Return the change of a key of a section to a size in the direction of the draw."""
    return lambda size, at: {section: {**others, name: size, "heading": at.heading}}


def _scaled(name: str) -> Change:
    return lambda size, at: {name: 1.0 + at.sign * size}


def _lengths(size: float, at: Condition) -> Keys:
    names = ("l_11", "l_12", "l_21", "l_22")
    links = {name: sign * size for name, sign in zip(names, FOUR[at.draw], strict=True)}
    return {"links": links, "tolerances": {"length": size}}


def _both(section: str, name: str, tolerance: str = "") -> Change:
    """Return the change of a key of both motors to plus or minus a size, as which a tolerance is declared."""

    def change(size: float, at: Condition) -> Keys:
        first, second = TWO[at.draw]
        declared = {"tolerances": {tolerance: size}} if tolerance else {}
        return {section: {f"{name}_1": first * size, f"{name}_2": second * size}, **declared}

    return change


def _cable(size: float, at: Condition) -> Keys:
    x, y = ANCHOR * math.cos(at.heading), MIDDLE_Y + ANCHOR * math.sin(at.heading)
    return {"cable": {"stiffness": size, "length": SLACK, "anchor_x": x, "anchor_y": y}}


def _push(size: float, at: Condition) -> Keys:
    return {"push": {"force": size, "heading": at.heading, "along": LOCUS, "start": at.time, "length": PUSH_LENGTH}}


def _lost(size: float, at: Condition) -> Keys:
    return {"bus": {"lost_commands": round(size), "lost_from": at.time, "lost_within": LOSSES}}


def _lost_commands(size: float, at: Condition) -> Keys:
    return {"lost": (round(at.time * RATE_HZ), round(size)), **SOUND_GYROSCOPE}


def _lost_samples(size: float, at: Condition) -> Keys:
    return {"missing": (round(at.time * RATE_HZ), round(size)), **SOUND_GYROSCOPE}


def _rise(size: float, at: Condition) -> Keys:
    return {"links": {"base_rise": at.sign * size}, "tolerances": {"base": size, "zero": size / AXES_APART}}


def _height(size: float, at: Condition) -> Keys:
    return {"links": {"base_height": size}, "tolerances": {"length": size**2 / (8.0 * DISTAL_LINK)}}


def _eccentricity(size: float, at: Condition) -> Keys:
    return {"encoders": {"eccentricity": size}, "tolerances": {"zero": size}}


def _breakaway(size: float, at: Condition) -> Keys:
    return {FRICTION: {"stribeck": 1.0 + size}}


def _late(name: str, jitter: str) -> Change:
    """Return the change of a time and its jitter to half of a size each."""
    return lambda size, at: {"timing": {name: 0.5 * size, jitter: 0.5 * size}}


def by_name(*effects: Effect) -> dict[str, Effect]:
    """Return effects by name."""
    return {effect.name: effect for effect in effects}


EFFECTS = by_name(
    Effect("lengths", "each link's length, alternately ±", "mm", grid(0.005, 2.0), 0.02, 0.2, _lengths),
    Effect("bases", "each motor axis along x, ±", "mm", grid(0.005, 2.0), 0.02, 0.2, _both("links", "base", "base")),
    Effect("zeros", "each encoder's zero, ±", "°", grid(0.005, 2.0), 0.01, 0.2, _both("encoders", "zero", "zero")),
    Effect("eccentricity", "eccentricity of the encoders", "mrad", grid(0.05, 20.0), 0.1, 1.0, _eccentricity),
    Effect("mass", "the platform's mass, ±", "%", grid(2.0, 80.0), 5.0, 5.0, _scaled("mass_scale")),
    Effect("inertia", "the legs' inertias, ±", "%", grid(2.0, 80.0), 5.0, 5.0, _scaled("inertia_scale")),
    Effect("coulomb", "Coulomb friction, ±", "%", grid(4.0, 100.0), 15.0, 15.0, _scaled("friction_scale")),
    Effect("breakaway", "break-away beyond Coulomb friction", "%", grid(10.0, 900.0), 30.0, 30.0, _breakaway),
    Effect(
        "viscous", "viscous friction of the motors", "Nm s", grid(0.002, 0.5), 0.01, 0.01, _key(FRICTION, "viscous")
    ),
    Effect(
        "presliding",
        "presliding deflection of the motors",
        "mrad",
        grid(0.1, 100.0),
        0.1,
        1.0,
        _key(FRICTION, "presliding"),
    ),
    Effect("passive", "friction of each passive joint", "Nm", grid(0.002, 0.5), 0.003, 0.01, _key(FRICTION, "passive")),
    Effect(
        "elasticity", "frequency of the transmissions", "Hz", grid(500.0, 20.0), 250.0, 60.0, _key(GEAR, "frequency")
    ),
    Effect(
        "backlash",
        f"backlash, in transmissions of {STIFF_GEAR:g} Hz",
        "°",
        grid(0.002, 1.0),
        0.005,
        0.03,
        _key(GEAR, "backlash", frequency=STIFF_GEAR),
    ),
    Effect("loop", "stiffness of the loop", "N/m", grid(1e7, 2e4), 1e6, 3e5, _key(JOINT, "stiffness")),
    Effect(
        "clearance",
        f"clearance of the platform's joint, in a loop of {STIFF_LOOP:.0e} N/m",
        "µm",
        grid(2.0, 1000.0),
        5.0,
        20.0,
        _key(JOINT, "clearance", stiffness=STIFF_LOOP),
    ),
    Effect(
        "current",
        "bandwidth of the current loops",
        "Hz",
        grid(2000.0, 10.0),
        1000.0,
        1000.0,
        _key("motors", "current_loop_hz"),
    ),
    Effect("constants", "the motors' torque constants, ±", "%", grid(2.0, 80.0), 5.0, 5.0, _both("motors", "constant")),
    Effect("ripple", "torque ripple", "%", grid(1.0, 100.0), 3.0, 3.0, _key("motors", "ripple")),
    Effect("cogging", "cogging torque", "Nm", grid(0.01, 1.0), 0.04, 0.06, _key("motors", "cogging")),
    Effect("tilt", "tilt of the base, four directions", "°", grid(0.2, 60.0), 2.0, 4.0, _headed("tilt", "angle")),
    Effect("rise", "motor axis 2 off the x axis, ±", "mm", grid(0.005, 2.0), 0.02, 0.2, _rise),
    Effect("height", "leg 2 above leg 1, across the plane", "mm", grid(0.1, 30.0), 0.2, 1.0, _height),
    Effect(
        "distal_mass",
        "mass of each distal link that the model lacks",
        "g",
        grid(2.0, 300.0),
        5.0,
        20.0,
        _key("links", "distal_mass"),
    ),
    Effect(
        "heating",
        "friction that changes within the crossing as it heats up, ±",
        "%",
        grid(4.0, 90.0),
        None,
        None,
        _signed("heating", "change", work=WARM_UP),
    ),
    Effect(
        "supply",
        "power at which the supply leaves half of the torque",
        "W",
        grid(500.0, 1.0),
        200.0,
        50.0,
        _key("supply", "half_power"),
    ),
    Effect(
        "vibration",
        f"table that vibrates at {TABLE:g} Hz, four directions",
        "mm",
        grid(0.005, 5.0),
        0.01,
        0.05,
        _headed("vibration", "amplitude", frequency=TABLE),
    ),
    Effect(
        "drag", "constant pull of a cable, four directions", "N", grid(0.05, 10.0), 0.1, 0.5, _headed("cable", "force")
    ),
    Effect(
        "cable",
        f"stiffness of a cable that is stretched by {1e3 * (ANCHOR - SLACK):.0f} mm, four directions",
        "N/m",
        grid(1.0, 500.0),
        5.0,
        20.0,
        _cable,
    ),
    Effect(
        "push",
        "push of 50 ms on the locus, four directions",
        "N",
        grid(0.1, 20.0),
        1.0,
        2.0,
        _push,
        before=0.5 * PUSH_LENGTH,
    ),
    Effect(
        "lost",
        "lost commands, of the 100 around the crossing",
        "",
        (1, 2, 3, 4, 6, 8, 12, 16, 24, 36, 54, 80),
        2.0,
        3.0,
        _lost,
        before=0.5 * LOSSES,
    ),
    Effect(
        "late",
        "commands late, by half of it to all of it",
        "ms",
        grid(0.05, 2.0),
        0.1,
        0.5,
        _late("command_delay", "command_jitter"),
    ),
    Effect(
        "old",
        "encoders read early, by half of it to all of it",
        "ms",
        grid(0.05, 2.0),
        0.1,
        0.5,
        _late("reading_age", "reading_jitter"),
    ),
    Effect(
        "gyro_noise", "noise of the gyroscope", "rad/s", grid(0.003, 3.0), 0.01, 0.01, _key("imu", "gyro_noise"), True
    ),
    Effect(
        "gyro_bias",
        "offset of the gyroscope, ±",
        "rad/s",
        grid(0.01, 10.0),
        0.02,
        0.02,
        _signed("imu", "gyro_bias"),
        True,
    ),
    Effect(
        "gyro_low_pass",
        "cut-off of the gyroscope's low-pass, 0 for none",
        "Hz",
        grid(160.0, 10.0),
        None,
        None,
        _key("imu", "gyro_bandwidth_hz"),
        True,
    ),
    Effect("gyro_lost", "lost readings of the gyroscope", "%", grid(2.0, 100.0), None, None, _key("imu", "lost"), True),
)
"""Effects by name. Good and middling robots have what the rigs of that name have, or else what the setting calls
typical."""

BURSTS = by_name(
    Effect(
        "commands",
        "commands lost one after the other, from any moment on",
        "",
        (1, 5, LONGEST_BURST, 15),
        None,
        None,
        _lost_commands,
        every=2,
    ),
    Effect(
        "samples",
        "samples lost one after the other, from any moment on",
        "",
        (1, 5, LONGEST_BURST - 1),
        None,
        None,
        _lost_samples,
        every=2,
        first=1,
    ),
)
"""Bursts by name, of samples never the first one, without which there is no run. The readings after the last burst of
samples are the limit after those before: with one more missing the estimator gives up."""
