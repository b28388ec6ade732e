"""Why a feasible crossing failed: where the error peaked, and which single changes avoid the failure."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import case_of, sampled
from fivebar_bringup.simulation.engine import traced_crossing
from fivebar_bringup.simulation.outcome import TraceRow
from fivebar_bringup.studies.sweep.drawing import DrawnScenario
from fivebar_bringup.studies.sweep.rows import SweepRow
from fivebar_bringup.studies.sweep.running import made
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

Content = dict[str, Any]


def _exact_parameters(content: Content) -> None:
    content["plant"] |= {"mass_scale": 1.0, "inertia_scale": 1.0, "friction_scale": 1.0}


def _exact_sensors(content: Content) -> None:
    content["plant"] |= {"encoder_counts": None, "torque_quantum": 0.0}
    content["estimator"] = "none"


def _exact_geometry(content: Content) -> None:
    content["plant"]["links"] = LinkErrors()
    content["plant"]["encoders"] = EncoderErrors()


def _rigid(content: Content) -> None:
    content["plant"]["transmission"] = Transmission()
    content["plant"]["platform_joint"] = PlatformJoint()


def _no_passive_friction(content: Content) -> None:
    content["plant"]["friction"] = {**content["plant"]["friction"], "passive": 0.0}


def _no_loads(content: Content) -> None:
    content["plant"]["tilt"], content["plant"]["push"] = Tilt(), Push()


def _no_losses(content: Content) -> None:
    content["plant"]["bus"] = BusEffects()


def _no_delay(content: Content) -> None:
    content["plant"]["delay_samples"] = 0


def _twice_the_torque(content: Content) -> None:
    content["plant"]["torque_limit"] *= 2.0


def _stretched(content: Content, factor: float) -> list[float]:
    return [factor * duration for duration in content["segment_duration"]]


def _slower(content: Content) -> None:
    content["segment_duration"] = _stretched(content, 1.25)


def _quicker(content: Content) -> None:
    content["segment_duration"] = _stretched(content, 0.8)


CHANGES: Mapping[str, Callable[[Content], None]] = {
    "exact parameters": _exact_parameters,
    "exact sensors": _exact_sensors,
    "exact lengths and encoder zeros": _exact_geometry,
    "rigid transmissions and loop": _rigid,
    "no friction in the passive joints": _no_passive_friction,
    "no tilt and no push": _no_loads,
    "no lost commands": _no_losses,
    "no delay": _no_delay,
    "twice the torque": _twice_the_torque,
    "a quarter slower": _slower,
    "a fifth quicker": _quicker,
}
"""Changes tried one at a time, to see which conditions the failure depends on."""


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
    saved_by = [name for name in CHANGES if _changes(scenario, name) and _succeeds(scenario, name, row.draw.size)]
    return Explanation(row, worst_moment(scenario), tuple(saved_by))


def _changes(scenario: Scenario, change: str) -> bool:
    """Return whether a change makes another robot or another motion of a scenario."""
    content = scenario.model_dump()
    CHANGES[change](content)
    return validate(content, DrawnScenario, scenario.name) != scenario


def _succeeds(scenario: Scenario, change: str, size: float) -> bool:
    content = scenario.model_dump()
    CHANGES[change](content)
    try:
        changed = validate(content, DrawnScenario, scenario.name)
        return not made(changed, changed.plan(), size)[1]
    except InputError:
        # for example, the planner refuses the slower motion
        return False


def worst_moment(scenario: Scenario) -> LargestError:
    """Return when a scenario's run is furthest from its reference."""
    robot = scenario.five_bar()
    plan = sampled(robot, scenario.plan(), scenario.rate_hz, scenario.lead_samples)
    outcome, trace = traced_crossing(case_of(scenario), plan)
    until = outcome.fault_sample + 1 if outcome.fault else len(trace)
    moments = []
    for number, (x, y, estimated_x, estimated_y, kappa) in enumerate(_places(scenario, trace[:until])):
        error = math.hypot(x - plan.rows[number, 0], y - plan.rows[number, 1])
        moments.append(
            LargestError(number / scenario.rate_hz, error, kappa, math.hypot(estimated_x - x, estimated_y - y))
        )
    return max(moments, key=lambda moment: moment.error)


def _places(scenario: Scenario, trace: FloatArray) -> list[tuple[float, ...]]:
    """Return the actual platform (m), the estimated one at the same time, and 1/cond(A), sample by sample."""
    robot, lead = scenario.actual_robot(), scenario.lead_samples
    estimated = [TraceRow._fields.index(name) for name in ("estimated_x", "estimated_y")]
    places: list[tuple[float, ...]] = []
    for number, joints in enumerate(trace[:, :8].tolist()):
        state = state_from_joints(robot, *joints)
        # the estimate at a sample is for the time at which the answer to it takes effect
        estimated_x, estimated_y = trace[max(number - lead, 0), estimated].tolist()
        places.append((state.x, state.y, estimated_x, estimated_y, inverse_condition(state)))
    return places
