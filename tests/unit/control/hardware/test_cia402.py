# SPDX-License-Identifier: Apache-2.0
"""The CiA 402 state machine, by table: every statusword, every state and goal, and the drive's own transitions."""

from __future__ import annotations

import pytest

from fivebar_control.hardware.cia402 import (
    FAULT_RESET_SEQUENCE,
    STATUS_TABLE,
    DriveState,
    PowerTarget,
    next_controlword,
    reached,
    state_of,
)

WORDS = {
    DriveState.NOT_READY: [0x0000, 0x0020, 0x0010, 0x0080, 0x8100, 0xFFB0],
    DriveState.SWITCH_ON_DISABLED: [0x0040, 0x0060, 0x0240, 0x0250, 0x0670],
    DriveState.READY: [0x0021, 0x0031, 0x0231, 0x12B1],
    DriveState.SWITCHED_ON: [0x0023, 0x0033, 0x0233],
    DriveState.ENABLED: [0x0027, 0x0037, 0x1237, 0x0637],
    DriveState.QUICK_STOP: [0x0007, 0x0017, 0x0217],
    DriveState.FAULT_REACTION: [0x000F, 0x001F, 0x002F, 0x021F],
    DriveState.FAULT: [0x0008, 0x0018, 0x0028, 0x0218, 0x0238],
    DriveState.UNKNOWN: [0x0001, 0x0003, 0x0022, 0x0047, 0x004F, 0x0061, 0x0067],
}

POWERED = {DriveState.SWITCHED_ON, DriveState.ENABLED, DriveState.QUICK_STOP, DriveState.FAULT_REACTION}
"""States in which the power stage may be live."""

STEPS = {
    (DriveState.NOT_READY, PowerTarget.ENABLED): 0x00,
    (DriveState.SWITCH_ON_DISABLED, PowerTarget.ENABLED): 0x06,
    (DriveState.READY, PowerTarget.ENABLED): 0x07,
    (DriveState.SWITCHED_ON, PowerTarget.ENABLED): 0x0F,
    (DriveState.ENABLED, PowerTarget.ENABLED): 0x0F,
    (DriveState.QUICK_STOP, PowerTarget.ENABLED): 0x00,
    (DriveState.FAULT_REACTION, PowerTarget.ENABLED): 0x00,
    (DriveState.FAULT, PowerTarget.ENABLED): 0x00,
    (DriveState.UNKNOWN, PowerTarget.ENABLED): 0x00,
    (DriveState.NOT_READY, PowerTarget.DISABLED): 0x00,
    (DriveState.SWITCH_ON_DISABLED, PowerTarget.DISABLED): 0x00,
    (DriveState.READY, PowerTarget.DISABLED): 0x00,
    (DriveState.SWITCHED_ON, PowerTarget.DISABLED): 0x06,
    (DriveState.ENABLED, PowerTarget.DISABLED): 0x07,
    (DriveState.QUICK_STOP, PowerTarget.DISABLED): 0x00,
    (DriveState.FAULT_REACTION, PowerTarget.DISABLED): 0x00,
    (DriveState.FAULT, PowerTarget.DISABLED): 0x00,
    (DriveState.UNKNOWN, PowerTarget.DISABLED): 0x00,
    **{(state, PowerTarget.OFF): 0x00 for state in DriveState},
    **{(state, PowerTarget.QUICK_STOP): 0x00 for state in DriveState},
    (DriveState.ENABLED, PowerTarget.QUICK_STOP): 0x02,
    (DriveState.QUICK_STOP, PowerTarget.QUICK_STOP): 0x02,
}


@pytest.mark.parametrize(("state", "word"), [(state, word) for state, words in WORDS.items() for word in words])
def test_statuswords(state: DriveState, word: int) -> None:
    assert state_of(word) is state


def test_every_word_has_one_state_at_most() -> None:
    """Only the low byte without bits 4 and 7 tells the state."""
    for word in range(0x100):
        rows = [state for mask, value, state in STATUS_TABLE if word & mask == value]
        assert len(rows) <= 1
        assert state_of(word) is (rows[0] if rows else DriveState.UNKNOWN)
        for other in (word | 0x10, word | 0x80, word | 0xFF00):
            assert state_of(other) is state_of(word)


def test_every_state_and_goal_has_its_step() -> None:
    assert set(STEPS) == {(state, goal) for state in DriveState for goal in PowerTarget}
    assert {pair: next_controlword(*pair) for pair in STEPS} == STEPS


def test_no_step_ever_resets_a_fault() -> None:
    assert not [pair for pair in STEPS if next_controlword(*pair) & 0x80]
    assert FAULT_RESET_SEQUENCE == (0x00, 0x80, 0x00)


def drive_after(state: DriveState, word: int) -> DriveState:
    """The drive's side of the standard: transitions 2 to 15 for the words that are used here."""
    if state is DriveState.FAULT:
        return DriveState.SWITCH_ON_DISABLED if word & 0x80 else DriveState.FAULT
    if state in (DriveState.NOT_READY, DriveState.UNKNOWN, DriveState.FAULT_REACTION):
        return state
    if not word & 0x02:
        return DriveState.SWITCH_ON_DISABLED
    if not word & 0x04:
        return DriveState.QUICK_STOP if state is DriveState.ENABLED else state
    low = word & 0x0F
    if low == 0x06:
        return DriveState.READY
    if low == 0x07:
        return {DriveState.READY: DriveState.SWITCHED_ON, DriveState.ENABLED: DriveState.SWITCHED_ON}.get(state, state)
    return DriveState.ENABLED if low == 0x0F and state is not DriveState.SWITCH_ON_DISABLED else state


def path_to(goal: PowerTarget, state: DriveState) -> list[DriveState]:
    passed = [state]
    while not reached(state, goal) and len(passed) < 10:
        state = drive_after(state, next_controlword(state, goal))
        passed.append(state)
    return passed


def test_enabling_goes_through_every_state() -> None:
    wanted = [DriveState.SWITCH_ON_DISABLED, DriveState.READY, DriveState.SWITCHED_ON, DriveState.ENABLED]
    assert path_to(PowerTarget.ENABLED, DriveState.SWITCH_ON_DISABLED) == wanted
    assert path_to(PowerTarget.ENABLED, DriveState.QUICK_STOP) == [DriveState.QUICK_STOP, *wanted]


def test_disabling_steps_down_and_off_falls_down() -> None:
    assert path_to(PowerTarget.DISABLED, DriveState.ENABLED) == [
        DriveState.ENABLED, DriveState.SWITCHED_ON, DriveState.READY, DriveState.SWITCH_ON_DISABLED,
    ]  # fmt: skip
    assert path_to(PowerTarget.OFF, DriveState.ENABLED) == [DriveState.ENABLED, DriveState.SWITCH_ON_DISABLED]


def test_a_quick_stop_is_of_enabled_drives_and_enabling_begins_again_after_it() -> None:
    assert path_to(PowerTarget.QUICK_STOP, DriveState.ENABLED) == [DriveState.ENABLED, DriveState.QUICK_STOP]
    assert path_to(PowerTarget.QUICK_STOP, DriveState.SWITCHED_ON) == [
        DriveState.SWITCHED_ON,
        DriveState.SWITCH_ON_DISABLED,
    ]
    # bit 1 set, bit 2 clear: the drive stops in its own way and keeps its power until it has
    assert next_controlword(DriveState.ENABLED, PowerTarget.QUICK_STOP) & 0x06 == 0x02


def test_a_fault_is_never_enabled_and_needs_the_whole_sequence() -> None:
    assert path_to(PowerTarget.ENABLED, DriveState.FAULT) == [DriveState.FAULT] * 10
    state = DriveState.FAULT
    for word in FAULT_RESET_SEQUENCE:
        state = drive_after(state, word)
    assert state is DriveState.SWITCH_ON_DISABLED


def test_what_counts_as_off() -> None:
    for state in DriveState:
        assert reached(state, PowerTarget.ENABLED) == (state is DriveState.ENABLED)
        assert reached(state, PowerTarget.OFF) == reached(state, PowerTarget.DISABLED)
        if reached(state, PowerTarget.OFF):
            assert state not in POWERED
