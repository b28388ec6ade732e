# SPDX-License-Identifier: Apache-2.0
"""The rig of the tutorial: a crossing on emulated moteus drives by the vendor's library, and ways in which it ends."""

from __future__ import annotations

import math
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import moteus
import numpy as np
import pytest
from doc_blocks import DOCS, blocks
from served_motors import served, virtual_link

import fivebar
from fivebar_control.model.kinematics import state_from_joints
from fivebar_description.robot_file import load_robot
from fivebar_moteus_emulation import moteus_bus as emulated
from fivebar_sim.motors.emulation import MotorsEmulation

SAMPLE = 40
"""Sample at which something happens."""


def shown(file: str) -> ModuleType:
    """The module that the tutorial shows under a name."""
    module = ModuleType(Path(file).stem)
    text = next(block.text for block in blocks(DOCS / "tutorials/own_loop.md") if block.file == file)
    exec(compile(text, file, "exec"), vars(module))
    return module


class Rig(NamedTuple):
    """Emulated drives with power, the controller, and the modules of the tutorial."""

    emulation: MotorsEmulation
    drives: Any
    control: fivebar.Controller
    loop: ModuleType

    def torques(self) -> list[float]:
        return [motor.torque for motor in self.emulation.motors.motors]

    def follow(self, read: Callable[[], Any] | None = None) -> None:
        self.loop.follow(self.control, read or self.drives.read, self.drives.write)

    def once(self, what: Callable[[], Any]) -> Callable[[], Any]:
        """A `read` that does something at a sample, and returns what that returns, if anything."""
        numbers = iter(range(10**6))

        def read() -> Any:
            found = what() if next(numbers) == SAMPLE else None
            return found if found is not None else self.drives.read()

        return read


@contextmanager
def powered(watchdog: float = 5.0, **keys: Any) -> Iterator[Rig]:
    loop, drives = shown("rig.py"), shown("moteus_drives.py")
    # a busy machine is late, and that is one test's subject
    vars(loop)["LATEST"] = math.inf
    vars(drives).update(WATCHDOG=watchdog, TIMEOUT=0.2)
    with served("moteus", emulated.MoteusBus, emulated.ERRORS, (1, 2)) as emulation:
        scenario = fivebar.load_scenario("middle_moteus", plant={"delay_samples": 0}, **keys)
        control = fivebar.Controller(scenario)
        made = vars(drives)["Drives"](moteus.Transport(moteus.PythonCanDevice(**virtual_link("moteus"))))
        for _ in range(10):
            made.write((0.0, 0.0))
        yield Rig(emulation, made, control, loop)


@pytest.mark.extra
def test_it_crosses_and_ends_with_zero_torque() -> None:
    with powered() as rig:
        way: list[tuple[float, float]] = []

        def read() -> Any:
            exact = rig.emulation.motors.plant.truth()
            state = state_from_joints(load_robot("dextar"), *exact.position, *exact.velocity)
            way.append((state.x, state.y))
            return rig.drives.read()

        rig.follow(read)
        path = rig.control._control.scenario.plan().path
        far = [math.dist(at, path.at(number / 500)[:2]) for number, at in enumerate(way)]
        assert rig.control.fault is None and len(way) == 1001
        assert max(far) < 1e-3 and np.array(way)[:, 1].min() < 0.021
        assert rig.torques() == [0.0, 0.0]


def unplugged(rig: Rig) -> None:
    rig.emulation.obey("unplug")


def silent(rig: Rig) -> None:
    rig.emulation.obey("silent 1")


def frozen(rig: Rig) -> None:
    rig.emulation.obey("frozen 1")


def in_fault(rig: Rig) -> None:
    rig.emulation.obey("fault 2 UNDER_VOLTAGE")


def interrupted(rig: Rig) -> None:
    signal.raise_signal(signal.SIGINT)


def failed(rig: Rig) -> None:
    raise ZeroDivisionError("a reading that cannot be computed")


def not_a_number(rig: Rig) -> Any:
    return fivebar.SensorReadings(motor_angles=(math.nan, 1.0))


def jumped(rig: Rig) -> Any:
    found = rig.drives.read()
    return found._replace(motor_angles=(found.motor_angles[0] + 0.3, found.motor_angles[1]))


def back_in_time(rig: Rig) -> Any:
    return rig.drives.read()._replace(time=0.0)


ENDS: list[tuple[Callable[[Rig], Any], type[BaseException], str]] = [
    (interrupted, KeyboardInterrupt, ""),
    (failed, ZeroDivisionError, "cannot be computed"),
    (not_a_number, fivebar.InputError, r"motor_angles: .*nan"),
    (back_in_time, fivebar.InputError, "time: 0: it goes back"),
    (jumped, RuntimeError, "estimate_inconsistent"),
    (in_fault, RuntimeError, r"drive 2: mode 1, fault 40"),
    (silent, RuntimeError, "state_stale: no sample after"),
    (unplugged, RuntimeError, "state_stale: no sample after"),
    (frozen, RuntimeError, r"encoder_frozen|estimate_inconsistent"),
]


@pytest.mark.extra
@pytest.mark.parametrize(("what", "error", "words"), ENDS)
def test_whatever_ends_it_the_last_torque_is_zero(what: Any, error: type[BaseException], words: str) -> None:
    with powered(watchdog=0.5) as rig:
        with pytest.raises(error, match=words):
            rig.follow(rig.once(lambda: what(rig)))
        # where no command arrives any more, the drive's own watchdog takes it
        deadline = threading.Event()
        for _ in range(400):
            if not any(rig.torques()):
                break
            deadline.wait(0.01)
        assert rig.torques() == [0.0, 0.0]


@pytest.mark.extra
def test_a_period_that_is_too_long_ends_it() -> None:
    with powered() as rig:
        vars(rig.loop)["LATEST"] = -1.0
        with pytest.raises(TimeoutError, match=r"sample 0 ended -?[0-9]+ ms late"):
            rig.follow()
        assert rig.torques() == [0.0, 0.0]


def test_a_robot_that_stands_elsewhere_gets_no_torque() -> None:
    with powered(waypoints=[[0.0, 0.12], [0.0, 0.02]]) as rig:
        with pytest.raises(fivebar.InputError, match="homing_contradicted"):
            rig.follow()
        assert rig.torques() == [0.0, 0.0]
