"""A practice by the clock: a robot in another process, behind a bus, a topic and a hand."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest
from fivebar_command import FivebarCommand

from fivebar_bringup.commission.practice import drawn_practice, read_practice
from fivebar_bringup.commission.record import STATE_FILE, CommissionState
from fivebar_bringup.commission.session import DRIVES_FILE
from fivebar_bringup.commission.steps.begin import PRACTICE_FILE
from fivebar_control.hardware.motors_file import load_motors
from fivebar_description.strict_yaml import read_yaml, yaml_text

pytestmark = [pytest.mark.clock, pytest.mark.extra]

WATCHDOG_MS = 200
"""Long enough for a machine with other work."""


def test_drives_are_put_right_by_the_clock(fivebar: Callable[..., FivebarCommand], folder: Path) -> None:
    practice, out = folder / "patient.yaml", folder / "out"
    practice.write_text(yaml_text(drawn_practice("dextar", 1) | {"watchdog_ms": WATCHDOG_MS}))
    limits = ("--torque", "3", "--speed", "12")
    call = fivebar(
        *("commission", "dextar", *limits, "--practice", str(practice), "--realtime"),
        *("--until", "zero", "--out", str(out)),
    )
    # machine code of the simulated robot may be compiled meanwhile
    assert call.wait(500.0) == 0, call.stdout + call.stderr
    state, true = read_yaml(out / STATE_FILE, CommissionState), read_practice(out / PRACTICE_FILE)
    assert state.realtime
    assert [(one.step, one.outcome) for one in state.steps] == [
        (step, "passed") for step in ("parts", "signs", "breakaway", "zero")
    ]
    for found, motor in zip(load_motors(str(out / DRIVES_FILE)).pair, true.pair, strict=True):
        assert found.sign == motor.sign
        # as well as a hand puts it on a mark
        assert abs(found.zero_rad - motor.zero_rad) < math.radians(1.0)
    call.expect_no_process(0.0)
