# SPDX-License-Identifier: Apache-2.0
"""Faults of drives on a CAN bus (CiA 402) and of their bridge; those of other interfaces stand beside their drivers."""

from __future__ import annotations

from collections.abc import Mapping

FAULTS: Mapping[str, tuple[str, str]] = {
    "command_stale": (
        "No torque came for command_timeout_ms, or it answers too old a sample.",
        "Find the node that stopped (`fivebar status`), then reset and enable.",
    ),
    "emergency_stop": ("The service was called; both drives are off.", "Reset and enable."),
    "drive_fault": (
        "A drive is in its fault state; the message has statusword and emergency code.",
        "Remove the cause, then reset and enable.",
    ),
    "drive_emergency": (
        "A drive sent an emergency message without a fault, such as for its temperature.",
        "Remove the cause, then reset and enable.",
    ),
    "drive_dropped_out": (
        'A drive left "operation enabled" unasked: safe torque off, missing voltage.',
        "Remove the cause, then reset and enable.",
    ),
    "drive_lost": (
        "The heartbeat of a drive is older than heartbeat_timeout_ms.",
        "Check cable and power; reset and enable if the drive kept its set-up, else configure again.",
    ),
    "drive_restarted": ("A drive's heartbeat reports that it is not operational.", "Configure again."),
    "feedback_invalid": (
        "A driver read a position or speed that is no finite number.",
        "Look at the driver, reset.",
    ),
    "feedback_missing": (
        "More than missing_limit consecutive cycles were without a drive's answer.",
        "Check load of the bus, cable and gather_deadline_us, then reset and enable.",
    ),
    "encoder_frozen": (
        "The count stays while stall or the estimator expects motion.",
        "Check the encoder's cable and whether the joint is blocked, then start a new run.",
    ),
    "posture_unconfirmed": (
        "On activate: the robot does not stand where its motion starts.",
        "Move it there, or correct the encoders' zero.",
    ),
    "bus_error": (
        "A frame could not be sent: the interface is down, or no node acknowledges.",
        "Check the interface, then reset and enable.",
    ),
    "bus_off": (
        "The CAN controller has left the bus.",
        "Check cable, bit rate and termination, set the interface down and up, then configure again.",
    ),
    "bus_missing": ("On configure: the interface cannot be opened.", "Check `ip link` and the name of the channel."),
    "drive_missing": (
        "On configure: a drive does not answer, or has no heartbeat after the start.",
        "Check power, node id, bit rate and termination.",
    ),
    "drive_identity": ("On configure: this is not the configured drive.", "Check cabling, or `identity` in the file."),
    "drive_scale": ("On configure: object 0x6076 contradicts rated_torque_nm.", "Correct the file."),
    "drive_mode": (
        "On configure: object 0x6061 does not become 10, the torque mode.",
        "Check the drive's licence or firmware.",
    ),
    "drive_setup": ("On configure: an object was refused; the message names it.", "Look into the drive's manual."),
    "drive_stuck": (
        "A drive was not enabled, disabled or reset within enable_timeout_s.",
        "Check safe torque off and the DC link's voltage, then reset and enable.",
    ),
}
"""Meaning and recovery of the faults."""
