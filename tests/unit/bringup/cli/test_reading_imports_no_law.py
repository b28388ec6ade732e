# SPDX-License-Identifier: Apache-2.0
"""What only reads a scenario or a run does not import the module of the law that these name."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from fivebar import load_run
from fivebar import simulate as simulate_in_python
from fivebar_bringup.cli.main import app
from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_bringup.report.report import read_analysis
from fivebar_bringup.runs.admission import load_admitted
from fivebar_bringup.runs.offline import run_offline
from fivebar_control.laws.registry import find_controller, unopened_step
from fivebar_description.errors import InputError
from fivebar_description.modules import modules_unopened

MODULE = "foreign_law_of_a_run"
FOREIGN = f"controller: {MODULE}:LAW"
MARK = "imported"
LAW = f"""
from pathlib import Path
Path({MARK!r}).write_text("")
from fivebar_control.laws.unified import LAW as UNIFIED
LAW = UNIFIED._replace(name="foreign")
"""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two runs whose scenarios name a law from elsewhere, one of them with an estimator."""
    folder = tmp_path_factory.mktemp("foreign")
    for name, scenario in (("run", "excitation_encoders"), ("estimated", "middle_encoders")):
        run_offline(load_admitted(scenario), folder / name, lambda done, total: None, with_page=False)
        path = folder / name / "scenario.yaml"
        text, count = re.subn(r"(?m)^controller: \w+$", FOREIGN, path.read_text(encoding="utf-8"))
        assert count == 1
        path.write_text(text.replace("\nlaw: {}\n", "\nlaw: {gain: 3.0}\n"), encoding="utf-8")
    return folder


@pytest.fixture
def foreign(recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The run, while the law's module lies in the working directory, in which modules are looked for."""
    (tmp_path / f"{MODULE}.py").write_text(LAW, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, MODULE, raising=False)
    return recorded / "run"


def called(*arguments: str) -> Result:
    return CliRunner().invoke(app, arguments)


@pytest.mark.parametrize(
    "arguments",
    [
        ("report", "ALL/estimated", "--json"),
        ("estimate", "ALL/estimated", "--set", "ekf.gyro_noise=0.02", "--json", "--out", "OUT"),
        ("estimate", "ALL/estimated/bag", "--json", "--out", "OUT"),
        ("identify", "RUN", "--json", "--out", "OUT"),
        ("calibrate", "RUN", "--json", "--out", "OUT", "--encoders-only"),
        ("urdf", "--scenario", "RUN/scenario.yaml"),
        ("model", "--scenario", "RUN/scenario.yaml"),
        ("settings",),
    ],
    ids=lambda arguments: " ".join(arguments[:2]),
)
def test_a_command_that_reads_works_without_the_law(foreign: Path, tmp_path: Path, arguments: tuple[str, ...]) -> None:
    words = [
        one.replace("RUN", str(foreign)).replace("ALL", str(foreign.parent)).replace("OUT", str(tmp_path / "out"))
        for one in arguments
    ]
    result = called(*words)
    assert result.exit_code == 0, result.output
    assert not (tmp_path / MARK).exists()


@pytest.mark.extra
def test_a_run_is_shown_with_the_torque_that_its_bag_has_of_the_law(foreign: Path, tmp_path: Path) -> None:
    run = load_run(foreign)
    assert run.summary.not_judged == []
    torque = run.columns()
    assert abs(torque["tau1_nominal"]).max() > 0.0
    with pytest.raises(InputError, match=f"controller: '{MODULE}:LAW': where a scenario or a run is only read"):
        simulate_in_python(run.scenario)
    assert not (tmp_path / MARK).exists()


@pytest.mark.extra
@pytest.mark.parametrize(("known", "lines"), [({}, 1), ({"stop_cycles": 4}, 0)])
def test_a_run_in_real_time_says_what_is_not_judged_without_the_law(
    foreign: Path, tmp_path: Path, known: dict[str, int], lines: int
) -> None:
    timing = foreign / "timing.json"
    before = timing.read_text(encoding="utf-8")
    timing.write_text(json.dumps({"runner": "ros", "mode": "realtime", **known}), encoding="utf-8")
    try:
        unknown = read_analysis(RunDirectory(foreign)).summary.not_judged
    finally:
        timing.write_text(before, encoding="utf-8")
    assert len(unknown) == lines
    assert all("timing.json has no stop_cycles" in one for one in unknown)
    assert not (tmp_path / MARK).exists()


def test_the_graph_is_shown_only_if_the_law_may_be_imported(tmp_path: Path, foreign: Path) -> None:
    scenario = tmp_path / "foreign.yaml"
    scenario.write_text(f"name: foreign\n{FOREIGN}\nwaypoints: [[0.0, 0.15], [0.0, 0.12]]\n", encoding="utf-8")
    refused = called("nodes", str(scenario), "--json")
    assert refused.exit_code == 2
    assert refused.stderr.count("\n") == 1
    assert "--import-law" in refused.stderr
    assert not (tmp_path / MARK).exists()
    shown = called("nodes", str(scenario), "--json", "--import-law")
    assert shown.exit_code == 0, shown.output
    assert "foreign/torque" in shown.stdout
    assert (tmp_path / MARK).exists()


def test_an_unopened_law_is_named_and_cannot_run(foreign: Path, tmp_path: Path) -> None:
    with modules_unopened():
        controller = find_controller(f"{MODULE}:LAW")
        assert controller.nominal.step is unopened_step
        assert find_controller("unified").nominal.step is not unopened_step
        with pytest.raises(InputError, match="expected one of"):
            find_controller("no such law")
    assert controller.nominal.title == f"{MODULE}:LAW"
    with pytest.raises(InputError, match="was not imported"):
        controller.nominal.step(None, None, None, None)  # type: ignore[arg-type]
    assert not (tmp_path / MARK).exists()
