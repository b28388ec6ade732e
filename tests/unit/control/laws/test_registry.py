# SPDX-License-Identifier: Apache-2.0
"""The table of controllers: what it says of each, and how a law from elsewhere is found or refused."""

from __future__ import annotations

import pytest
import toy_law

from fivebar_control.laws.law import MIN_AUTHORITY
from fivebar_control.laws.registry import (
    CONTROLLERS,
    controller_problem,
    default_tuning,
    find_controller,
    own_laws,
)
from fivebar_description.settings import declared
from fivebar_description.strict_yaml import InputError

CONSTRAINT_LAWS = {one.constraint.name for one in CONTROLLERS.values() if one.constraint is not None}
"""Names of the laws on the locus."""


OURS = {
    "ctc": ["ctc"],
    "multi_joint": ["ctc", "vhc_joint"],
    "multi_cartesian": ["ctc", "vhc_cartesian"],
    "multi_model_ctc": ["ctc", "reduced_ctc"],
    "unified": ["unified"],
    "mpc": ["mpc"],
    "lqr": ["lqr"],
    "path": ["path"],
}
"""Controllers of the thesis and regular laws, with the names of their laws; others may come."""


def test_the_controllers_are_those_of_the_thesis_and_the_regular_laws() -> None:
    assert {name: [law.name for law in CONTROLLERS[name].laws] for name in OURS} == OURS
    assert {"vhc_joint", "vhc_cartesian", "reduced_ctc"} <= CONSTRAINT_LAWS


def test_laws_on_the_locus_share_a_topic() -> None:
    topics = {name: law.topic.name for name, law in own_laws().items()}
    assert topics == {name: f"{'vhc' if name in CONSTRAINT_LAWS else name}/torque" for name in own_laws()}


def test_what_a_controller_can_do_follows_from_its_laws() -> None:
    ours = {name: CONTROLLERS[name] for name in OURS}
    assert {name for name, one in ours.items() if one.blended} == {"multi_joint", "multi_cartesian", "multi_model_ctc"}
    assert {name for name, one in ours.items() if not one.crosses} == {"ctc"}
    for wanted, able in (
        ("needs_no_zones", {"unified", "mpc", "lqr", "path"}),
        ("takes_goals", {"unified", "mpc", "path"}),
        ("follows_motions", {"path"}),
        ("meets_type_1", {"unified"}),
        ("observes_disturbance", {"unified", "path"}),
        ("compiles", set(OURS) - {"mpc", "lqr"}),
    ):
        assert {name for name, one in ours.items() if getattr(one, wanted)} == able, wanted
    ahead = {name: default_tuning(one).samples_ahead for name, one in ours.items()}
    assert {name for name, samples in ahead.items() if samples} == {"mpc"}
    assert {name: one.min_authority for name, one in CONTROLLERS.items()} == {
        name: 0.0 if one.needs_no_zones else MIN_AUTHORITY for name, one in CONTROLLERS.items()
    }


@pytest.mark.parametrize("name", own_laws())
def test_a_law_is_found_by_its_name_with_settings_that_are_declared(name: str) -> None:
    law = own_laws()[name]
    assert law.name == name
    assert law.topic.name.endswith("/torque")
    assert [one.name for one in declared(law.settings)] == list(law.settings()._fields)  # type: ignore[attr-defined]


def test_a_law_from_elsewhere_is_a_controller_of_its_own() -> None:
    controller = find_controller("toy_law:LAW")
    assert (controller.name, controller.laws) == ("toy_law:LAW", (toy_law.LAW,))
    assert controller.crosses
    assert controller.needs_no_zones
    assert controller.nominal.topic.name == "toy/torque"
    assert default_tuning(controller).nominal.settings == toy_law.ToySettings()
    assert controller.nominal is toy_law.LAW


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("toy", "expected one of ctc, multi_joint, multi_cartesian, multi_model_ctc, unified, mpc, lqr, "),
        ("toy_law.LAW", "expected one of ctc"),
        ("toy_law:NOTHING", "cannot be loaded: module 'toy_law' has no attribute 'NOTHING'"),
        ("no_such_module:LAW", "cannot be loaded: No module named 'no_such_module'"),
        ("toy_law:NO_LAW", "expected a fivebar_control.laws.law.Law, found float"),
        ("toy_law:TAKEN", "the name 'ctc' is taken, expected another one"),
        ("toy_law:NOT_A_TOPIC", "name 'Toy law': expected a word of lower-case letters, digits and underscores"),
    ],
)
def test_what_is_no_controller_is_refused_with_the_reason(name: str, problem: str) -> None:
    found = controller_problem(name)
    assert found is not None
    assert found.startswith(problem)
    with pytest.raises(InputError) as refused:
        find_controller(name)
    assert str(refused.value) == f"controller: {name!r}: {found}"


def test_a_controller_is_no_law() -> None:
    assert "multi_joint" not in own_laws()
