# SPDX-License-Identifier: Apache-2.0
"""Faults of moteus drives: the vendor's names of their codes, and meaning and recovery of what the bridge reports."""

from __future__ import annotations

from collections.abc import Mapping

ERRORS = {
    32: "CALIBRATION_FAULT",
    33: "MOTOR_DRIVER_FAULT",
    34: "OVER_VOLTAGE",
    35: "ENCODER_FAULT",
    36: "MOTOR_NOT_CONFIGURED",
    37: "PWM_CYCLE_OVERRUN",
    38: "OVER_TEMPERATURE",
    39: "OUTSIDE_LIMIT",
    40: "UNDER_VOLTAGE",
    41: "CONFIG_CHANGED",
    42: "THETA_INVALID",
    43: "POSITION_INVALID",
    44: "DRIVER_ENABLE_FAULT",
    45: "STOP_POSITION_DEPRECATED",
    46: "TIMING_VIOLATION",
    47: "BEMF_FEEDFORWARD_NO_ACCEL",
    48: "INVALID_LIMITS",
    49: "POSITION_CONTROL_ERROR",
    50: "VELOCITY_CONTROL_ERROR",
}
"""Fault codes of the mode `fault`."""

FAULTS: Mapping[str, tuple[str, str]] = {
    "moteus_error": (
        "A drive is in fault and gives no torque; the message has the vendor's name and code.",
        "Remove the cause, then reset and enable.",
    ),
    "moteus_watchdog": (
        "A drive had no command for its watchdog's time and gives no torque.",
        "Look at the load of this machine and of the bus, then reset and enable.",
    ),
    "moteus_voltage": (
        "The supply is below what the drives are made for.",
        "Check supply and cables, then reset and enable.",
    ),
    "moteus_firmware": (
        "A drive has another firmware or register map than the bridge knows.",
        "Flash a release that docs/moteus.md names, with moteus_tool, then configure again.",
    ),
    "moteus_uncalibrated": (
        "Motor or encoder of a drive are not calibrated, or its position refers to nothing.",
        "Calibrate with moteus_tool, or home the encoder, then configure again.",
    ),
    "moteus_configuration": (
        "A setting of a drive does not fit torque control; the message says which one is expected.",
        "Set it with tview, and save by `conf write`, then configure again.",
    ),
    "drive_missing": ("A drive does not answer.", "Check power, id and bus, then configure again."),
    "feedback_missing": ("A drive has stopped to answer.", "Check cable, power and load of the bus, then reset."),
}
"""Meaning and recovery of the faults."""


def error_name(code: int) -> str:
    """Return the vendor's name of a fault code, with the code."""
    return f"{ERRORS.get(code, 'fault')} ({code})"
