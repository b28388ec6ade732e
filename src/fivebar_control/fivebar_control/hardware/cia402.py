# SPDX-License-Identifier: Apache-2.0
"""The power state machine of CiA 402 (IEC 61800-7-201): decoding statuswords and choosing the next controlword.

The tables are those of `canopen`; which transition to take towards a power state is decided here, because `canopen`'s
own node walks through all of them and waits in between, which a control cycle cannot.
"""

from __future__ import annotations

from enum import Enum

from canopen.profiles.p402 import State402


class DriveState(Enum):
    """State of a drive; UNKNOWN is a statusword that the standard does not define."""

    NOT_READY = "not ready to switch on"
    SWITCH_ON_DISABLED = "switch on disabled"
    READY = "ready to switch on"
    SWITCHED_ON = "switched on"
    ENABLED = "operation enabled"
    QUICK_STOP = "quick stop active"
    FAULT_REACTION = "fault reaction active"
    FAULT = "fault"
    UNKNOWN = "unknown"


class PowerTarget(Enum):
    """The power state that a drive is to reach.

    OFF removes power at once, QUICK_STOP lets the drive stop in its own way (0x605A), DISABLED steps down in order,
    ENABLED steps up.
    """

    OFF = "off"
    QUICK_STOP = "stopped"
    DISABLED = "disabled"
    ENABLED = "enabled"


STATUS_TABLE = tuple((mask, value, DriveState(name.lower())) for name, (mask, value) in State402.SW_MASK.items())
"""Mask, value under the mask, state. No word fits two rows."""


def _controlword(before: DriveState, after: DriveState) -> int:
    word: int = State402.TRANSITIONTABLE[before.value.upper(), after.value.upper()]
    return word


DISABLE_VOLTAGE = _controlword(DriveState.ENABLED, DriveState.SWITCH_ON_DISABLED)
STOP_QUICKLY = _controlword(DriveState.ENABLED, DriveState.QUICK_STOP)
SHUTDOWN = _controlword(DriveState.SWITCH_ON_DISABLED, DriveState.READY)
SWITCH_ON = _controlword(DriveState.READY, DriveState.SWITCHED_ON)
ENABLE_OPERATION = _controlword(DriveState.SWITCHED_ON, DriveState.ENABLED)
FAULT_RESET = _controlword(DriveState.FAULT, DriveState.SWITCH_ON_DISABLED)

FAULT_RESET_SEQUENCE = (DISABLE_VOLTAGE, FAULT_RESET, DISABLE_VOLTAGE)
"""Reset acts on the rising edge of bit 7; the last word leaves the drive disabled."""

_ENABLING = {
    DriveState.SWITCH_ON_DISABLED: SHUTDOWN,
    DriveState.READY: SWITCH_ON,
    DriveState.SWITCHED_ON: ENABLE_OPERATION,
    DriveState.ENABLED: ENABLE_OPERATION,
}

_DISABLING = {
    DriveState.ENABLED: SWITCH_ON,
    DriveState.SWITCHED_ON: SHUTDOWN,
}

_STOPPING = {
    DriveState.ENABLED: STOP_QUICKLY,
    DriveState.QUICK_STOP: STOP_QUICKLY,
}


def state_of(statusword: int) -> DriveState:
    """Return the state that a statusword (0x6041) encodes."""
    for mask, value, state in STATUS_TABLE:
        if statusword & mask == value:
            return state
    return DriveState.UNKNOWN


def next_controlword(state: DriveState, goal: PowerTarget) -> int:
    """Return the controlword (0x6040) that brings a drive one step nearer to the goal.

    A fault and an unknown word get `DISABLE_VOLTAGE`: nothing here resets a fault. So does a quick stop that is active,
    unless it is wanted.
    """
    if goal is PowerTarget.ENABLED:
        return _ENABLING.get(state, DISABLE_VOLTAGE)
    if goal is PowerTarget.DISABLED:
        return _DISABLING.get(state, DISABLE_VOLTAGE)
    if goal is PowerTarget.QUICK_STOP:
        return _STOPPING.get(state, DISABLE_VOLTAGE)
    return DISABLE_VOLTAGE


def reached(state: DriveState, goal: PowerTarget) -> bool:
    """Return whether a drive is where it should be; a drive in fault is off, too."""
    if goal is PowerTarget.ENABLED:
        return state is DriveState.ENABLED
    if goal is PowerTarget.QUICK_STOP and state is DriveState.QUICK_STOP:
        return True
    return state in (DriveState.SWITCH_ON_DISABLED, DriveState.NOT_READY, DriveState.FAULT)
