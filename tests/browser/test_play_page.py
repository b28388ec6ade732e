# SPDX-License-Identifier: Apache-2.0
"""The page that explains by play in a real browser: its functions are Python's, and its runs those of `simulate`."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, get_type_hints

import pytest
from browser_pages import assert_looks_like, until

from fivebar_bringup.simulation.offline import simulate
from fivebar_bringup.simulation.plant import PlantState, chain_at, closed
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import state_from_joints, state_from_platform
from fivebar_control.model.state import Leg, State
from fivebar_description.parameters import FiveBar
from fivebar_play.content import LENGTH_STEP, PUSH_TIME, case_with, exported, scenario_of
from fivebar_play.javascript import Translation
from fivebar_play.page import page as play_page
from fivebar_play.run import PlayRun
from fivebar_sim.effects.mechanism import Mechanism
from fivebar_sim.effects.timing import Delays, drawn

pytestmark = pytest.mark.extra

OpenPage = Callable[..., Any]

SAMPLES = 20
"""Random arguments of each function."""

PLAIN = """(results) => {
  const plain = (x) => (typeof x === "number" && !Number.isFinite(x) ? String(x)
    : x !== null && typeof x === "object" ? [...x].map(plain) : x);
  return results.map(plain);
}"""


class Arguments:
    """Random arguments by their types; the robot has the lengths of DexTAR, so that its loops close."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)
        self._mechanism = case_with("ctc", 1.0, 1e-4).numbers.mechanism
        self._robot = scenario_of("ctc").five_bar()

    def of(self, kind: Any, name: str) -> Any:
        """Return an argument, NotImplemented for types of which there is none."""
        number = self._random
        if kind is float:
            return number.uniform(-2.0, 2.0)
        if kind is bool:
            return number.random() < 0.5
        if kind is int:
            return number.choice((-1, 1)) if "mode" in name or name == "assembly" else number.randrange(3)
        if kind in (None, type(None)):
            return None
        if kind is FiveBar:
            residual = number.choice((0.0, -1e-4))
            legs = (
                leg._replace(inertia=leg.inertia * number.uniform(0.5, 2.0), residual=residual)
                for leg in self._robot[:2]
            )
            return FiveBar(*legs, self._robot.mass * number.uniform(0.5, 2.0))
        if kind is State:
            place = number.uniform(-0.05, 0.05), number.uniform(0.03, 0.15)
            return state_from_platform(self._robot, (1, -1), *place, number.uniform(-1, 1), number.uniform(-1, 1))
        if kind is Leg:
            return self.of(State, name).leg1
        if kind in (Mechanism, Delays):
            # the jitter of commands and readings is not translated
            return self._mechanism if kind is Mechanism else self._mechanism.delays
        if kind is PlantState:
            q = inverse_geometry(self._robot, (1, -1), number.uniform(-0.05, 0.05), number.uniform(0.03, 0.15))
            legs = (chain_at(*pair, *(number.uniform(-1, 1) for _ in range(2))) for pair in (q[:2], q[2:]))
            return closed(self._robot, PlantState(*legs)).state
        if kind is PlayRun or not hasattr(kind, "_fields"):
            return NotImplemented
        fields = [self.of(one, field) for field, one in get_type_hints(kind).items()]
        return NotImplemented if NotImplemented in fields else kind(*fields)


def flat(value: Any) -> Iterator[Any]:
    """Return the numbers of a result, one after the other; those that are not finite as text."""
    if isinstance(value, tuple | list):
        for one in value:
            yield from flat(one)
    elif isinstance(value, float) and not math.isfinite(value):
        yield {math.inf: "Infinity", -math.inf: "-Infinity"}.get(value, "NaN")
    else:
        yield value


def calls_of(function: Any, arguments: Arguments) -> list[tuple[tuple[Any, ...], Any]]:
    """Return calls of a function with random arguments, and their results; none where a type has no random values."""
    kinds = {name: kind for name, kind in get_type_hints(function).items() if name != "return"}
    calls: list[tuple[tuple[Any, ...], Any]] = []
    for _ in range(SAMPLES):
        given = tuple(arguments.of(kind, name) for name, kind in kinds.items())
        if not kinds or any(one is NotImplemented for one in given):
            return []
        try:
            calls.append((given, function(*given)))
        except (ArithmeticError, ValueError, RuntimeError):
            # what Python refuses has no result to compare
            continue
    return calls


def test_every_function_returns_what_it_does_in_python(open_page: OpenPage) -> None:
    translation = Translation(without=[drawn])
    translation.text(exported())
    arguments, compared, scripts, wanted = Arguments(42), [], [], []
    for number, function in enumerate(translation.functions):
        calls = calls_of(function, arguments)
        if calls:
            compared.append(function)
            texts = [f"all.f{number}({', '.join(map(translation.value, given))})" for given, _ in calls]
            scripts.append(f"({PLAIN})([{', '.join(texts)}])")
            wanted.append([list(flat(result)) for _, result in calls])
    assert len(compared) > 130
    # again, with all functions and the classes of all arguments by name
    exports = {f"f{number}": function for number, function in enumerate(translation.functions)}
    text = translation.text(exports)
    classes = "".join(f"const {name} = all.{name};\n" for name in translation.classes)
    listed = text.replace("return { f0:", f"return {{ {', '.join(translation.classes)}, f0:")
    assert listed != text
    results = open_page("about:blank").evaluate(
        f"(() => {{ const all = {listed};\n{classes}return [{', '.join(scripts)}]; }})()"
    )
    wrong = {}
    for function, expected, found in zip(compared, wanted, results, strict=True):
        for one, other in zip(expected, found, strict=True):
            if not near(one, list(flat(other))):
                wrong[function.__qualname__] = (one, other)
    assert not wrong


def near(one: list[Any], other: list[Any]) -> bool:
    """Return whether two results are the same, but for 1e-9."""
    if len(one) != len(other):
        return False
    for a, b in zip(one, other, strict=True):
        if isinstance(a, bool | str) or a is None:
            if a != b:
                return False
        elif isinstance(b, bool | str) or b is None or abs(a - b) > 1e-9 * max(1.0, abs(a)):
            return False
    return True


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> str:
    path: Path = tmp_path_factory.mktemp("play") / "play.html"
    path.write_text(play_page(), encoding="utf-8")
    return path.as_uri()


CASES = [(1.0, 0.5, 0), (0.5, 0.0, 0), (2.0, 0.0, -4), (0.8, 5.0, 0), (1.2, 1.0, 7)]
"""Duration (s), push (N) and wrong length (tenths of a mm)."""


def test_its_runs_are_those_of_simulate(address: str, open_page: OpenPage) -> None:
    page = open_page(address)
    faults = set()
    for duration, push, longer in CASES:
        for name, value in (("duration", duration), ("push", push), ("longer", longer)):
            page.evaluate(f"play.find('{name}').value = {value}")
        page.evaluate("play.renew()")
        motion = json.loads(
            page.evaluate("JSON.stringify([...play.motion.segment].slice(0, 4).concat(play.motion.crossing.time))")
        )
        for law in ("ctc", "multi_joint", "multi_cartesian", "unified"):
            found = page.evaluate(f"play.runs.{law}.samples.map((one) => [one.x, one.y, one.asked1])")
            scenario = scenario_of(
                law,
                tuple(motion[:2]),
                tuple(motion[2:4]),
                duration,
                push,
                motion[4] - 0.5 * PUSH_TIME,
                longer * LENGTH_STEP,
            )
            run, robot = simulate(scenario), scenario.actual_robot()
            assert len(found) == len(run.samples)
            for (x, y, _), sample in zip(found, run.samples, strict=True):
                state = state_from_joints(robot, *sample.exact.position, *sample.exact.velocity)
                assert math.hypot(state.x - x, state.y - y) < 1e-6, (law, duration, push, longer, sample.number)
            fault = page.evaluate(f"play.runs.{law}.fault")
            assert (fault != 0) == bool(run.faults)
            faults.add((law, fault))
    assert ("ctc", 10) in faults
    assert {fault for law, fault in faults if law == "unified"} == {0}


def test_one_controller_after_the_other_crosses(address: str, open_page: OpenPage) -> None:
    page = open_page(address)
    told = [page.locator("#play-laws tbody tr").nth(number).text_content() for number in range(5)]
    assert "stopped: torque" in told[0]
    assert all("across, " in one for one in told[1:])
    assert_looks_like(page, ".player", "play", "#play-stage")

    page.click("#play-cross")
    until(page, "play.time > 0.6")
    assert page.text_content("#play-told").startswith("Stopped: computed torque asked for more torque")
    page.keyboard.press("4")
    assert page.is_checked("[value=unified]")
    page.keyboard.press("Enter")
    until(page, "!play.playing && play.time > 0.99")
    assert page.text_content("#play-told").startswith("Across")
    assert page.text_content("#play-det").startswith("−")

    # a push that is too much for the laws which are blended
    page.fill("#play-push", "5")
    assert ["stopped" in page.locator("#play-laws tbody tr").nth(number).text_content() for number in range(4)] == [
        True, True, True, False,
    ]  # fmt: skip


def test_a_crossing_under_way_begins_again(address: str, open_page: OpenPage) -> None:
    page = open_page(address)
    page.check("[value=unified]")
    page.click("#play-cross")
    until(page, "play.time > 0.3")
    page.evaluate("times = []; show = play.show; play.show = (time) => { times.push(time); show.call(play, time); }")
    page.evaluate("times.length = 0; play.cross()")
    until(page, "!play.playing && play.time > 0.99")
    times = page.evaluate("times")
    assert times == sorted(times)


def test_the_platform_is_dragged_and_moved_by_keys(address: str, open_page: OpenPage) -> None:
    page = open_page(address)
    box = page.locator("#play-stage").bounding_box()
    column, row = page.evaluate("play.stage.toPixel([10, 120])")
    page.mouse.move(
        *(box[side] + shift for side, shift in zip("xy", page.evaluate("play.stage.toPixel([0, 150])"), strict=True))
    )
    page.mouse.down()
    page.mouse.move(box["x"] + column, box["y"] + row)
    page.mouse.up()
    assert page.evaluate("[play.x, play.y]") == pytest.approx([0.01, 0.12], abs=1e-6)
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Shift+ArrowDown")
    assert page.evaluate("[play.x, play.y]") == pytest.approx([0.009, 0.11], abs=1e-6)
    assert page.get_attribute("#play-torque-bar", "class") == ""
    # onto the locus: no grip, and a torque that no drive has; from there it crosses as from where it came
    nearest = "(a, b) => (Math.abs(a[0]) < Math.abs(b[0]) ? a : b)"
    page.evaluate(f"play.move(0, play.data.scene.locus.flat().reduce({nearest})[1] / 1e3)")
    assert page.get_attribute("#play-torque-bar", "class") == "over"
    assert page.text_content("#play-told").startswith("Hardly any grip")
    assert page.is_enabled("#play-cross")
    page.evaluate("play.move(0, 0.5)")
    assert page.evaluate("play.y") < 0.2
    page.click("#play-reset")
    assert page.evaluate("[play.x, play.y]") == [0, 0.15]


@pytest.mark.parametrize("dark", [False, True])
def test_it_fits_a_phone(address: str, open_page: OpenPage, dark: bool) -> None:
    page = open_page(address, width=360, height=740, dark=dark)
    assert page.evaluate("document.documentElement.scrollWidth") == 360
    assert page.evaluate("document.getElementById('play-cross').getBoundingClientRect().height") >= 36
