# SPDX-License-Identifier: Apache-2.0
"""Names of the board's faults, and what clears each."""

from __future__ import annotations

from collections.abc import Mapping

from fivebar_control.fault import Fault
from fivebar_description.interface import ACTIVE_JOINTS

CONTROL_FAULT = 1 << 2
CAUSE_SHIFT = 3

BUTTON = 9

CAUSES = {
    0: ("board_fault", "the firmware names no cause"),
    1: ("board_driver", "the motor driver signals a fault: over-current, over-temperature or under-voltage"),
    2: ("board_current_feedback", "the current feedback is invalid or stale"),
    3: ("board_adc_skipped", "the ADC skipped a frame"),
    4: ("board_adc_phase", "the ADC measured outside of its half of the PWM cycle"),
    5: ("board_encoder", f"the encoder of motor 0 ({ACTIVE_JOINTS[0]}) is stale"),
    6: ("board_encoder", f"the encoder of motor 1 ({ACTIVE_JOINTS[1]}) is stale"),
    7: ("board_not_finite", "the control's result was not finite"),
    8: ("board_pwm_late", "the PWM output missed its deadline"),
    BUTTON: ("emergency_button", "the emergency stop button was pressed"),
}
"""Name and meaning of each cause of a control fault."""

OF_BOARD = "correct the cause, reset the board by its own reset or its power, then reset here, which reopens the port"
OF_BUTTON = "release the button, hold it again for 3 s until the board has recovered, then reset here"

_RESET_BOARD = "Reset the board by its own reset or its power, then reset and enable."

FAULTS: Mapping[str, tuple[str, str]] = {
    **{name: (f"Control fault of the board: {meaning}.", _RESET_BOARD) for name, meaning in CAUSES.values()},
    "board_driver": (f"Control fault of the board: {CAUSES[1][1]}.", f"Check supply and wiring. {_RESET_BOARD}"),
    "board_encoder": (
        "Control fault of the board: the encoder of a motor is stale.",
        f"Check the encoder's cable and magnet. {_RESET_BOARD}",
    ),
    "emergency_button": (
        "The emergency stop button was pressed.",
        "Release it, hold it again for 3 s, then reset and enable.",
    ),
    "motors_not_ready": (
        "The board's saved calibration or a start-up check is missing.",
        f"Calibrate. {_RESET_BOARD}",
    ),
    "posture_unconfirmed": (
        "On activate: the robot does not stand where its motion starts.",
        "Move it there, or calibrate the zero.",
    ),
    "feedback_missing": (
        "No state came in more than missing_limit cycles.",
        "Check cable, hub and load of the computer, then reset and enable.",
    ),
    "command_lost": (
        "States come, but no echo of more than missing_limit commands.",
        "Check cable, hub and load of the computer, then reset and enable.",
    ),
    "board_lost": (
        "The port is gone: a torn cable, or a board without power.",
        "Plug it in, then reset and enable.",
    ),
    "port_missing": (
        "On configure or reset: the port cannot be opened.",
        "Check its name, permissions and cable.",
    ),
    "board_missing": (
        "On configure, activate or reset: the port is there, but no board answers.",
        "Look for another device on that port, and at the firmware.",
    ),
}
"""Meaning and recovery of the faults."""


def fault_of(flags: int) -> Fault | None:
    """Return the fault that the flags of a state report; None while both motors are ready and none is there."""
    if flags & CONTROL_FAULT:
        cause = flags >> CAUSE_SHIFT
        name, meaning = CAUSES.get(cause, ("board_fault", "the cause is unknown to this program"))
        return Fault(name, f"cause {cause}: {meaning}; {OF_BUTTON if cause == BUTTON else OF_BOARD}")
    missing = [joint for bit, joint in enumerate(ACTIVE_JOINTS) if not flags & 1 << bit]
    if missing:
        return Fault(
            "motors_not_ready",
            f"{' and '.join(missing)}: the board's saved calibration or its start-up checks are missing; {OF_BOARD}",
        )
    return None
