# SPDX-License-Identifier: Apache-2.0
"""The parts of the control cycle in the nodes: together they are the cycle, and machine code is the interpreter's."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import pytest
import toy_law

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import simulate
from fivebar_control.laws.law import TunedLaw
from fivebar_control.laws.torque import Torque
from fivebar_control.loop.node_parts import JointValues, LawPart, PlannedValues
from fivebar_control.loop.part_choice import guard_part, law_part, supervisor_part
from fivebar_control.loop.plain_law import PlainLaw
from fivebar_control.loop.plan_sample import planned_references
from fivebar_control.scenario.guard_settings import guard_settings
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_description.parameters import laden

LOST, LADEN, AGAIN = 40, 80, 120
"""A sample that is lost, the one from which on the platform is heavier, and the one at which a motion begins anew."""


class Given(NamedTuple):
    """What the nodes are given at a sample."""

    sample: int
    joints: JointValues
    planned: PlannedValues
    disturbance: tuple[float, float]


def given_of(scenario: Scenario) -> Iterator[Given]:
    """What the nodes of a scenario are given in a run, but for one sample that is lost."""
    for one in simulate(scenario).samples:
        x, y, vx, vy, ax, ay = one.reference
        if one.number != LOST:
            disturbance = 1e-3 * one.number % 0.01, -2e-3
            joints = one.measured.position, one.measured.velocity
            yield Given(one.number, joints, ((x, y, vx, vy), (vx, vy, ax, ay)), disturbance)


def exact(*parts: Any) -> list[str]:
    """Numbers to the last bit, whatever their types."""
    return [float(value).hex() for part in parts for value in (part or ())]


def laws_of(scenario: Scenario, compiled: bool) -> list[LawPart]:
    """The laws of a scenario in their nodes."""
    robot, plan = scenario.five_bar(), scenario.plan()
    tuned = tuned_controller(scenario).laws
    return [law_part(one, compiled, robot, plan, scenario.rate_hz, scenario.lead_samples) for one in tuned]


@pytest.mark.parametrize("name", ["middle", "middle_encoders"])
def test_the_nodes_answers_are_those_of_a_run(name: str) -> None:
    """Each part alone, as the nodes have it, against the control cycle of the offline runner."""
    scenario = load_scenario(name)
    robot, plan, rate_hz, lead = scenario.five_bar(), scenario.plan(), scenario.rate_hz, scenario.lead_samples
    supervisor = supervisor_part(False)(robot, plan, rate_hz, lead, scenario.scheme().weighting)
    nominal, constraint = laws_of(scenario, compiled=False)
    guard = guard_part(False)(robot, scenario.working_mode, rate_hz, guard_settings(scenario))
    samples = simulate(scenario).samples
    for one in samples:
        x, y, vx, vy, ax, ay = one.reference
        joints, planned = (one.measured.position, one.measured.velocity), ((x, y, vx, vy), (vx, vy, ax, ay))
        disturbance = (0.0, 0.0) if one.estimated is None else one.estimated.disturbance
        sigma, kappa = supervisor.answer(one.number, joints)
        candidates = [law.answer(one.number, joints, planned, disturbance) for law in (nominal, constraint)]
        decision = guard.answer(one.number, joints, (x, y), sigma, *candidates)
        assert (sigma, kappa) == one.supervisor
        assert exact(*candidates, *decision) == exact(one.nominal, one.constraint, one.requested, one.command)
    assert len(samples) == scenario.plan().path.samples(rate_hz) + 1


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("middle", {}),
        ("type1_working_mode", {}),
        pytest.param("middle_joint", {}, marks=pytest.mark.extra),
        pytest.param("multi_model_criterion", {}, marks=pytest.mark.extra),
        pytest.param("ctc_middle", {}, marks=pytest.mark.extra),
        pytest.param("gyro_middle", {}, marks=pytest.mark.extra),
        pytest.param("motkin_vertical", {}, marks=pytest.mark.extra),
        pytest.param("unified_middle", {"controller": "path"}, marks=pytest.mark.extra),
    ],
)
def test_machine_code_answers_as_the_interpreter_does_to_the_last_bit(name: str, changes: dict[str, Any]) -> None:
    """Over a lost sample, a payload, another motion, and a fault of the guard with the robot braked after it."""
    scenario = load_scenario(name).model_copy(update=changes)
    robot, plan, rate_hz, lead = scenario.five_bar(), scenario.plan(), scenario.rate_hz, scenario.lead_samples
    weighting, safety, modes = scenario.scheme().weighting, guard_settings(scenario), scenario.working_mode
    both = False, True
    supervisors = [supervisor_part(compiled)(robot, plan, rate_hz, lead, weighting) for compiled in both]
    laws = [laws_of(scenario, compiled) for compiled in both]
    guards = [guard_part(compiled)(robot, modes, rate_hz, safety) for compiled in both]
    assert not any(isinstance(law, PlainLaw) for law in laws[1])
    for sample, joints, planned, disturbance in given_of(scenario):
        if sample == LADEN:
            for part in (*guards, *laws[0], *laws[1]):
                part.carry(laden(robot, 0.05))
        if sample == AGAIN:
            for part in (*laws[0], *laws[1]):
                part.follow(np.array(planned_references(plan, rate_hz))[AGAIN:])
        weights = [one.answer(sample, joints) for one in supervisors]
        torques = [[law.answer(sample, joints, planned, disturbance) for law in one] for one in laws]
        decisions = [
            guard.answer(sample, joints, planned[0][:2], weights[0].sigma, torques[0][0], torques[0][-1])
            for guard in guards
        ]
        assert exact(weights[0]) == exact(weights[1]), sample
        assert exact(*torques[0]) == exact(*torques[1]), sample
        assert exact(*decisions[0]) == exact(*decisions[1]), sample
        assert guards[0].fault == guards[1].fault
    assert guards[0].fault is None and guards[0].limited_samples == guards[1].limited_samples
    position, velocity = joints
    for number, speed in enumerate((1e3, 1.0, 1.0), start=sample + 1):
        joints = position, (speed, *velocity[1:])
        place, idle = planned[0][:2], Torque(0.0, 0.0)
        stopped = [guard.answer(number, joints, place, 0.0, idle, idle) for guard in guards]
        assert exact(*stopped[0]) == exact(*stopped[1]) and guards[0].fault == guards[1].fault
    assert str(guards[1].fault).startswith("over_speed: at sample")


def test_a_law_from_elsewhere_that_cannot_be_compiled_is_interpreted() -> None:
    """It does not say so itself; one that looks ahead is interpreted too."""
    scenario = load_scenario("unified_middle")
    bound = scenario.five_bar(), scenario.plan(), scenario.rate_hz, scenario.lead_samples
    settings = toy_law.ToySettings()
    assert not isinstance(law_part(TunedLaw(toy_law.LAW, settings), True, *bound), PlainLaw)
    for law in (
        toy_law.UNCOMPILED,
        toy_law.LAW._replace(compiles=False),
        toy_law.LAW._replace(samples_ahead=lambda _: 3),
    ):
        assert isinstance(law_part(TunedLaw(law, settings), True, *bound), PlainLaw)
    assert isinstance(law_part(TunedLaw(toy_law.LAW, settings), False, *bound), PlainLaw)
