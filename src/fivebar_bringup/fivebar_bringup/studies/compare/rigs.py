"""The rigs that controllers are compared on: how the robot differs from its model, what is measured, which gains."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from fivebar_bringup.scenario import Scenario
from fivebar_control.laws.gains import Gains
from fivebar_sim.effects.settings import PlantSettings

WRONG = {"mass_scale": 1.1, "inertia_scale": 0.9, "friction_scale": 0.8}
ENCODERS = {"encoder_counts": 20_000, "torque_quantum": 0.002, "delay_samples": 1}

ENCODER_GAINS: dict[str, Mapping[str, float]] = {
    "gains": {"kp": 1600.0, "kd": 80.0, "kp_vhc": 1600.0, "kd_vhc": 80.0},
    "unified": {"kp": 2500.0, "kd": 100.0},
}
"""Sections of the scenario for rigs with encoders. The velocity comes from counts and the torque a sample late, so the
gains are lower than with exact sensors; with 900 and 60 the blended controllers' errors are twice as large."""

AS_BELIEVED_LAWS: dict[str, Mapping[str, float]] = {"mpc": {"weight": 1e-5}}
"""Section `law`, by controller, for a robot with exact parameters: there is little to correct, and with this weight on
what departs from the plan `mpc` asks for hardly more torque than `unified`, in place of a third more (docs/mpc.md)."""


class ComparisonRig(NamedTuple):
    """A rig.

    Attributes:
        name: as in `--rigs`.
        words: description for a person.
        plant: section `plant` of its scenarios, without engine, torque limit and seed, which are the given scenario's.
        estimator: section `estimator`.
        gains: sections with gains that replace those of the given scenario key by key.
        laws: the same for section `law`, by controller.
    """

    name: str
    words: str
    plant: Mapping[str, float]
    estimator: str = "none"
    gains: Mapping[str, Mapping[str, float]] = {}
    laws: Mapping[str, Mapping[str, float]] = {}


COMPARED_RIGS = {
    rig.name: rig
    for rig in (
        ComparisonRig("ideal", "exact sensors and exact parameters", {}),
        ComparisonRig("wrong", "exact sensors; mass +10 %, inertia −10 %, friction × 0.8", WRONG),
        ComparisonRig(
            "encoders",
            "only the motors' encoders, 20 000 counts, their rounding is the noise; torque in steps of 2 mNm, one"
            " sample of delay; estimator ekf; exact parameters",
            ENCODERS,
            "ekf",
            ENCODER_GAINS,
            AS_BELIEVED_LAWS,
        ),
        ComparisonRig(
            "realistic",
            "the encoders, torque steps, delay and estimator of the rig encoders with the parameters of the rig wrong",
            {**ENCODERS, **WRONG},
            "ekf",
            ENCODER_GAINS,
        ),
    )
}
"""By name."""

AS_GIVEN = "as_given"
"""The plant, estimator and gains of the scenario itself."""

RIG_NAMES = (*COMPARED_RIGS, AS_GIVEN)


def rig_words(name: str) -> str:
    """Return the description of a rig."""
    return (
        COMPARED_RIGS[name].words if name in COMPARED_RIGS else "plant, estimator and gains as the scenario gives them"
    )


def on_rig(scenario: Scenario, name: str, controller: str) -> dict[str, Any]:
    """Return the content of a scenario with its robot put on a rig, and a controller."""
    content = scenario.model_dump() | {"controller": controller}
    if name == AS_GIVEN:
        return content
    rig = COMPARED_RIGS[name]
    kept = {key: content["plant"][key] for key in ("engine", "torque_limit", "seed")}
    content |= {"plant": {**kept, **rig.plant}, "estimator": rig.estimator}
    for section, gains in rig.gains.items():
        content[section] |= gains
    content["law"] = {**content["law"], **rig.laws.get(controller, {})}
    return content


def can_be_on(scenario: Scenario, name: str) -> bool:
    """Return whether a scenario's motion can be made on a rig: an estimator follows it in one working mode only."""
    return scenario.working_modes is None or name not in COMPARED_RIGS or COMPARED_RIGS[name].estimator == "none"


def default_rigs(scenario: Scenario) -> tuple[str, ...]:
    """Return the rigs for a scenario where none are named: all, and its own plant where that is none of them."""
    possible = tuple(name for name in COMPARED_RIGS if can_be_on(scenario, name))
    for name in possible:
        content = on_rig(scenario, name, scenario.controller)
        if PlantSettings(**content["plant"]) == scenario.plant and content["estimator"] == scenario.estimator:
            return possible
    return (*possible, AS_GIVEN)


def gains_used(scenario: Scenario, name: str) -> tuple[Gains, tuple[float, float]]:
    """Return the gains on a rig: those of the blended controllers and of ctc, and kp (1/s^2), kd (1/s) of unified."""
    content = on_rig(scenario, name, scenario.controller)
    return Gains(**content["gains"]), (content["unified"]["kp"], content["unified"]["kd"])
