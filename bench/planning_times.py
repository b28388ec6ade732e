# SPDX-License-Identifier: Apache-2.0
"""How long planning takes, by kind of request: `python bench/planning_times.py`.

The robot declares the tolerances and loads of the rig `middling`, so that every motion has odds. Each kind is measured
in a process of its own, after a first one that may have to compile.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

HOME, BEYOND, BESIDE = (0.0, 0.15), (0.0, 0.02), (0.03, 0.03)
"""A rest, and two goals across the locus (m)."""

RIG, WEAK = "middling", 0.7
"""Rig whose robots are drawn, and a torque limit (Nm) with which no motion is likely enough, so that all are tried."""

CASES, WARM = 12, 2
"""Cases of a sweep, and so many before them that load machine code."""


class Times(NamedTuple):
    """Times of processor and clock (s): of loading, of the first request, and of another one; None for none."""

    loading: tuple[float, float]
    first: tuple[float, float] | None
    second: tuple[float, float] | None = None


class Watch:
    """Takes the time since the process has started."""

    def __init__(self) -> None:
        """Count on from the interpreter's start by the processor, and from now by the clock."""
        self._processor, self._clock = 0.0, time.monotonic()

    def lap(self) -> tuple[float, float]:
        """Return processor time and time (s) since the last call."""
        before = self._processor, self._clock
        self._processor, self._clock = time.process_time(), time.monotonic()
        return self._processor - before[0], self._clock - before[1]


def main() -> None:
    """Measure and print, or measure one kind for another process."""
    if len(sys.argv) > 1:
        print(json.dumps(KINDS[sys.argv[1]](Path(sys.argv[2]), Watch())))
        return
    from rich.console import Console
    from rich.table import Table

    table = Table("request", "loading", "the first", "another one", title="Processor time (time by the clock), s")
    console = Console()
    with prepared() as folder:
        for name in KINDS:
            with console.status(name):
                _measured(name, folder)
                loading, first, second = _measured(name, folder)
            table.add_row(name, *("" if one is None else _text(one) for one in (loading, first, second)))
    console.print(table)


def _text(times: tuple[float, float]) -> str:
    return f"{times[0]:.2f} ({times[1]:.2f})"


def _measured(name: str, folder: Path) -> Times:
    # with bytecode, as an installation has it
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    command = [sys.executable, __file__, name, str(folder)]
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, check=True, text=True)
    return Times(*json.loads(done.stdout.splitlines()[-1]))


@contextmanager
def prepared() -> Iterator[Path]:
    """Give a folder with a scenario on the rig's robot."""
    from fivebar_bringup.scenario import Scenario
    from fivebar_description.strict_yaml import validate
    from fivebar_studies.rigs.named import find_rig

    rig = find_rig(RIG)
    content = {**rig.scenario, "robot": rig.robot, "controller": "unified"}
    motion = {"name": "crossing", "waypoints": [HOME, BEYOND], "segment_duration": 0.35, "time_law": "optimal"}
    scenario = validate({**content, **motion}, Scenario, RIG)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "crossing.yaml").write_text(scenario.to_yaml(), encoding="utf-8")
        yield folder


def _request(folder: Path, goal: tuple[float, float], torque: float) -> Any:
    from fivebar_bringup.motions.request import Request
    from fivebar_bringup.motions.start import HOME_MODE, Start
    from fivebar_bringup.scenarios.scenario_files import load_scenario
    from fivebar_control.planning.timing import Speed

    before = load_scenario(str(folder / "crossing.yaml"))
    start = Start(*HOME, HOME_MODE, before)
    return Request(
        x=goal[0],
        y=goal[1],
        assembly="-",
        working_mode=None,
        start=start,
        controller="unified",
        robot=before.robot,
        torque_limit=torque,
        motor_speed=before.safety.joint_speed_limit,
        rate_hz=before.rate_hz,
        duration=Speed.COMFORTABLE,
    )


def _goto(folder: Path, watch: Watch, torque: float = 2.0, refused: bool = False) -> Times:
    from fivebar_bringup.motions.likely import plan_likely
    from fivebar_description.errors import InputError

    requests = [_request(folder, goal, torque) for goal in (BEYOND, BESIDE)]
    loading = watch.lap()
    laps = []
    for request in requests:
        with suppress(InputError) if refused else nullcontext():
            plan_likely(request)
        laps.append(watch.lap())
    return Times(loading, *laps)


def _program(folder: Path, watch: Watch) -> Times:
    from fivebar_bringup.motions.program import plan_program, scenario_of_program
    from fivebar_bringup.scenarios.scenario_files import load_scenario
    from fivebar_control.planning.program import load_program

    before = load_scenario(str(folder / "crossing.yaml"))
    left_out = {"name", "waypoints", "segment_duration", "time_law", "working_mode", "blend_radius", "force"}
    scenario = before.model_dump(mode="json", exclude=left_out, exclude_defaults=True)
    steps = [{"move": [0.0, 0.13]}, {"move": [*BEYOND], "mode": "-"}, {"move": [*HOME], "mode": "+"}]
    file = folder / "program.yaml"
    file.write_text(json.dumps({"name": "steps", "start": [*HOME], "scenario": scenario, "steps": steps}))
    loaded = load_program(file)
    motion = scenario_of_program(loaded, file.name)
    loading = watch.lap()
    plan_program(loaded, motion, file.name)
    return Times(loading, watch.lap())


def _live(folder: Path, watch: Watch) -> Times:
    from fivebar_bringup.scenarios.scenario_files import load_scenario
    from fivebar_control.planning.order_planning import planner_of
    from fivebar_control.planning.orders import PlanningRequest
    from fivebar_control.scenario.goal_conditions import conditions_of

    file = folder / "crossing.yaml"
    scenario = load_scenario(str(file))
    planner = "fivebar_bringup.motions.planner_with_odds:planner_of"
    conditions = conditions_of(scenario, True)._replace(
        planner=planner, file=str(file), odds_time=scenario.risk.odds_time
    )
    plan = planner_of(conditions)
    loading = watch.lap()
    laps = []
    for goal in (BEYOND, BESIDE):
        plan(PlanningRequest(HOME, scenario.working_mode, goal, -1, 0.0))
        laps.append(watch.lap())
    return Times(loading, *laps)


def _scenario(folder: Path, watch: Watch) -> Times:
    from fivebar_bringup.runs.admission import load_with_odds

    loading = watch.lap()
    load_with_odds(str(folder / "crossing.yaml"))
    first = watch.lap()
    load_with_odds(str(folder / "crossing.yaml"))
    return Times(loading, first, watch.lap())


def _case(folder: Path, watch: Watch) -> Times:
    from fivebar_studies.sweep.sweep import SweepSettings, run_numbered

    settings = SweepSettings(seed=1, rig=RIG, controllers=("unified",))
    for number in range(CASES, CASES + WARM):
        run_numbered(settings, number)
    loading = watch.lap()
    for number in range(CASES):
        run_numbered(settings, number)
    processor, clock = watch.lap()
    return Times(loading, None, (processor / CASES, clock / CASES))


KINDS: dict[str, Callable[[Path, Watch], Times]] = {
    "goto": _goto,
    "goto, refused after all others": partial(_goto, torque=WEAK, refused=True),
    "program of three moves": _program,
    "live request": _live,
    "scenario": _scenario,
    "case of a sweep": _case,
}
"""Measurements by name."""


if __name__ == "__main__":
    main()
