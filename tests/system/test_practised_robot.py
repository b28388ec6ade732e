# SPDX-License-Identifier: Apache-2.0
"""A practice by the clock: a robot in another process, behind a bus, a topic and a hand."""

from __future__ import annotations

import math
import os
import signal
import struct
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from fivebar_command import FivebarCommand, InstalledCommand

from fivebar_commission.practice import drawn_practice, read_practice
from fivebar_commission.record import STATE_FILE, CommissionState
from fivebar_commission.session import DRIVES_FILE
from fivebar_commission.steps.begin import PRACTICE_FILE
from fivebar_control.hardware.can_port import open_bus
from fivebar_control.hardware.configuration import Bus
from fivebar_control.hardware.motors_file import load_motors
from fivebar_description.strict_yaml import read_yaml, validate, yaml_text
from fivebar_odrive.odrive import IDLE, SET_AXIS_STATE, SET_INPUT_TORQUE

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


def test_ctrl_c_leaves_the_robot_without_torque_and_prints_no_traceback(folder: Path) -> None:
    practice, out = folder / "left.yaml", folder / "left"
    practice.write_text(yaml_text(drawn_practice("dextar", 1) | {"watchdog_ms": WATCHDOG_MS}))
    call = InstalledCommand(
        *(folder / "call", "commission", "dextar", "--torque", "3", "--speed", "12"),
        *("--practice", str(practice), "--realtime", "--until", "breakaway", "--out", str(out)),
    )
    try:
        end = time.monotonic() + 500.0
        while not (out / PRACTICE_FILE).exists() and time.monotonic() < end:
            time.sleep(0.05)
        torques, states = {1: 0.0, 2: 0.0}, dict[int, int]()
        left, link = False, dict(read_practice(out / PRACTICE_FILE).link)
        bus = open_bus(validate(link, Bus, "link"), False)
        # the last frames of either drive, until nobody sends any
        with bus:
            while time.monotonic() < end:
                frame = bus.recv(1.0)
                if frame is None and call.status is not None:
                    break
                if frame is None or frame.is_remote_frame:
                    continue
                node, command = frame.arbitration_id >> 5, frame.arbitration_id & 31
                if command == SET_INPUT_TORQUE:
                    (torques[node],) = struct.unpack_from("<f", frame.data)
                elif command == SET_AXIS_STATE:
                    (states[node],) = struct.unpack_from("<I", frame.data)
                if torques[node] and not left:
                    # as a terminal does: to every process of the group
                    os.killpg(call.pid, signal.SIGINT)
                    left = True
        assert left, "there has been a torque"
        assert (torques, states) == ({1: 0.0, 2: 0.0}, {1: IDLE, 2: IDLE})
        assert call.wait(60.0) == 130
        assert "Traceback" not in call.stdout + call.stderr
        assert "the same command resumes" in call.stderr
        assert read_yaml(out / STATE_FILE, CommissionState).outcome_of("breakaway") is None
        call.expect_no_process(15.0)
    finally:
        call.close()
