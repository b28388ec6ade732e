"""The power state machine of CiA 402 (IEC 61800-7-201): what a statusword says and which controlword comes next."""

from __future__ import annotations

from enum import Enum


class State(Enum):
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


class Goal(Enum):
    """What we want of a drive.

    OFF removes power at once, QUICK_STOP lets the drive stop in its own way (0x605A), DISABLED steps down in order,
    ENABLED steps up.
    """

    OFF = "off"
    QUICK_STOP = "stopped"
    DISABLED = "disabled"
    ENABLED = "enabled"


STATUS_TABLE = (
    (0x4F, 0x00, State.NOT_READY),
    (0x4F, 0x40, State.SWITCH_ON_DISABLED),
    (0x6F, 0x21, State.READY),
    (0x6F, 0x23, State.SWITCHED_ON),
    (0x6F, 0x27, State.ENABLED),
    (0x6F, 0x07, State.QUICK_STOP),
    (0x4F, 0x0F, State.FAULT_REACTION),
    (0x4F, 0x08, State.FAULT),
)
"""Mask, value under the mask, state. No word fits two rows."""

DISABLE_VOLTAGE = 0x00
STOP_QUICKLY = 0x02
SHUTDOWN = 0x06
SWITCH_ON = 0x07
ENABLE_OPERATION = 0x0F
FAULT_RESET = 0x80

FAULT_RESET_SEQUENCE = (DISABLE_VOLTAGE, FAULT_RESET, DISABLE_VOLTAGE)
"""Reset acts on the rising edge of bit 7; the last word leaves the drive without any wish to be enabled."""

_ENABLING = {
    State.SWITCH_ON_DISABLED: SHUTDOWN,
    State.READY: SWITCH_ON,
    State.SWITCHED_ON: ENABLE_OPERATION,
    State.ENABLED: ENABLE_OPERATION,
}

_DISABLING = {
    State.ENABLED: SWITCH_ON,
    State.SWITCHED_ON: SHUTDOWN,
}

_STOPPING = {
    State.ENABLED: STOP_QUICKLY,
    State.QUICK_STOP: STOP_QUICKLY,
}

POWERED = frozenset({State.SWITCHED_ON, State.ENABLED, State.QUICK_STOP, State.FAULT_REACTION})
"""States in which the power stage may be live."""


def state_of(statusword: int) -> State:
    """Return the state that a statusword (0x6041) tells."""
    for mask, value, state in STATUS_TABLE:
        if statusword & mask == value:
            return state
    return State.UNKNOWN


def next_controlword(state: State, goal: Goal) -> int:
    """Return the controlword (0x6040) that brings a drive one step nearer to the goal.

    A fault and an unknown word get `DISABLE_VOLTAGE`: nothing here resets a fault. So does a quick stop that is active,
    unless it is wanted.
    """
    if goal is Goal.ENABLED:
        return _ENABLING.get(state, DISABLE_VOLTAGE)
    if goal is Goal.DISABLED:
        return _DISABLING.get(state, DISABLE_VOLTAGE)
    if goal is Goal.QUICK_STOP:
        return _STOPPING.get(state, DISABLE_VOLTAGE)
    return DISABLE_VOLTAGE


def reached(state: State, goal: Goal) -> bool:
    """Return whether a drive is where it should be; a drive in fault is off, too."""
    if goal is Goal.ENABLED:
        return state is State.ENABLED
    if goal is Goal.QUICK_STOP and state is State.QUICK_STOP:
        return True
    return state in (State.SWITCH_ON_DISABLED, State.NOT_READY, State.FAULT)
