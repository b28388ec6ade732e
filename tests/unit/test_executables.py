# SPDX-License-Identifier: Apache-2.0
"""Every executable hears signals before it loads anything large, and then ends at once without a traceback."""

from __future__ import annotations

import functools
import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from console_scripts import console_scripts

from fivebar_description.executable import Executable
from fivebar_description.interrupts import STOP_SIGNALS

SERVICES = {name: entry for name, entry in console_scripts().items() if name != "fivebar"}

STARTED = """
import json, os, signal, sys

class Interrupting:
    def find_spec(self, name, path, target=None):
        if name == {interrupted!r}:
            os.write(1, json.dumps(sorted({{name.partition(".")[0] for name in sys.modules}})).encode())
            os.kill(os.getpid(), signal.{number.name})

for number in {ignored}:
    signal.signal(number, signal.SIG_IGN)
signal.pthread_sigmask(signal.SIG_BLOCK, {blocked})
sys.meta_path.insert(0, Interrupting())
sys.argv = [{name!r}, *{arguments}]
from {module} import {name}
sys.exit({name}())
"""
"""What the script of an entry point does, with a signal while a module is searched for."""


def interrupted(
    name: str,
    place: str,
    number: signal.Signals,
    *arguments: str,
    ignored: tuple[int, ...] = (),
    blocked: tuple[int, ...] = (),
) -> tuple[int, str, str]:
    """Return exit status, standard error and output of an executable, which begins with the packages loaded so far."""
    program = STARTED.format(
        interrupted=place,
        number=number,
        name=name,
        module=SERVICES[name].module,
        arguments=[*arguments],
        ignored=[*map(int, ignored)],
        blocked=[*map(int, blocked)],
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False)
    return done.returncode, done.stderr, done.stdout


@functools.cache
def loaded_by_python() -> frozenset[str]:
    """Return the packages that Python has loaded when it begins with a program."""
    shown = subprocess.run(
        [sys.executable, "-c", "import sys; print(*sys.modules)"], capture_output=True, text=True, check=True
    )
    return frozenset(name.partition(".")[0] for name in shown.stdout.split())


@pytest.mark.parametrize("name", SERVICES)
def test_a_signal_ends_an_executable_that_loads(name: str) -> None:
    program = SERVICES[name].load()
    assert isinstance(program, Executable)
    assert SERVICES[name].module == f"{program.package or program.module.partition('.')[0]}.executables"
    number = STOP_SIGNALS[list(SERVICES).index(name) % len(STOP_SIGNALS)]
    status, errors, loaded = interrupted(name, program.module, number)
    assert (status, errors) == (0, "")
    # an interrupt before this point is Python's own, and so is what the environment loads with it
    own = {"fivebar_description", program.module.partition(".")[0], program.package, "__main__"}
    assert set(json.loads(loaded)) <= {*sys.stdlib_module_names, *own, *loaded_by_python()}


@pytest.mark.parametrize("number", STOP_SIGNALS)
def test_a_signal_ends_a_node_that_loads_ros(number: signal.Signals) -> None:
    status, errors, _ = interrupted("ctc_controller", "rclpy.impl.implementation_singleton", number)
    assert (status, errors) == (0, "")


def test_a_signal_ends_a_node_that_is_about_to_compile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It would say after some seconds that it compiles, and end a minute later."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    words = ("--ros-args", "-p", "scenario:=gyro_middle", "-p", "mode:=realtime")
    place = "fivebar_control.estimation.compiled_estimator"
    status, errors, _ = interrupted("state_estimator", place, signal.SIGTERM, *words)
    assert (status, errors) == (0, "")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("number", STOP_SIGNALS)
@pytest.mark.parametrize("how", ["ignored", "blocked"])
def test_a_service_hears_signals_whoever_has_started_it_but_a_hangup_under_nohup(
    how: str, number: signal.Signals
) -> None:
    """A shell's job in the background ignores Ctrl-C; a starter may block signals until they are handled."""
    place = SERVICES["emulated_board"].load().module
    status, errors, _ = interrupted("emulated_board", place, number, "--no-such-option", **{how: STOP_SIGNALS})
    went_on = how == "ignored" and number == signal.SIGHUP
    assert (status, "--no-such-option" in errors) == ((2, True) if went_on else (0, False))


def test_a_node_whose_package_is_missing_is_refused_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        Executable("fivebar_missing.nodes.some_bridge", "", "fivebar_control")._confirm_there()
    assert ended.value.code == 2
    assert capsys.readouterr().err.startswith("some_bridge: needs the package fivebar_missing, which is not installed")


def answer(name: str, *words: str) -> tuple[int, str, str]:
    """Return exit status, output and errors of an executable with some words."""
    program = f"import sys; sys.argv = [{name!r}, *{list(words)}]; from {SERVICES[name].module} import {name}; {name}()"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False)
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize("name", ["supervisor", "node_group", "emulated_board", "camera", "vision_listener", "viewer"])
def test_an_executable_explains_itself(name: str) -> None:
    status, told, errors = answer(name, "--help")
    assert (status, errors) == (0, "")
    program = SERVICES[name].load()
    assert name in told
    assert len(told) > 150
    if program.example is not None:
        assert f"ros2 run {SERVICES[name].dist.name} {name} --ros-args {program.example}" in told


@pytest.mark.parametrize("word", ["-p", "scenario:=middle", "middle"])
def test_a_node_refuses_words_that_ros_would_ignore(word: str) -> None:
    status, told, errors = answer("supervisor", word)
    assert (status, told, errors.count("\n")) == (2, "", 1)
    assert word in errors
    assert "ros2 run fivebar_control supervisor --ros-args -p scenario:=middle" in errors
