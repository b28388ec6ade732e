"""Compiled functions against the plain ones bit for bit, and that no stale machine code is ever used."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_bringup.simulation.compiling import compiled, compiled_and_kept, digest
from fivebar_control.estimation.ekf import EkfSettings, corrected, filter_model, homed_belief, predicted
from fivebar_control.estimation.encoder import Angle
from fivebar_control.laws.ctc import ctc_torque
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.laws.resolution import full_friction, min_norm
from fivebar_control.laws.unified import NOTHING_KNOWN, UnifiedSettings, unified_step
from fivebar_control.laws.vhc_cartesian import vhc_cartesian_torque
from fivebar_control.laws.vhc_joint import vhc_joint_torque
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.geometry import wrap
from fivebar_control.model.kinematics import state_from_joints, state_from_platform
from fivebar_control.model.line import Line
from fivebar_control.model.state import Platform
from fivebar_description.parameters import load_robot

ROBOT = load_robot("unequal")
MODES = (1, -1)
LINE = Line(0.0, 0.15, 0.6, -0.8)
place = st.tuples(st.floats(-0.12, 0.12), st.floats(-0.05, 0.17))
velocity = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
torque = st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))


def same(function: Callable[..., Any], *arguments: Any) -> None:
    """Compare by text, in which NaN equals NaN and every other float only itself."""
    assert repr(compiled(function)(*arguments)) == repr(function(*arguments))


@given(at=place, v=velocity, tau=torque)
def test_model_and_laws_are_the_plain_ones_to_the_last_bit(at: Any, v: Any, tau: Any) -> None:
    """Out of reach too, where everything is NaN."""
    state = state_from_platform(ROBOT, *MODES, *at, *v)
    platform = Platform(at[0] + 1e-3, at[1] - 2e-3, *v, *tau)
    reference = reference_from_platform(ROBOT, *MODES, platform)
    same(reference_from_platform, ROBOT, *MODES, platform)
    same(direct_dynamics, ROBOT, state, *tau, 0.1, -0.2)
    same(ctc_torque, ROBOT, state, reference, 2500.0, 100.0)
    same(unified_step, ROBOT, state, reference, NOTHING_KNOWN, UnifiedSettings(observer_rate=3.0), 0.002)
    for function, arguments, resolve in (
        (vhc_cartesian_torque, (ROBOT, state, reference, LINE), full_friction),
        (vhc_joint_torque, (ROBOT, *MODES, state, reference, LINE), min_norm),
    ):
        found = compiled(function)(*arguments, 2500.0, 100.0, compiled(resolve))
        assert repr(found) == repr(function(*arguments, 2500.0, 100.0, resolve))


@given(angles=st.tuples(*[st.floats(-7.0, 7.0)] * 4), rates=st.tuples(*[st.floats(-30.0, 30.0)] * 4))
def test_the_state_from_joints_is_the_plain_one_to_the_last_bit(angles: Any, rates: Any) -> None:
    same(state_from_joints, ROBOT, *angles, *rates)


@given(angle=st.floats())
def test_wrapped_angles_are_the_plain_ones_and_those_of_fmod(angle: float) -> None:
    same(wrap, angle)
    if math.isfinite(angle):
        turned = math.fmod(angle, 2.0 * math.pi)
        assert wrap(angle) in (turned, turned - 2.0 * math.pi, turned + 2.0 * math.pi)
        assert -math.pi < wrap(angle) <= math.pi


@given(at=st.tuples(st.floats(-0.02, 0.02), st.floats(0.06, 0.14)), tau=torque, ahead=st.floats(-1e-3, 1e-3))
def test_the_filter_is_the_plain_one_to_the_last_bit(at: Any, tau: Any, ahead: float) -> None:
    model = filter_model(ROBOT, *MODES, 500, EkfSettings())
    belief = homed_belief(model, *at, 1e-8)
    same(predicted, model, belief, *tau)
    later = predicted(model, belief, *tau)
    legs = state_from_platform(ROBOT, *MODES, *at, 0.0, 0.0)
    readings = Angle(legs.leg1.q1 + ahead, 1e-8), Angle(legs.leg2.q1 - ahead, 2e-8)
    same(corrected, model, later, *readings)


SOURCE = """
from typing import NamedTuple

FACTOR = {factor}

class Pair(NamedTuple):
    one: float
    other: float

def inner(x):
    return {factor} * x

def constant(x):
    return FACTOR * x

def outer(x):
    return inner(x) + constant(x) + 1.0 / (x - x)

def exchanged(pair: Pair) -> Pair:
    return pair._replace(other=pair.one * 2.0)

def misplaced(pair: Pair) -> Pair:
    new = Pair(1.0, 2.0)
    return new._replace(one=0.0)

def sum_of(x):
    return inner(x) + constant(x)
"""


def module_with(folder: Path, factor: float) -> ModuleType:
    path = folder / "changing.py"
    path.write_text(SOURCE.format(factor=factor), encoding="utf-8")
    spec = importlib.util.spec_from_file_location("changing", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    exec(compile(path.read_text(encoding="utf-8"), str(path), "exec"), module.__dict__)
    return module


def test_division_by_zero_is_infinite_and_the_original_stays_plain(tmp_path: Path) -> None:
    module = module_with(tmp_path, 2.0)
    assert compiled(module.outer)(3.0) == math.inf
    with pytest.raises(ZeroDivisionError):
        module.outer(3.0)
    assert compiled(module.inner) is compiled(module.inner)


def test_replaced_fields_of_an_argument_are_written_out(tmp_path: Path) -> None:
    module = module_with(tmp_path, 2.0)
    assert compiled(module.exchanged)(module.Pair(1.0, 5.0)) == module.exchanged(module.Pair(1.0, 5.0)) == (1.0, 2.0)
    with pytest.raises(TypeError, match=r"new\._replace: expected an argument"):
        compiled(module.misplaced)


def test_only_plain_functions_are_compiled() -> None:
    factor = 2.0
    with pytest.raises(TypeError, match="expected a plain function without a closure"):
        compiled(lambda x: factor * x)
    with pytest.raises(TypeError, match="expected a plain function"):
        compiled(math.sin)


def test_code_is_kept_on_disk_until_any_function_or_constant_down_the_line_changes(tmp_path: Path) -> None:
    """numba itself only looks at the file of the outermost function, and would not see a change elsewhere."""
    first, again = (compiled_and_kept(module_with(tmp_path, 2.0).sum_of) for _ in range(2))
    assert (first(3.0), again(3.0)) == (12.0, 12.0)
    assert sum(first.stats.cache_misses.values()) == 1
    assert sum(again.stats.cache_hits.values()) == 1
    changed = module_with(tmp_path, 5.0)
    assert compiled_and_kept(changed.sum_of)(3.0) == 30.0
    inner_only = module_with(tmp_path, 2.0)
    before = digest(inner_only.sum_of)
    inner_only.FACTOR = 7.0
    assert digest(inner_only.sum_of) != before
    assert compiled_and_kept(inner_only.sum_of)(3.0) == 27.0
