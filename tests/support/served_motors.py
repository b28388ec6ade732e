# SPDX-License-Identifier: Apache-2.0
"""Two emulated drives on a bus within the process of a test, and the file of the bridge to them."""

from __future__ import annotations

import itertools
import re
import threading
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from closed_posture import closed_posture

from fivebar_control.hardware.fault import DriveError
from fivebar_control.hardware.motors_file import MotorsFile, load_motors
from fivebar_control.hardware.two_motors import TwoMotors
from fivebar_description.strict_yaml import validate
from fivebar_sim.motors.configuration import MotorsEmulationFile
from fivebar_sim.motors.emulation import MotorLink, MotorsEmulation

UNHURRIED = {"period_us": 20_000, "gather_deadline_us": 19_000, "missing_limit": 1000, "watchdog_ms": 5000}
"""For both sides as far as they have the keys: for tests that are not about time."""


def virtual_link(name: str) -> dict[str, Any]:
    """Return the bus of a vendor's drives, which both sides name."""
    return {"interface": "virtual", "channel": name}


def bridge_file(name: str, **changed: Any) -> MotorsFile:
    """Return a shipped configuration on the virtual bus, with other keys."""
    content = load_motors(name).model_dump(mode="json")
    return validate({**content, **UNHURRIED, "link": virtual_link(name), **changed}, MotorsFile, "test")


@contextmanager
def served(
    name: str,
    open_link: Callable[[MotorsEmulationFile], MotorLink],
    errors: Collection[str],
    ids: tuple[int, int],
    watchdog_ms: int = UNHURRIED["watchdog_ms"],
    motors: tuple[dict[str, Any], dict[str, Any]] = ({}, {}),
    period_us: int = 2000,
    **link: Any,
) -> Iterator[MotorsEmulation]:
    """Serve two emulated drives in a thread, with further keys of the motors and of the section `link`."""
    facts = {
        joint: {"id": number, "counts_per_revolution": 20000, **others}
        for joint, number, others in zip(("q11", "q21"), ids, motors, strict=True)
    }
    content = {"name": "test", "robot": "dextar", "initial_joints": closed_posture(), "watchdog_ms": watchdog_ms}
    content |= {"motors": facts, "period_us": period_us, "link": {**virtual_link(name), **link}}
    file = validate(content, MotorsEmulationFile, "test")
    emulation, ending = MotorsEmulation(file, open_link, errors), threading.Event()
    thread = threading.Thread(target=emulation.run, args=(ending,))
    thread.start()
    try:
        yield emulation
    finally:
        ending.set()
        thread.join()
        emulation.close()


def enabled(motors: TwoMotors) -> TwoMotors:
    """Return drives with power."""
    motors.set_up()
    motors.enable(2.0)
    return motors


def fault_of(motors: TwoMotors) -> str:
    """Return the fault that drives report within some cycles."""
    return str(next(fault for _ in range(50) if (fault := motors.exchange().fault) is not None))


def expect_an_error_until_it_is_reset(
    emulation: MotorsEmulation, motors: TwoMotors, cycles: int, order: str, fault: str
) -> None:
    """Expect of drives that are enabled that an error some cycles later takes their torque until somebody resets it."""
    motors.write((0.2, -0.2))
    for _ in range(cycles):
        assert motors.exchange().fault is None
    emulation.obey(order)
    assert fault_of(motors) == fault
    assert not motors.enabled
    # it stays until somebody resets it
    assert fault_of(motors) == fault
    assert [motor.torque for motor in emulation.motors.motors] == [0.0, 0.0]
    emulation.obey("mend")
    motors.reset(2.0)
    motors.enable(2.0)
    motors.close()


def expect_a_pulled_cable_to_be_a_fault(emulation: MotorsEmulation, motors: TwoMotors, order: str, silent: str) -> None:
    """Expect of drives that are enabled, and may miss three answers, that they lose their power for a fourth."""
    emulation.obey(order)
    assert re.match(rf"feedback_missing: {silent}: no answer in 4 cycles in a row", fault_of(motors))
    assert not motors.enabled
    assert dict(motors.unused)["missing_answers"] >= 4
    emulation.obey("mend")
    motors.close()


def expect_torques_that_have_acted(motors: TwoMotors) -> None:
    """Expect of drives that are enabled that an answer has the torque that acted until the command, and not its own."""
    for before, torques in itertools.pairwise([(0.0, 0.0), (1.0, -1.0), (-0.5, 0.25), (0.0, 0.75)]):
        motors.write(torques)
        readings = motors.exchange().readings
        assert [None if one is None else one.torque for one in readings] == pytest.approx(before)


MISPLACED = ("swapped", "reversed", "geared", "zero")
"""How motors may differ from the bridge's file."""


def misplaced(how: str, ids: tuple[int, int]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return keys of both motors that differ from the bridge's file."""
    return {
        "swapped": ({"id": ids[1]}, {"id": ids[0]}),
        "reversed": ({"sign": -1}, {}),
        "geared": ({}, {"gear_ratio": 2.0}),
        "zero": ({"zero_rad": 0.1}, {}),
    }[how]


def posture_of(emulation: MotorsEmulation) -> dict[str, float]:
    """Return the section `posture` of a bridge's file for a robot that stands where its emulation begins."""
    angles = (motor.joint_angle for motor in emulation.motors.motors)
    return {**dict(zip(("q11", "q21"), angles, strict=True)), "tolerance_rad": 0.02}


def expect_no_power_where_it_stands(emulation: MotorsEmulation, motors: TwoMotors) -> None:
    """Expect that drives whose posture is not the declared one are refused, and have no power."""
    motors.set_up()
    with pytest.raises(DriveError, match=r"posture_unconfirmed: q.1 reads .* declared"):
        motors.confirm_start(2.0)
    assert not any(motor.powered for motor in emulation.motors.motors)
    motors.close()
