# SPDX-License-Identifier: Apache-2.0
"""MuJoCo as the plant: the same robot by other dynamics, which keep energy, converge and lack some effects."""

from __future__ import annotations

import importlib.util
import math
from typing import Any

import numpy as np
import pytest

from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.closed_loop import Vector
from fivebar_description.parameters import FiveBar
from fivebar_description.settings import as_numbers, sections
from fivebar_description.strict_yaml import InputError
from fivebar_description.transmission import Transmission
from fivebar_mujoco import mujoco_motion, mujoco_robot
from fivebar_mujoco.mujoco_model import links_of
from fivebar_mujoco.mujoco_motion import MujocoMotion
from fivebar_sim.effects.cable import Cable
from fivebar_sim.effects.encoders import EncoderErrors
from fivebar_sim.effects.friction import FrictionEffects
from fivebar_sim.effects.gyroscope import GyroscopeFaults
from fivebar_sim.effects.heating import Heating
from fivebar_sim.effects.links import LinkErrors
from fivebar_sim.effects.loads import LOCUS, Push, Tilt, Vibration
from fivebar_sim.effects.motors import MotorEffects
from fivebar_sim.effects.platform_joint import PlatformJoint
from fivebar_sim.effects.settings import MUJOCO, PlantSettings
from fivebar_sim.effects.simulation import EffectsMotion
from fivebar_sim.effects.supply import Supply
from fivebar_sim.effects.timing import BusEffects, Timing
from fivebar_sim.engines import SimulatedMechanism, check_engine, motion_of
from fivebar_sim.plant import Plant, PlantDiverged

RATE = 500
SAMPLES = 100
SPRINGS: dict[str, Any] = {
    "transmission": Transmission(60.0, 0.0, 0.7),
    "platform_joint": PlatformJoint(3e5, 0.0),
    "tilt": Tilt(0.3, -1.0, 0.03),
    "links": LinkErrors(distal_inertia=-7e-5, distal_mass=0.02),
    "cable": Cable(stiffness=20.0, length=0.1),
}


def home(robot: FiveBar) -> tuple[float, ...]:
    return tuple(inverse_geometry(robot, (1, -1), 0.0, 0.13))


def places(motion: SimulatedMechanism, torque: float, samples: int = SAMPLES) -> Vector:
    """The joints after each sample under torques that drive the platform through the locus."""
    found = []
    for _ in range(samples):
        assert math.isfinite(motion.advance((torque, -0.75 * torque)))
        found.append(motion.joints[0])
    return np.array(found)


@pytest.mark.parametrize(
    ("effects", "share"),
    [
        ({"transmission": Transmission(60.0, 0.04, 0.7)}, 1e-3),
        # flanks that bounce: both plants converge with the step alone, not with its square
        ({"transmission": Transmission(250.0, 0.04, 0.7, 2e-3)}, 0.05),
        ({"friction": FrictionEffects(passive=0.05)}, 1e-3),
        ({"platform_joint": PlatformJoint(3e5, 0.05)}, 2e-3),
        ({"tilt": Tilt(0.2, -1.0, 0.03), "links": LinkErrors(distal_inertia=2e-3)}, 1e-6),
        ({"tilt": Tilt(0.2, -1.0, 0.03), "links": LinkErrors(distal_inertia=-5e-4)}, 1e-6),
        ({"tilt": Tilt(0.2, -1.0, 0.03), "links": LinkErrors(distal_mass=0.1, distal_centre=0.3)}, 1e-6),
        ({"links": LinkErrors(base_rise=2e-3, base_height=4e-3)}, 1e-6),
        ({"vibration": Vibration(3e-4, 15.0, 0.5)}, 1e-3),
        ({"cable": Cable(0.5, 1.0, 20.0, 0.05, 0.1, 0.25)}, 1e-4),
        ({"supply": Supply(30.0)}, 1e-3),
    ],
    ids=[
        "transmission",
        "backlash",
        "passive friction",
        "loop",
        "tilt and inertia",
        "tilt and a slender link",
        "tilt and a heavy link",
        "raised base",
        "vibration",
        "cable",
        "supply",
    ],
)
def test_it_moves_the_same_robot_alike(effects: dict[str, Any], share: float, dextar: FiveBar) -> None:
    """Through the locus under constant torque, where nothing corrects what differs, to a share of the effect's size."""
    smooth = FiveBar(dextar.leg1._replace(width=0.5), dextar.leg2._replace(width=0.5), dextar.mass)
    plant = PlantSettings(friction_scale=0.0, **effects)
    found = places(MujocoMotion(smooth, plant, RATE, home(smooth)), 0.6)
    wanted = places(EffectsMotion(smooth, plant, RATE, home(smooth)), 0.6)
    ideal = places(EffectsMotion(smooth, PlantSettings(friction_scale=0.0), RATE, home(smooth)), 0.6)
    assert np.abs(found - wanted).max() < share * np.abs(ideal - wanted).max()


def test_its_friction_heats_up_alike(dextar: FiveBar) -> None:
    smooth = FiveBar(dextar.leg1._replace(width=0.5), dextar.leg2._replace(width=0.5), dextar.mass)
    hot, cold = (
        [
            places(
                kind(
                    smooth, PlantSettings(friction=FrictionEffects(viscous=0.02), heating=heating), RATE, home(smooth)
                ),
                1.2,
            )
            for kind in (MujocoMotion, EffectsMotion)
        ]
        for heating in (Heating(-0.5, 1.0), Heating())
    )
    assert np.abs(hot[0] - hot[1]).max() < 1e-3 * np.abs(hot[1] - cold[1]).max()


def test_it_keeps_the_energy_of_a_robot_with_springs_on_a_slope(dextar: FiveBar) -> None:
    free = FiveBar(dextar.leg1._replace(offset=0.0), dextar.leg2._replace(offset=0.0), dextar.mass)
    motion = MujocoMotion(free, PlantSettings(friction_scale=0.0, **SPRINGS), RATE, home(free))
    begin = motion.energy()
    energies = []
    for _ in range(SAMPLES):
        assert math.isfinite(motion.advance((0.0, 0.0)))
        energies.append(motion.energy() - begin)
    assert np.ptp(motion.joints[1]) > 1.0
    assert np.abs(energies).max() < 1e-9


def test_it_converges_with_the_square_of_the_step(dextar: FiveBar, monkeypatch: pytest.MonkeyPatch) -> None:
    """With friction, which is held over a step at its value in the middle."""
    found = []
    for step in (2e-4, 1e-4, 3e-5):
        monkeypatch.setattr(mujoco_motion, "MAX_STEP", step)
        found.append(places(MujocoMotion(dextar, PlantSettings(**SPRINGS), RATE, home(dextar)), 1.2, 50))
    coarse, fine = (np.abs(one - found[2]).max() for one in found[:2])
    assert fine < 1e-4
    assert fine < 0.35 * coarse


def test_a_slender_link_has_the_mass_matrix_that_the_parameters_say(dextar: FiveBar) -> None:
    """What the equations of this project have, from bodies of positive mass and inertia."""
    leg, tip_mass, extra, moment = dextar.leg1, 0.5 * dextar.mass, -7e-5, 0.03
    proximal, distal = links_of(leg, leg.inertia, tip_mass, extra, moment)
    assert min(*proximal[::2], *distal[::2]) > 0.0
    at_elbow = distal.mass * leg.proximal**2 + proximal.inertia + proximal.mass * proximal.place**2
    assert at_elbow == pytest.approx(leg.inertia + tip_mass * leg.proximal**2, rel=1e-12)
    assert distal.mass * distal.place == pytest.approx(tip_mass * leg.distal, rel=1e-12)
    assert distal.inertia + distal.mass * distal.place**2 == pytest.approx(tip_mass * leg.distal**2 + extra, rel=1e-12)
    weight = proximal.mass * proximal.place + distal.mass * leg.proximal
    assert weight == pytest.approx(moment + tip_mass * leg.proximal, rel=1e-12)
    with pytest.raises(InputError, match=r"plant\.links.distal_inertia: -0.002 kg m.2 leaves a leg without"):
        links_of(leg, leg.inertia, tip_mass, -2e-3, moment)


EVERYTHING = PlantSettings(
    links=LinkErrors(1e-4, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4, 1e-6, 0.01, 0.4, 1e-4, 1e-3),
    friction=FrictionEffects(stribeck=1.3, stribeck_speed=0.2, viscous=0.01, passive=0.003),
    heating=Heating(-0.3, 10.0, 100.0),
    motors=MotorEffects(0.05, 0.05, 0.03, 40.0, 0.04, 80.0, 1000.0),
    supply=Supply(100.0, 4.0),
    transmission=Transmission(250.0, 0.05, 0.6, 1e-4),
    platform_joint=PlatformJoint(3e5, 0.06),
    encoder_counts=20_000,
    encoders=EncoderErrors(1e-4, 1e-4, 1e-3, 1e-5, 2000, 5, -5, 0.1, 1, 0.2, 0.1),
    gyroscope=GyroscopeFaults(0.01, 0.02, 0.1, 0.1, 0.2, 0.01, 0.3, 0.01, 1e-4, 1e-4),
    tilt=Tilt(0.03, 1.0, 0.02),
    vibration=Vibration(1e-5, 12.0, 0.3),
    push=Push(1.0, 0.5, LOCUS, 0.1, 0.06),
    cable=Cable(0.1, 0.2, 5.0, 0.05, 0.1, 0.2),
    bus=BusEffects(2, 0.1, 0.2),
    timing=Timing(1e-4, 1e-4, 1e-4, 1e-4),
)
"""Every effect that MuJoCo's robot has, each number another one than by default."""


def lacking(robot: FiveBar, plant: PlantSettings) -> str:
    """The key by which a plant is refused with MuJoCo, "" where it is not."""
    try:
        check_engine(robot, plant._replace(engine=MUJOCO), RATE)
    except InputError as error:
        return str(error).partition(": ")[0]
    return ""


def test_what_it_lacks_is_refused(dextar: FiveBar) -> None:
    assert not lacking(dextar, EVERYTHING)
    left = {
        f"{section}.{name}"
        for section, kind in sections(PlantSettings).items()
        for name, value in zip(kind._fields, getattr(EVERYTHING, section), strict=True)  # type: ignore[attr-defined]
        if value == getattr(kind(), name)
    }
    assert left == {"friction.presliding", "friction.presliding_damping", "platform_joint.clearance"}
    sticky = EVERYTHING._replace(friction=EVERYTHING.friction._replace(presliding=1e-3, presliding_damping=0.1))
    loose = EVERYTHING._replace(platform_joint=EVERYTHING.platform_joint._replace(clearance=1e-5))
    assert lacking(dextar, sticky) == "plant.friction.presliding"
    assert lacking(dextar, loose) == "plant.platform_joint.clearance"
    with pytest.raises(InputError, match=r"1e-05: MuJoCo's robot does not have this: expected 0\.0, or plant\.engine"):
        Plant(dextar, home(dextar), RATE, loose._replace(engine=MUJOCO))


def test_what_it_lacks_follows_from_what_it_is_made_of(dextar: FiveBar, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a list to be kept: a robot that takes no push is refused one."""
    made_of = mujoco_robot.mujoco_robot
    monkeypatch.setattr(
        mujoco_robot, "mujoco_robot", lambda *robot: made_of(*robot)._replace(push=as_numbers(Push(length=1.0)))
    )
    assert lacking(dextar, EVERYTHING) == "plant.push.force"
    assert not lacking(dextar, EVERYTHING._replace(push=Push()))


def test_without_its_module_it_is_refused(dextar: FiveBar, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"plant\.engine: mujoco is not installed: expected pinocchio, or pip install"):
        motion_of(dextar, PlantSettings(engine=MUJOCO), RATE, home(dextar))


def test_a_loop_that_comes_apart_is_a_fault(dextar: FiveBar) -> None:
    plant = Plant(dextar, home(dextar), RATE, PlantSettings(engine=MUJOCO, torque_limit=None))
    with pytest.raises(PlantDiverged, match="open the loop"):
        for _ in range(SAMPLES):
            plant.advance((1e6, -1e6))


def test_a_held_force_moves_it_as_the_other_plant(dextar: FiveBar) -> None:
    moved = []
    for kind in (MujocoMotion, EffectsMotion):
        motion: SimulatedMechanism = kind(dextar, PlantSettings(friction_scale=0.0), RATE, home(dextar))
        motion.hold(0.3, -2.0)
        moved.append(places(motion, 0.0))
    assert np.abs(moved[1] - home(dextar)).max() > 0.05
    assert np.abs(moved[0] - moved[1]).max() < 1e-6
