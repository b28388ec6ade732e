# SPDX-License-Identifier: Apache-2.0
"""Why a feasible crossing failed: where the error peaked, and which single changes avoid the failure."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import traced_crossing
from fivebar_bringup.simulation.engine_table import columns_of
from fivebar_control.loop.sampled_plan import X, Y, sampled
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.model.singularity import inverse_condition
from fivebar_description.rounding import in_millimetres
from fivebar_description.strict_yaml import InputError, validate
from fivebar_description.transmission import Transmission
from fivebar_sim.effects.encoders import EncoderErrors
from fivebar_sim.effects.links import LinkErrors
from fivebar_sim.effects.loads import Push, Tilt
from fivebar_sim.effects.platform_joint import PlatformJoint
from fivebar_sim.effects.timing import BusEffects
from fivebar_studies.rigs.rig import merged
from fivebar_studies.sweep.drawing import DrawnScenario
from fivebar_studies.sweep.rows import SweepRow
from fivebar_studies.sweep.running import run_and_judge

Content = dict[str, Any]


def _plant(**keys: Any) -> Callable[[Content], Content]:
    """Return the change of keys of the simulated robot; sections in whole have their usual values."""
    return lambda content: {"plant": keys}


def _lasting(factor: float) -> Callable[[Content], Content]:
    """Return the change of the durations of the segments."""
    return lambda content: {"segment_duration": [factor * duration for duration in content["segment_duration"]]}


CHANGES: Mapping[str, Callable[[Content], Content]] = {
    "exact parameters": _plant(mass_scale=1.0, inertia_scale=1.0, friction_scale=1.0),
    "exact sensors": lambda content: {
        "plant": {"encoder_counts": None, "torque_quantum": 0.0},
        "estimator": "none",
    },
    "exact lengths and encoder zeros": _plant(links=LinkErrors(), encoders=EncoderErrors()),
    "rigid transmissions and loop": _plant(transmission=Transmission(), platform_joint=PlatformJoint()),
    "no friction in the passive joints": _plant(friction={"passive": 0.0}),
    "no tilt and no push": _plant(tilt=Tilt(), push=Push()),
    "no lost commands": _plant(bus=BusEffects()),
    "no delay": _plant(delay_samples=0),
    "twice the torque": lambda content: {"plant": {"torque_limit": 2.0 * content["plant"]["torque_limit"]}},
    "a quarter slower": _lasting(1.25),
    "a fifth quicker": _lasting(0.8),
}
"""Changes tried one at a time, to see which conditions the failure depends on: keys in place of others."""


class LargestError(NamedTuple):
    """When the actual platform was furthest from its reference, up to the first fault.

    Attributes:
        time: s.
        error: m.
        kappa: 1/cond(A) of the actual robot.
        estimate_off: distance of the estimated platform from the actual one (m).
    """

    time: float
    error: float
    kappa: float
    estimate_off: float


class Explanation(NamedTuple):
    """A failure: the run, the time of its largest error, and the changes with which the same crossing succeeds."""

    row: SweepRow
    worst: LargestError
    saved_by: tuple[str, ...]

    @property
    def text(self) -> str:
        """The explanation in words."""
        row, worst = self.row, self.worst
        saved = f"succeeds with {', or '.join(self.saved_by)}" if self.saved_by else "fails with every single change"
        when = "before the fault" if row.fault else "in the run"
        return (
            f"{row.why_not}. The largest error {when} was {in_millimetres(worst.error)} after {worst.time:.3f} s, at"
            f" 1/cond(A) = {worst.kappa:.3f}, where the estimate was {in_millimetres(worst.estimate_off)}"
            f" off. The motors gave up to {row.applied or 0.0:.2f} of"
            f" {row.draw.torque_limit:g} Nm. Nearest limit of the screen:"
            f" {row.limit}, {100.0 * (row.limit_use or 0.0):.0f} % used. It {saved}."
        )

    def as_json(self) -> dict[str, Any]:
        """Return the explanation as plain values."""
        return {
            "case": self.row.case,
            "text": self.text,
            "saved_by": list(self.saved_by),
            "worst": self.worst._asdict(),
            "run": self.row._asdict(),
        }


def explained(row: SweepRow) -> Explanation:
    """Return why the run of a row failed."""
    scenario = row.draw.scenario(row.controller)
    # without those that make the same robot and the same motion
    changed = {name: other for name in CHANGES if (other := _changed(scenario, name)) != scenario}
    saved_by = [name for name, other in changed.items() if _succeeds(other, row.draw.size)]
    return Explanation(row, worst_moment(scenario), tuple(saved_by))


def _changed(scenario: Scenario, change: str) -> DrawnScenario:
    """Return a scenario with a change, by its name."""
    content = scenario.model_dump()
    return validate(merged(content, CHANGES[change](content)), DrawnScenario, scenario.name)


def _succeeds(scenario: Scenario, size: float) -> bool:
    try:
        return not run_and_judge(scenario, scenario.plan(), size)[1]
    except InputError:
        # for example, the planner refuses the slower motion
        return False


def worst_moment(scenario: Scenario) -> LargestError:
    """Return when a scenario's run is furthest from its reference."""
    plan = sampled(scenario.five_bar(), scenario.plan(), scenario.rate_hz, scenario.lead_samples)
    outcome, table = traced_crossing(case_of(scenario), plan)
    run = columns_of(table[: outcome.fault_sample + 1] if outcome.fault else table)
    errors = np.hypot(run.x - plan.rows[: len(run.x), X], run.y - plan.rows[: len(run.y), Y])
    worst = int(np.nanargmax(errors))
    joints = (run.q11, run.q12, run.q21, run.q22, run.dq11, run.dq12, run.dq21, run.dq22)
    state = state_from_joints(scenario.actual_robot(), *(float(column[worst]) for column in joints))
    # the estimate at a sample is for the time at which the answer to it takes effect
    then = max(worst - scenario.lead_samples, 0)
    estimate_off = math.hypot(run.estimated_x[then] - run.x[worst], run.estimated_y[then] - run.y[worst])
    return LargestError(worst / scenario.rate_hz, float(errors[worst]), inverse_condition(state), estimate_off)
