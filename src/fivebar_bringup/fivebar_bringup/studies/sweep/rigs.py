"""The rigs of a sweep: from which robots it draws, what they have and what they leave out.

Every error is uniform between minus and plus its bound, or between 0 and its bound, and independent of the others.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from fivebar_control.laws.law import MOST_AHEAD
from fivebar_control.laws.lqr import LqrSettings
from fivebar_control.laws.mpc import MpcSettings
from fivebar_control.laws.registry import CONTROLLERS
from fivebar_control.laws.unified import UnifiedSettings
from fivebar_sim.effects.loads import LOCUS
from fivebar_sim.effects.timing import Timing

ENCODER_COUNTS, DELAY_SAMPLES = 20_000, 1
PUSH_LENGTH = 0.05
"""s. The push begins in this time before the first crossing, so that the robot meets it on the locus."""

LOSSES = 0.2
"""s, around the first crossing, in which commands are lost."""

DEGREE = math.pi / 180.0

TOLERANCES = (
    "lengths and bases ±{:g} mm, encoder zeros ±{:g}°, friction of each passive joint {:g} Nm, base tilted by up to"
    " {:g}°, a push of up to {:g} N for 50 ms on the locus, {} lost commands around it"
)
DRIVES = (
    "mass and inertia ±{:g} %, Coulomb friction ±{:g} %, break-away 1.3 times Coulomb, viscous friction {:g} Nm s/rad,"
    " torque constants ±{:g} %, ripple 3 %, cogging {}, current loop of {:g} Hz, commands late and encoders read"
    " early by {:g} to {:g} ms"
)
ELASTICITY = (
    "transmissions of {:g} Hz (rotor share 0.5 to 0.85, damping ratio 0.04) with {:g}° of backlash, a loop of {:g} N/m"
    " with {:g} µm of clearance"
)


DEXTAR, MOTKIN = "dextar", "motkin"
"""Robots of the rigs."""

GYRO = {"gyro_noise": 0.01, "rate_hz": 250, "latency": 0.004}
"""Section `imu` of robots with a gyroscope on the distal link of leg 2."""

GYRO_BIAS = 0.02
"""Bound of the gyroscope's bias (rad/s)."""

SLOW_GYRO = {**GYRO, "rate_hz": 100, "gyro_bandwidth_hz": 80.0}
"""The same of a part for ten euros, whose low-pass takes out most of what rattles between two readings."""

GYRO_WORDS = "gyroscope on the distal link of leg 2 (250 readings/s, 4 ms late, 0.01 rad/s noise, ±0.02 rad/s bias)"


LOAD_RISK = 0.25
"""Probability with which the declared loads, drawn as a rig's robots have them, may displace the platform by more than
the tolerance. The planner aims at less, so few of the crossings that it makes come near: on `calibrated` 61 of 2585 are
accepted with this that 0.05 refuses, of which 60 are a success."""

SOFT_LOAD_RISK = 0.1
"""The same for robots whose transmissions, loops and lengths leave less room: with 0.15 only 95.1 % of what is accepted
of `middling` succeeds, with this 96.0 %."""


class RobotDistribution(NamedTuple):
    """The distribution of a rig's robots.

    Attributes:
        scale, friction: bounds of mass and inertia, and of Coulomb friction, relative to the model.
        length: bound of each link's and base's error (m).
        zero: bound of each encoder's zero (rad).
        passive: friction of each passive joint (Nm).
        tilt, force: largest tilt (rad) and push (N).
        lost: lost commands.
        constant: bound of the torque constants' errors.
        cogging, rated: cogging, and the torque (Nm) that it is a percentage of, 0 for cogging in Nm.
        viscous: friction of each motor (Nm s/rad).
        current_loop: bandwidth of the motors' currents (Hz).
        frequency, backlash, stiffness, clearance: of transmissions and loop (Hz, rad, N/m, m), 0 for rigid ones.
        worn: whether motors and friction are real: Stribeck curve, viscous friction, ripple, current loop.
        late: by how much commands are late and readings old at most (s); half of it always, half at random.
    """

    scale: float = 0.0
    friction: float = 0.0
    length: float = 0.0
    zero: float = 0.0
    passive: float = 0.0
    tilt: float = 0.0
    force: float = 0.0
    lost: int = 0
    constant: float = 0.0
    cogging: float = 0.0
    rated: float = 2.0
    viscous: float = 0.01
    current_loop: float = 1000.0
    frequency: float = 0.0
    backlash: float = 0.0
    stiffness: float = 0.0
    clearance: float = 0.0
    worn: bool = False
    late: float = 0.0

    def words(self) -> str:
        """Return the distribution in words."""
        parts = [
            TOLERANCES.format(
                1e3 * self.length, self.zero / DEGREE, self.passive, self.tilt / DEGREE, self.force, self.lost
            )
        ]
        if self.frequency > 0.0:
            numbers = self.frequency, self.backlash / DEGREE, self.stiffness, 1e6 * self.clearance
            parts.append(ELASTICITY.format(*numbers))
        share = 100.0 * self.cogging / self.rated if self.rated > 0.0 else 0.0
        drives = DRIVES.format(
            100.0 * self.scale,
            100.0 * self.friction,
            self.viscous,
            100.0 * self.constant,
            f"{share:g} % of {self.rated:g} Nm" if self.rated > 0.0 else f"{1e3 * self.cogging:g} mNm",
            self.current_loop,
            500.0 * self.late,
            1e3 * self.late,
        )
        return "; ".join([*parts, drives])


LOOKING_AHEAD = "mpc", "lqr"
"""Controllers whose own weights belong to a cost over time: the screen counts on the gains of `unified`, which stands
in for them."""

SHARED_GAINS = "kp", "kd", "weight"
"""Of `unified`: what the rig's robots bear, whichever law they are for."""

REQUIRED = 0.999
"""Share of the feasible crossings that the counted controller has to complete, unless a rig says otherwise."""


class SweepRig(NamedTuple):
    """A rig.

    Attributes:
        name: as in `--rig`.
        words: what its robots have.
        leaves_out: what they do not have, though robots do.
        spread: of its robots.
        sensed: whether the controllers have only the motors' encoders, with an estimator; else all joints exactly.
        sections: sections of the scenario that replace others key by key.
        blended: the same for the blended controllers, in addition.
        tracking_limit: distance (m) of the estimated platform from its reference beyond which a run is stopped with
            `tracking_lost`; None for that of every scenario.
        robot: whose robots they are, by the name of their file.
        plant: keys of the section `plant` that all of its robots have, in place of drawn ones.
        required: share of the feasible crossings that the counted controller has to complete.
        laws: settings of `mpc` and `lqr`, beside the gains that these share with `unified`.
    """

    name: str
    words: str
    leaves_out: str
    spread: RobotDistribution
    sensed: bool = True
    sections: Mapping[str, Mapping[str, Any]] = {}
    blended: Mapping[str, Mapping[str, Any]] = {}
    tracking_limit: float | None = None
    robot: str = DEXTAR
    plant: Mapping[str, Any] = {}
    required: float = REQUIRED
    laws: Mapping[str, Mapping[str, Any]] = {}


def required_share(rig: str) -> float:
    """Return the share of the feasible crossings that the counted controller has to complete; "" stands for no rig."""
    return RIGS[rig].required if rig else REQUIRED


def sections_for(rig: SweepRig, controller: str) -> dict[str, dict[str, Any]]:
    """Return the sections that a rig's robots have with a controller of this package."""
    found = {name: dict(keys) for name, keys in rig.sections.items()}
    if CONTROLLERS[controller].blended:
        for name, keys in rig.blended.items():
            found[name] = found.get(name, {}) | dict(keys)
    if controller in LOOKING_AHEAD:
        given = found.get("unified", {})
        stand_in = {f"fallback_{name}": given[name] for name in SHARED_GAINS if name in given}
        found["law"] = {**stand_in, **rig.laws.get(controller, {})}
    return found


def gains(kp: float, kd: float) -> dict[str, float]:
    """Return the section `unified` of a rig of DexTAR (1/s^2, 1/s)."""
    return {"kp": kp, "kd": kd, "weight": 0.3}


def softened(law: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """Return settings of `lqr` and `mpc`, by name, that answer an error about as softly as a section `unified` does.

    With a cost |e|^2 + T_v^2 |e'|^2 + r |u|^2 and an acceleration g u, the gain on the error is g / sqrt(r), so that r
    goes with 1 / kp^2, and T_v with 1 / sqrt(kp). `mpc`, which then answers over a longer time, looks as far ahead as
    it can.
    """
    slower = math.sqrt(UnifiedSettings().kp / law["kp"])
    lqr, mpc = LqrSettings(), MpcSettings()
    return {
        "lqr": {"weight": slower**4 * lqr.weight, "speed_time": slower * lqr.speed_time},
        "mpc": {
            "weight": slower**4 * mpc.weight,
            "step_weight": slower**4 * mpc.step_weight,
            "speed_time": slower * mpc.speed_time,
            "horizon": MOST_AHEAD,
        },
    }


def with_gyro(
    spread: RobotDistribution,
    ekf: Mapping[str, float],
    law: Mapping[str, float],
    imu: Mapping[str, float] = GYRO,
    load_risk: float = LOAD_RISK,
) -> dict[str, Mapping[str, Any]]:
    """Return the sections of robots of a spread with a gyroscope.

    Args:
        spread: its bounds of lengths, bases and zeros are the estimator's tolerances.
        ekf: settings of the estimator.
        law: section `unified`.
        imu: section `imu`.
        load_risk: see `LOAD_RISK`.
    """
    tolerances = {"length": spread.length, "base": spread.length, "zero": spread.zero}
    loads = {
        "tilt": spread.tilt,
        "push": spread.force,
        "push_length": PUSH_LENGTH,
        "passive": spread.passive,
    }
    return {
        "imu": imu,
        "ekf": {"gyro": True, **ekf},
        "tolerances": tolerances,
        "loads": loads,
        "risk": {"load": load_risk},
        "unified": law,
    }


ENCODERS_WORDS = (
    f"only the motors' encoders with {ENCODER_COUNTS} counts, estimator ekf, torque in steps of 2 mNm, a sample of"
    " delay"
)
CALIBRATED = RobotDistribution(
    scale=0.05,
    friction=0.15,
    length=2e-5,
    zero=0.01 * DEGREE,
    passive=0.003,
    tilt=2.0 * DEGREE,
    force=1.0,
    lost=2,
    constant=0.05,
    cogging=0.04,
    worn=True,
    late=1e-4,
)
GOOD = CALIBRATED._replace(frequency=250.0, backlash=0.005 * DEGREE, stiffness=1e6, clearance=5e-6)
MIDDLING = CALIBRATED._replace(
    length=2e-4,
    zero=0.2 * DEGREE,
    passive=0.01,
    tilt=4.0 * DEGREE,
    force=2.0,
    lost=3,
    cogging=0.06,
    frequency=60.0,
    backlash=0.03 * DEGREE,
    stiffness=3e5,
    clearance=2e-5,
    late=5e-4,
)
POOR = MIDDLING._replace(
    length=3e-4, zero=0.3 * DEGREE, frequency=40.0, backlash=0.1 * DEGREE, stiffness=1e5, clearance=2e-5
)
FOR_POOR = gains(400.0, 40.0)
"""Of `unified`, for transmissions of 40 Hz."""

FORCE = {"force_deviation": 1.0, "force_time": 0.4}
"""Of the estimator: tilt, pushes and passive friction, which act along t_s, where the motors do not."""

FOR_CALIBRATED = {"disturbance_rate": 0.1, **FORCE}
FOR_ELASTIC = {
    "disturbance_rate": 0.3,
    "play": 1e-3,
    "acceleration_noise": 0.1,
    "gyro_noise": 0.1,
    "misfit_limit": 200.0,
    **FORCE,
}
"""Settings of the estimator, which has no model of elastic transmissions: motor and link differ by some 0.5 mrad, and
by 0.2 rad/s where they swing at 60 Hz."""

FOR_GOOD = {**FOR_ELASTIC, "acceleration_noise": 0.05}
"""The same for transmissions of 250 Hz, which swing less."""

FOR_MIDDLING = {**FOR_ELASTIC, "play": 2.5e-3, "force_deviation": 2.0}
"""The same for 60 Hz, a backlash of 0.03 degrees and pushes of up to 2 N."""

NO_OBSERVER = {"observer_rate": 0.0}
"""Of `unified`, for transmissions that bend: torque bends them, the estimate follows, and what the law's own observer
makes of that is torque again. The estimator has disturbances of its own."""

FOR_BLENDED = {"ekf": {"disturbance_rate": 1.0}}
"""The blended controllers have no observer of their own and compensate what the estimator finds. At 0.1 Nm per root s
that comes too late for a load or a wrong torque constant: they bear less than from encoders alone."""

TRACKING_LIMIT = 4e-3
"""Of the rigs with a gyroscope, whose estimate reports a robot that leaves 5 mm: what makes it leave is mostly a load
along the direction in which no motor acts on the locus, and not an error of the estimate."""

PRINTED = RobotDistribution(
    scale=0.05,
    friction=0.15,
    length=3e-4,
    zero=0.2 * DEGREE,
    passive=2e-4,
    tilt=2.0 * DEGREE,
    force=0.02,
    lost=2,
    constant=0.05,
    cogging=0.002,
    rated=0.0,
    viscous=1e-4,
    current_loop=300.0,
    frequency=150.0,
    backlash=0.02 * DEGREE,
    stiffness=1e5,
    clearance=1e-5,
    worn=True,
    late=5e-4,
)
"""The MOTKIN bench as printed. Play of the elbows and bending of the links are those of a transmission here."""

PRINTED_CALIBRATED = PRINTED._replace(length=5e-5, zero=0.03 * DEGREE)

FOR_PRINTED = {
    "disturbance_rate": 0.03,
    "play": 2.5e-3,
    "acceleration_noise": 0.1,
    "gyro_noise": 0.07,
    "misfit_limit": 200.0,
    "force_deviation": 0.02,
    "force_time": 0.4,
}
"""`FOR_ELASTIC` with torques in proportion to those of the bench's crossing and forces to the mass of its platform. The
transmissions bend by 1 mrad under 0.03 Nm."""

PRINTED_LAW = {"kp": 6400.0, "kd": 160.0, "weight": 250.0, **NO_OBSERVER}
"""Of `unified`: a third of the robot's own weight, and no observer beside that of the estimator."""


def for_bench(spread: RobotDistribution) -> dict[str, Mapping[str, Any]]:
    """Return the sections of the bench's robots of a spread with a gyroscope."""
    return with_gyro(spread, FOR_PRINTED, PRINTED_LAW, SLOW_GYRO)


RIGID = "elasticity, backlash and clearance"
NOT_HERE = "eccentric encoders, the distal links' own inertia, presliding, heat and wear"
NOT_PRINTED = (
    "eccentric encoders, presliding, heat and wear, links that bend out of the plane, a pull of the IMU's cable"
)

BENCH_WORDS = "the MOTKIN bench with 16 384 counts, estimator ekf, a sample of delay"
SLOW_GYRO_WORDS = GYRO_WORDS.replace("250 readings/s", "100 readings/s through a low-pass of 80 Hz")

RIGS = {
    rig.name: rig
    for rig in (
        SweepRig(
            "ideal",
            "exact sensors on all four joints, exact parameters, no delay",
            "every fault that robots have: a check of the laws, no promise for a robot",
            RobotDistribution(),
            sensed=False,
        ),
        SweepRig(
            "encoders",
            f"{ENCODERS_WORDS}; mass, inertia and friction ±15 %",
            "wrong lengths and encoder zeros, above all, of which 0.02 mm decide whether an estimator from encoders"
            f" alone is lost; passive friction, tilt, pushes, lost commands, {RIGID}, {NOT_HERE}",
            RobotDistribution(scale=0.15, friction=0.15),
        ),
        SweepRig(
            "calibrated",
            f"{GYRO_WORDS} and {ENCODERS_WORDS}; {CALIBRATED.words()}",
            f"{RIGID}, {NOT_HERE}",
            CALIBRATED,
            sections=with_gyro(CALIBRATED, FOR_CALIBRATED, gains(4900.0, 140.0)),
            blended=FOR_BLENDED,
            tracking_limit=TRACKING_LIMIT,
        ),
        SweepRig(
            "good",
            f"{GYRO_WORDS} and {ENCODERS_WORDS}; {GOOD.words()}",
            NOT_HERE,
            GOOD,
            sections=with_gyro(GOOD, FOR_GOOD, gains(3600.0, 100.0) | NO_OBSERVER),
            blended=FOR_BLENDED,
            tracking_limit=TRACKING_LIMIT,
            required=0.99,
        ),
        SweepRig(
            "middling",
            f"{GYRO_WORDS} and {ENCODERS_WORDS}; {MIDDLING.words()}",
            NOT_HERE,
            MIDDLING,
            sections=with_gyro(MIDDLING, FOR_MIDDLING, gains(4900.0, 140.0), load_risk=SOFT_LOAD_RISK),
            blended=FOR_BLENDED,
            tracking_limit=TRACKING_LIMIT,
            required=0.95,
        ),
        SweepRig(
            "poor",
            f"{GYRO_WORDS} and {ENCODERS_WORDS}; {POOR.words()}",
            NOT_HERE,
            POOR,
            sections=with_gyro(POOR, FOR_ELASTIC, FOR_POOR, load_risk=SOFT_LOAD_RISK),
            blended=FOR_BLENDED,
            tracking_limit=TRACKING_LIMIT,
            laws=softened(FOR_POOR),
        ),
        SweepRig(
            "printed",
            f"{SLOW_GYRO_WORDS} and {BENCH_WORDS}; {PRINTED.words()}",
            NOT_PRINTED,
            PRINTED,
            sections=for_bench(PRINTED),
            tracking_limit=TRACKING_LIMIT,
            robot=MOTKIN,
        ),
        SweepRig(
            "printed_calibrated",
            f"{SLOW_GYRO_WORDS} and {BENCH_WORDS}; {PRINTED_CALIBRATED.words()}",
            NOT_PRINTED,
            PRINTED_CALIBRATED,
            sections=for_bench(PRINTED_CALIBRATED),
            tracking_limit=TRACKING_LIMIT,
            robot=MOTKIN,
            required=0.99,
        ),
        SweepRig(
            "printed_encoders",
            f"{BENCH_WORDS}; {PRINTED.words()}",
            f"a gyroscope, {NOT_PRINTED}",
            PRINTED,
            sections={**for_bench(PRINTED), "ekf": FOR_PRINTED},
            tracking_limit=TRACKING_LIMIT,
            robot=MOTKIN,
        ),
    )
}
"""By name, from the best robot to the worst."""


class Scales(NamedTuple):
    """Mass, inertia and friction of a robot, actual over modelled."""

    mass: float
    inertia: float
    friction: float


def drawn_scales(spread: RobotDistribution, random: np.random.Generator) -> Scales:
    """Return the scales of a robot."""
    mass, inertia, friction = random.uniform(-1.0, 1.0, 3).tolist()
    return Scales(1.0 + spread.scale * mass, 1.0 + spread.scale * inertia, 1.0 + spread.friction * friction)


def drawn_effects(spread: RobotDistribution, random: np.random.Generator, crossing: float) -> dict[str, Any]:
    """Return the sections of effects of a robot in `plant`, and its seed, for a first crossing at a time (s).

    Equal random numbers make the same robot of any rig, with errors in proportion to the rig's bounds.
    """
    lengths, zeros, constants = random.uniform(-1.0, 1.0, 6), random.uniform(-1.0, 1.0, 2), random.uniform(-1.0, 1.0, 2)
    tilt, force, share, before = random.uniform(0.0, 1.0, 4).tolist()
    tilted, pushed = random.uniform(-math.pi, math.pi, 2).tolist()
    effects: dict[str, Any] = {"seed": int(random.integers(2**31))}
    if spread.length > 0.0:
        names = ("l_11", "l_12", "l_21", "l_22", "base_1", "base_2")
        effects["links"] = dict(zip(names, (spread.length * lengths).tolist(), strict=True))
    if spread.zero > 0.0:
        effects["encoders"] = dict(zip(("zero_1", "zero_2"), (spread.zero * zeros).tolist(), strict=True))
    if spread.worn:
        effects["friction"] = {"stribeck": 1.3, "viscous": spread.viscous, "passive": spread.passive}
        constant_1, constant_2 = (spread.constant * constants).tolist()
        effects["motors"] = {
            "constant_1": constant_1,
            "constant_2": constant_2,
            "ripple": 0.03,
            "cogging": spread.cogging,
            "current_loop_hz": spread.current_loop,
        }
    if spread.late > 0.0:
        effects["timing"] = dict.fromkeys(Timing._fields, 0.5 * spread.late)
    if spread.tilt > 0.0:
        effects["tilt"] = {"angle": spread.tilt * tilt, "heading": tilted}
    if spread.force > 0.0:
        effects["push"] = {
            "force": spread.force * force,
            "heading": pushed,
            "along": LOCUS,
            "start": max(0.0, crossing - PUSH_LENGTH * before),
            "length": PUSH_LENGTH,
        }
    if spread.lost > 0:
        begin = max(0.0, crossing - 0.5 * LOSSES)
        effects["bus"] = {"lost_commands": spread.lost, "lost_from": begin, "lost_within": LOSSES}
    if spread.frequency > 0.0:
        effects["transmission"] = {
            "frequency": spread.frequency,
            "damping": 0.04,
            "rotor_share": 0.5 + 0.35 * share,
            "backlash": spread.backlash,
        }
        effects["platform_joint"] = {"stiffness": spread.stiffness, "clearance": spread.clearance}
    return effects


def rig_words(name: str) -> str:
    """Return what a rig contains and what it leaves out."""
    rig = RIGS[name]
    return f"{rig.words}. Left out: {rig.leaves_out}."
