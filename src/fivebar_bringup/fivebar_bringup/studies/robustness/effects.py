"""The effects of the simulated robot, one line each: their sizes from small to large, and what robots have of them.

Every effect is raised alone, on a robot that is otherwise exact. Where an effect gets worse as its number falls, like
the frequency of a transmission, the sizes fall.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from fivebar_description.imu import ImuSettings
from fivebar_description.tolerances import Tolerances
from fivebar_description.transmission import Transmission
from fivebar_sim.effects.cable import Cable
from fivebar_sim.effects.encoders import EncoderErrors
from fivebar_sim.effects.friction import FrictionEffects
from fivebar_sim.effects.heating import Heating
from fivebar_sim.effects.links import LinkErrors
from fivebar_sim.effects.loads import LOCUS, Push, Tilt, Vibration
from fivebar_sim.effects.motors import MotorEffects
from fivebar_sim.effects.platform_joint import PlatformJoint
from fivebar_sim.effects.settings import PlantSettings
from fivebar_sim.effects.supply import Supply
from fivebar_sim.effects.timing import BusEffects, Timing

STEPS = 12
"""Sizes of an effect."""

PUSH_LENGTH = 0.05
"""s. The push is centred on the crossing."""

LOSSES = 0.2
"""s, centred on the crossing, in which commands are lost."""

STIFF_GEAR = Transmission(frequency=250.0)
"""The transmission that backlash needs: flanks that touch have a stiffness."""

STIFF_JOINT = PlatformJoint(stiffness=1e6)
"""The loop that clearance needs."""

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

MILLI, MICRO, DEGREE = 1e-3, 1e-6, math.pi / 180.0

FOUR = ((1, -1, 1, -1), (-1, 1, -1, 1), (1, -1, -1, 1), (-1, 1, 1, -1))
"""Signs of the lengths of the proximal and distal link of leg 1 and 2 in each draw."""

TWO = ((1, -1), (-1, 1), (1, 1), (-1, -1))
"""Signs of what both motors have in each draw."""

DRAWS = len(FOUR)


class FaultyRobot(NamedTuple):
    """The changes that an effect makes.

    Attributes:
        plant, imu: the simulated robot.
        tolerances: what is declared of it where the estimator has tolerances.
    """

    plant: PlantSettings
    imu: ImuSettings
    tolerances: Tolerances


class Condition(NamedTuple):
    """The conditions of a draw of an effect: its number, of `DRAWS`, and the time of the crossing (s)."""

    draw: int
    crossing: float

    @property
    def sign(self) -> int:
        """Alternately +1 and -1."""
        return 1 - 2 * (self.draw % 2)

    @property
    def heading(self) -> float:
        """A quarter of a turn (rad) further with each draw."""
        return 0.5 * math.pi * self.draw

    def begin(self, length: float) -> float:
        """Return when a time (s) begins that is centred on the crossing."""
        return max(0.0, self.crossing - 0.5 * length)


Change = Callable[[FaultyRobot, float, Condition], FaultyRobot]


class Effect(NamedTuple):
    """An effect.

    Attributes:
        name: as in `--effects`.
        words: what it is.
        unit: in which sizes are shown, "" for numbers.
        scale: a unit in SI units.
        sizes: from the smallest effect to the largest, in `unit`.
        good, middling: what a good and a middling robot have, in `unit`; None: nothing of it.
        change: puts a size in SI units on a robot.
        needs_gyro: whether only robots with a gyroscope have it.
    """

    name: str
    words: str
    unit: str
    scale: float
    sizes: tuple[float, ...]
    good: float | None
    middling: float | None
    change: Change
    needs_gyro: bool = False

    def on(self, robot: FaultyRobot, size: float, condition: Condition) -> FaultyRobot:
        """Return a robot with the effect at a size in `unit`."""
        return self.change(robot, size * self.scale, condition)

    @property
    def falls(self) -> bool:
        """Whether the effect gets worse as its number falls."""
        return self.sizes[-1] < self.sizes[0]

    def shown(self, size: float | None) -> str:
        """Return a size for a person."""
        return "0" if size is None else f"{size:.3g} {self.unit}".rstrip()


def grid(first: float, last: float, steps: int = STEPS) -> tuple[float, ...]:
    """Return sizes in geometric progression, of two digits."""
    return tuple(float(f"{size:.2g}") for size in np.geomspace(first, last, steps).tolist())


def _scaled(name: str) -> Change:
    def change(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
        scale: dict[str, Any] = {name: 1.0 + at.sign * size}
        return robot._replace(plant=robot.plant._replace(**scale))

    return change


def _lengths(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    links = LinkErrors(*(sign * size for sign in FOUR[at.draw]))
    known = robot.tolerances._replace(length=max(size, robot.tolerances.length))
    return robot._replace(plant=robot.plant._replace(links=links), tolerances=known)


def _bases(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    one, two = TWO[at.draw]
    links = LinkErrors(base_1=one * size, base_2=two * size)
    known = robot.tolerances._replace(base=max(size, robot.tolerances.base))
    return robot._replace(plant=robot.plant._replace(links=links), tolerances=known)


def _encoders(robot: FaultyRobot, errors: EncoderErrors, size: float) -> FaultyRobot:
    known = robot.tolerances._replace(zero=max(size, robot.tolerances.zero))
    return robot._replace(plant=robot.plant._replace(encoders=errors), tolerances=known)


def _zeros(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    one, two = TWO[at.draw]
    return _encoders(robot, EncoderErrors(one * size, two * size), size)


def _eccentricity(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    return _encoders(robot, EncoderErrors(eccentricity=size), size)


def _constants(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    one, two = TWO[at.draw]
    return robot._replace(plant=robot.plant._replace(motors=MotorEffects(one * size, two * size)))


def _motors(name: str) -> Change:
    def change(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
        return robot._replace(plant=robot.plant._replace(motors=MotorEffects()._replace(**{name: size})))

    return change


def _friction(name: str, offset: float = 0.0) -> Change:
    def change(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
        return robot._replace(plant=robot.plant._replace(friction=FrictionEffects()._replace(**{name: offset + size})))

    return change


def _transmission(name: str) -> Change:
    def change(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
        return robot._replace(plant=robot.plant._replace(transmission=STIFF_GEAR._replace(**{name: size})))

    return change


def _joint(name: str) -> Change:
    def change(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
        return robot._replace(plant=robot.plant._replace(platform_joint=STIFF_JOINT._replace(**{name: size})))

    return change


def _tilt(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    return robot._replace(plant=robot.plant._replace(tilt=Tilt(size, at.heading)))


def _push(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    push = Push(size, at.heading, LOCUS, at.begin(PUSH_LENGTH), PUSH_LENGTH)
    return robot._replace(plant=robot.plant._replace(push=push))


def _vibration(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    return robot._replace(plant=robot.plant._replace(vibration=Vibration(size, TABLE, at.heading)))


def _drag(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    return robot._replace(plant=robot.plant._replace(cable=Cable(size, at.heading)))


def _cable(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    x, y = ANCHOR * math.cos(at.heading), MIDDLE_Y + ANCHOR * math.sin(at.heading)
    cable = Cable(stiffness=size, length=SLACK, anchor_x=x, anchor_y=y)
    return robot._replace(plant=robot.plant._replace(cable=cable))


def _heating(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    return robot._replace(plant=robot.plant._replace(heating=Heating(at.sign * size, WARM_UP)))


def _supply(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    return robot._replace(plant=robot.plant._replace(supply=Supply(size)))


def _distal_mass(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    return robot._replace(plant=robot.plant._replace(links=LinkErrors(distal_mass=size)))


def _rise(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    known = robot.tolerances._replace(
        base=max(size, robot.tolerances.base), zero=max(size / AXES_APART, robot.tolerances.zero)
    )
    links = LinkErrors(base_rise=at.sign * size)
    return robot._replace(plant=robot.plant._replace(links=links), tolerances=known)


def _height(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    shorter = size**2 / (8.0 * DISTAL_LINK)
    known = robot.tolerances._replace(length=max(shorter, robot.tolerances.length))
    return robot._replace(plant=robot.plant._replace(links=LinkErrors(base_height=size)), tolerances=known)


def _lost(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    return robot._replace(plant=robot.plant._replace(bus=BusEffects(round(size), at.begin(LOSSES), LOSSES)))


def _late(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    timing = Timing(command_delay=0.5 * size, command_jitter=0.5 * size)
    return robot._replace(plant=robot.plant._replace(timing=timing))


def _old(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    timing = Timing(reading_age=0.5 * size, reading_jitter=0.5 * size)
    return robot._replace(plant=robot.plant._replace(timing=timing))


def _gyro_noise(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    return robot._replace(imu=robot.imu._replace(gyro_noise=size))


def _gyro_bias(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    return robot._replace(imu=robot.imu._replace(gyro_bias=at.sign * size))


def _gyro_bandwidth(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    return robot._replace(imu=robot.imu._replace(gyro_bandwidth_hz=size))


def _gyro_lost(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
    return robot._replace(imu=robot.imu._replace(lost=size))


EFFECTS = {
    effect.name: effect
    for effect in (
        Effect("lengths", "each link's length, alternately ±", "mm", MILLI, grid(0.005, 2.0), 0.02, 0.2, _lengths),
        Effect("bases", "each motor axis along x, ±", "mm", MILLI, grid(0.005, 2.0), 0.02, 0.2, _bases),
        Effect("zeros", "each encoder's zero, ±", "°", DEGREE, grid(0.005, 2.0), 0.01, 0.2, _zeros),
        Effect(
            "eccentricity", "eccentricity of the encoders", "mrad", MILLI, grid(0.05, 20.0), 0.1, 1.0, _eccentricity
        ),
        Effect("mass", "the platform's mass, ±", "%", 0.01, grid(2.0, 80.0), 5.0, 5.0, _scaled("mass_scale")),
        Effect("inertia", "the legs' inertias, ±", "%", 0.01, grid(2.0, 80.0), 5.0, 5.0, _scaled("inertia_scale")),
        Effect("coulomb", "Coulomb friction, ±", "%", 0.01, grid(4.0, 100.0), 15.0, 15.0, _scaled("friction_scale")),
        Effect(
            "breakaway",
            "break-away beyond Coulomb friction",
            "%",
            0.01,
            grid(10.0, 900.0),
            30.0,
            30.0,
            _friction("stribeck", 1.0),
        ),
        Effect(
            "viscous", "viscous friction of the motors", "Nm s", 1.0, grid(0.002, 0.5), 0.01, 0.01, _friction("viscous")
        ),
        Effect(
            "presliding",
            "presliding deflection of the motors",
            "mrad",
            MILLI,
            grid(0.1, 100.0),
            0.1,
            1.0,
            _friction("presliding"),
        ),
        Effect(
            "passive",
            "friction of each passive joint",
            "Nm",
            1.0,
            grid(0.002, 0.5),
            0.003,
            0.01,
            _friction("passive"),
        ),
        Effect(
            "elasticity",
            "frequency of the transmissions",
            "Hz",
            1.0,
            grid(500.0, 20.0),
            250.0,
            60.0,
            _transmission("frequency"),
        ),
        Effect(
            "backlash",
            f"backlash, in transmissions of {STIFF_GEAR.frequency:g} Hz",
            "°",
            DEGREE,
            grid(0.002, 1.0),
            0.005,
            0.03,
            _transmission("backlash"),
        ),
        Effect("loop", "stiffness of the loop", "N/m", 1.0, grid(1e7, 2e4), 1e6, 3e5, _joint("stiffness")),
        Effect(
            "clearance",
            f"clearance of the platform's joint, in a loop of {STIFF_JOINT.stiffness:.0e} N/m",
            "µm",
            MICRO,
            grid(2.0, 1000.0),
            5.0,
            20.0,
            _joint("clearance"),
        ),
        Effect(
            "current",
            "bandwidth of the current loops",
            "Hz",
            1.0,
            grid(2000.0, 10.0),
            1000.0,
            1000.0,
            _motors("current_loop_hz"),
        ),
        Effect("constants", "the motors' torque constants, ±", "%", 0.01, grid(2.0, 80.0), 5.0, 5.0, _constants),
        Effect("ripple", "torque ripple", "%", 0.01, grid(1.0, 100.0), 3.0, 3.0, _motors("ripple")),
        Effect("cogging", "cogging torque", "Nm", 1.0, grid(0.01, 1.0), 0.04, 0.06, _motors("cogging")),
        Effect("tilt", "tilt of the base, four directions", "°", DEGREE, grid(0.2, 60.0), 2.0, 4.0, _tilt),
        Effect("rise", "motor axis 2 off the x axis, ±", "mm", MILLI, grid(0.005, 2.0), 0.02, 0.2, _rise),
        Effect("height", "leg 2 above leg 1, across the plane", "mm", MILLI, grid(0.1, 30.0), 0.2, 1.0, _height),
        Effect(
            "distal_mass",
            "mass of each distal link that the model lacks",
            "g",
            MILLI,
            grid(2.0, 300.0),
            5.0,
            20.0,
            _distal_mass,
        ),
        Effect(
            "heating",
            "friction that changes within the crossing as it heats up, ±",
            "%",
            0.01,
            grid(4.0, 90.0),
            None,
            None,
            _heating,
        ),
        Effect(
            "supply",
            "power at which the supply leaves half of the torque",
            "W",
            1.0,
            grid(500.0, 1.0),
            200.0,
            50.0,
            _supply,
        ),
        Effect(
            "vibration",
            f"table that vibrates at {TABLE:g} Hz, four directions",
            "mm",
            MILLI,
            grid(0.005, 5.0),
            0.01,
            0.05,
            _vibration,
        ),
        Effect("drag", "constant pull of a cable, four directions", "N", 1.0, grid(0.05, 10.0), 0.1, 0.5, _drag),
        Effect(
            "cable",
            f"stiffness of a cable that is stretched by {1e3 * (ANCHOR - SLACK):.0f} mm, four directions",
            "N/m",
            1.0,
            grid(1.0, 500.0),
            5.0,
            20.0,
            _cable,
        ),
        Effect("push", "push of 50 ms on the locus, four directions", "N", 1.0, grid(0.1, 20.0), 1.0, 2.0, _push),
        Effect(
            "lost",
            "lost commands, of the 100 around the crossing",
            "",
            1.0,
            (1, 2, 3, 4, 6, 8, 12, 16, 24, 36, 54, 80),
            2.0,
            3.0,
            _lost,
        ),
        Effect("late", "commands late, by half of it to all of it", "ms", MILLI, grid(0.05, 2.0), 0.1, 0.5, _late),
        Effect("old", "encoders read early, by half of it to all of it", "ms", MILLI, grid(0.05, 2.0), 0.1, 0.5, _old),
        Effect("gyro_noise", "noise of the gyroscope", "rad/s", 1.0, grid(0.003, 3.0), 0.01, 0.01, _gyro_noise, True),
        Effect("gyro_bias", "offset of the gyroscope, ±", "rad/s", 1.0, grid(0.01, 10.0), 0.02, 0.02, _gyro_bias, True),
        Effect(
            "gyro_low_pass",
            "cut-off of the gyroscope's low-pass, 0 for none",
            "Hz",
            1.0,
            grid(160.0, 10.0),
            None,
            None,
            _gyro_bandwidth,
            True,
        ),
        Effect(
            "gyro_lost", "lost readings of the gyroscope", "%", 0.01, grid(2.0, 100.0), None, None, _gyro_lost, True
        ),
    )
}
"""Effects by name. Good and middling robots have what the rigs of that name have, or else what the setting calls
typical."""
