# SPDX-License-Identifier: Apache-2.0
"""Compiled functions against the plain ones bit for bit, and that no stale machine code is ever used."""

from __future__ import annotations

import importlib.util
import marshal
import math
import os
import subprocess
import sys
from collections import namedtuple
from collections.abc import Callable
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_control.compiling import compiled, compiled_and_kept, digest, kept_by_itself
from fivebar_control.estimation.ekf import filter_model, predicted
from fivebar_control.estimation.encoder import Angle
from fivebar_control.estimation.measurements import corrected, homed_belief
from fivebar_control.estimation.settings import EkfSettings
from fivebar_control.laws.ctc import ctc_torque
from fivebar_control.laws.gains import RESOLUTIONS, UnifiedSettings
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.laws.unified import INITIAL_MEMORY, unified_step
from fivebar_control.laws.vhc_cartesian import vhc_cartesian_torque
from fivebar_control.laws.vhc_joint import vhc_joint_torque
from fivebar_control.loop.closed_loop import run_loop
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.geometry import wrap
from fivebar_control.model.kinematics import state_from_joints, state_from_platform
from fivebar_control.model.line import Line
from fivebar_control.model.state import Platform
from fivebar_description.robot_file import load_robot
from fivebar_description.settings import as_numbers

ROBOT = load_robot("unequal")
MODES = (1, -1)
LINE = Line(0.0, 0.15, 0.6, -0.8)
place = st.tuples(st.floats(-0.12, 0.12), st.floats(-0.05, 0.17))
velocity = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
torque = st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))


def same(function: Callable[..., Any], *arguments: Any) -> None:
    """Compare by text, in which NaN equals NaN and every other float only itself, also as an entry of an array."""
    # a float64 of numpy is written as a float, as it is by numpy 1 anyway
    with np.printoptions(
        floatmode="unique", legacy="1.25" if np.lib.NumpyVersion(np.__version__) >= "2.0.0" else False
    ):
        assert repr(compiled(function)(*arguments)) == repr(function(*arguments))


@pytest.mark.extra
@given(at=place, v=velocity, tau=torque)
def test_model_and_laws_are_the_plain_ones_to_the_last_bit(at: Any, v: Any, tau: Any) -> None:
    """Out of reach too, where everything is NaN."""
    state = state_from_platform(ROBOT, MODES, *at, *v)
    platform = Platform(at[0] + 1e-3, at[1] - 2e-3, *v, *tau)
    reference = reference_from_platform(ROBOT, MODES, platform)
    same(reference_from_platform, ROBOT, MODES, platform)
    same(direct_dynamics, ROBOT, state, *tau, 0.1, -0.2)
    same(ctc_torque, ROBOT, state, reference, 2500.0, 100.0)
    same(unified_step, ROBOT, state, reference, INITIAL_MEMORY, as_numbers(UnifiedSettings(observer_rate=3.0)), 0.002)
    for resolution in RESOLUTIONS.values():
        same(vhc_cartesian_torque, ROBOT, state, reference, LINE, 2500.0, 100.0, resolution)
        same(vhc_joint_torque, ROBOT, MODES, state, reference, LINE, 2500.0, 100.0, resolution)


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


@pytest.mark.extra
@given(at=st.tuples(st.floats(-0.02, 0.02), st.floats(0.06, 0.14)), tau=torque, ahead=st.floats(-1e-3, 1e-3))
def test_the_filter_is_the_plain_one_to_the_last_bit(at: Any, tau: Any, ahead: float) -> None:
    model = filter_model(ROBOT, MODES, 500, EkfSettings())
    belief = homed_belief(model, *at, 1e-8)
    same(predicted, model, belief, *tau)
    later = predicted(model, belief, *tau)
    legs = state_from_platform(ROBOT, MODES, *at, 0.0, 0.0)
    readings = Angle(legs.leg1.q1 + ahead, 1e-8), Angle(legs.leg2.q1 - ahead, 2e-8)
    same(corrected, model, later, *readings)


SOURCE = """
FACTOR = {factor}

def inner(x):
    return {factor} * x

def constant(x):
    return FACTOR * x

def outer(x):
    return inner(x) + constant(x) + 1.0 / (x - x)

def twice(x):
    return 2.0 * x

def sum_of(x):
    return inner(x) + constant(x)

def member(x, known={known}):
    return x in {known} or x in ("first", "second") or x == 1234.5
"""


def module_with(folder: Path, factor: float, known: str = "{0, 8}") -> ModuleType:
    path = folder / "changing.py"
    source = SOURCE.format(factor=factor, known=known)
    # older numba compiles again what is in a newer file, with the same text or not
    if not path.exists() or path.read_text(encoding="utf-8") != source:
        path.write_text(source, encoding="utf-8")
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


def test_what_only_compiled_functions_call_gets_no_machine_code_of_its_own(tmp_path: Path) -> None:
    """That takes a fifth off the compilation of a run; a part that is kept by itself has its machine code."""
    module = module_with(tmp_path, 2.0)
    kept_by_itself(module.constant)
    whole = compiled(module.sum_of)
    assert whole(3.0) == 12.0
    made = {}
    for name in ("inner", "constant"):
        (part,) = whole.py_func.__globals__[name].overloads.values()
        made[name] = part.library._compiled_object
    assert made["inner"] is None
    assert made["constant"]


def test_functions_under_given_names_take_the_place_of_the_modules_own(tmp_path: Path) -> None:
    module = module_with(tmp_path, 7.0)
    assert compiled_and_kept(module.sum_of)(3.0) == module.sum_of(3.0) == 42.0
    bound = compiled_and_kept(module.sum_of, inner=module.twice)
    assert bound(3.0) == 27.0
    assert module.sum_of(3.0) == 42.0


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
    kept = set(Path(first.stats.cache_path).glob("changing.sum_of_*"))
    assert {path.suffix for path in kept} == {".nbi", ".nbc"}
    changed = module_with(tmp_path, 5.0)
    assert compiled_and_kept(changed.sum_of)(3.0) == 30.0
    inner_only = module_with(tmp_path, 2.0)
    before = digest(inner_only.sum_of)
    inner_only.FACTOR = 7.0
    assert digest(inner_only.sum_of) != before
    assert compiled_and_kept(inner_only.sum_of)(3.0) == 27.0
    # and what nobody will load any more does not stay
    left = set(Path(first.stats.cache_path).glob("changing.sum_of_*"))
    assert (len(kept), len(left), kept & left) == (2, 2, set())


def test_machine_code_is_not_loaded_where_others_could_have_written_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = compiled_and_kept(module_with(tmp_path, 2.0).sum_of)
    assert kept(3.0) == 12.0
    folder = Path(kept.stats.cache_path)
    for path, mode in ((folder, 0o777), (next(folder.glob("*.nbi")), 0o666)):
        usual = path.stat().st_mode
        path.chmod(mode)
        again = compiled_and_kept(module_with(tmp_path, 2.0).sum_of)
        assert again(3.0) == 12.0 and sum(again.stats.cache_hits.values()) == 0
        assert f"fivebar: {path.resolve()}: others can write to it" in capsys.readouterr().err
        path.chmod(usual)
    again = compiled_and_kept(module_with(tmp_path, 2.0).sum_of)
    assert again(3.0) == 12.0 and sum(again.stats.cache_hits.values()) == 1


def test_a_part_that_is_kept_by_itself_is_compiled_once_for_all_its_callers(tmp_path: Path) -> None:
    parts = []
    for caller in ("sum_of", "outer"):
        module = module_with(tmp_path, 2.0)
        kept_by_itself(module.inner)
        whole = compiled_and_kept(getattr(module, caller))
        assert whole(3.0) == (12.0 if caller == "sum_of" else math.inf)
        parts.append(whole.py_func.__globals__["inner"].stats)
    assert [sum(one.cache_misses.values()) for one in parts] == [1, 0]
    assert [sum(one.cache_hits.values()) for one in parts] == [0, 1]
    changed = module_with(tmp_path, 5.0)
    kept_by_itself(changed.inner)
    assert compiled_and_kept(changed.sum_of)(3.0) == 30.0


def test_what_is_kept_of_another_function_stays(tmp_path: Path) -> None:
    module = module_with(tmp_path, 2.0)
    compiled_and_kept(module.constant)(3.0)
    folder = Path(compiled_and_kept(module.sum_of).stats.cache_path)
    before = set(folder.glob("changing.constant_*.nb*"))
    # a name that begins like that of another function
    other = folder / "changing.sum_of_squares_0123456789abcdef-1.py311.nbi"
    other.touch()
    compiled_and_kept(module_with(tmp_path, 5.0).sum_of)
    assert len(before) == 2
    assert all(path.exists() for path in (*before, other))


def references(code: CodeType) -> list[object]:
    inner = [references(constant) for constant in code.co_consts if isinstance(constant, CodeType)]
    return [code.co_consts, *code.co_consts, code.co_names, code.co_varnames, *inner]


def test_the_digest_does_not_depend_on_how_the_interpreter_holds_the_code(tmp_path: Path) -> None:
    """`marshal` writes an object otherwise once a second reference to it exists."""
    module = module_with(tmp_path, 2.0)
    before, written = digest(module.member), marshal.dumps(module.member.__code__)
    held = references(module.member.__code__)
    assert held
    assert marshal.dumps(module.member.__code__) != written
    assert digest(module.member) == before
    assert digest(module_with(tmp_path, 2.0).member) == before


def test_the_digest_does_not_depend_on_the_order_in_a_set(tmp_path: Path) -> None:
    one, other = (module_with(tmp_path, 2.0, known).member for known in ("{0, 8}", "{8, 0}"))
    assert repr(one.__defaults__) != repr(other.__defaults__)
    assert digest(one) == digest(other)
    assert digest(module_with(tmp_path, 2.0, "{0, 9}").member) != digest(one)


def test_the_digest_is_that_of_every_process() -> None:
    """Of the whole loop, with strings hashed otherwise."""
    script = (
        f"from {digest.__module__} import digest; from {run_loop.__module__} import run_loop; print(digest(run_loop))"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "1"}
    there = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True)
    assert there.stdout.strip() == digest(run_loop)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("return x * 1", "return x * 1.0"),
        ("return x * 0.0", "return x * -0.0"),
        ("return x * 2", "return x * 3"),
        ("return x + 2", "return x - 2"),
        ("return math.sin(x)", "return math.cos(x)"),
        ("return x in (1, 2)", "return x in (2, 1)"),
        ("return (lambda y: y + 1)(x)", "return (lambda y: y + 2)(x)"),
        ("return Pair(x)", "return Pair(x, 3.0)"),
    ],
)
def test_every_difference_of_the_code_is_in_the_digest(one: str, other: str) -> None:
    digests = set()
    for body in (one, other):
        namespace: dict[str, Any] = {"math": math}
        exec(f"def function(x):\n    {body}", namespace)
        digests.add(digest(namespace["function"]))
    assert len(digests) == 2


def test_default_values_are_in_the_digest() -> None:
    """Those of the function, by keyword too, and those of a class that it makes an instance of."""
    digests = set()
    for positional, keyword, field in ((1.0, 1.0, 1.0), (2.0, 1.0, 1.0), (1.0, 2.0, 1.0), (1.0, 1.0, 2.0)):
        namespace: dict[str, Any] = {"Made": namedtuple("Made", "one", defaults=[field])}
        exec(f"def function(x={positional}, *, y={keyword}):\n    return Made()", namespace)
        digests.add(digest(namespace["function"]))
    assert len(digests) == 4


def test_the_classes_of_arguments_are_in_the_digest() -> None:
    """Machine code reads a field by its place, in the class itself and in those of its fields."""
    digests = set()
    for name, fields in (("Inner", "ab"), ("Inner", "ba"), ("Renamed", "ab")):
        inner = NamedTuple(name, [(field, float) for field in fields])
        namespace: dict[str, Any] = {"Outer": NamedTuple("Outer", [("inner", inner)])}
        exec("def function(x: Outer):\n    return x.inner.a", namespace)
        digests.add(digest(namespace["function"]))
    assert len(digests) == 3


def test_the_modules_of_functions_and_classes_are_in_the_digest() -> None:
    """Machine code that is loaded imports them, so that of a function that was moved is not that of another one."""
    digests = set()
    for own, made in (("one", "one"), ("other", "one"), ("one", "other")):
        namespace: dict[str, Any] = {"__name__": own, "Made": namedtuple("Made", "one", module=made)}
        exec("def function(x):\n    return Made(x)", namespace)
        digests.add(digest(namespace["function"]))
    assert len(digests) == 3
