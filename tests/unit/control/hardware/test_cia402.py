"""The CiA 402 state machine, by table: every statusword, every state and goal, and the drive's own transitions."""

from __future__ import annotations

import pytest

from fivebar_control.hardware.cia402 import (
    FAULT_RESET_SEQUENCE,
    POWERED,
    STATUS_TABLE,
    Goal,
    State,
    next_controlword,
    reached,
    state_of,
)

WORDS = {
    State.NOT_READY: [0x0000, 0x0020, 0x0010, 0x0080, 0x8100, 0xFFB0],
    State.SWITCH_ON_DISABLED: [0x0040, 0x0060, 0x0240, 0x0250, 0x0670],
    State.READY: [0x0021, 0x0031, 0x0231, 0x12B1],
    State.SWITCHED_ON: [0x0023, 0x0033, 0x0233],
    State.ENABLED: [0x0027, 0x0037, 0x1237, 0x0637],
    State.QUICK_STOP: [0x0007, 0x0017, 0x0217],
    State.FAULT_REACTION: [0x000F, 0x001F, 0x002F, 0x021F],
    State.FAULT: [0x0008, 0x0018, 0x0028, 0x0218, 0x0238],
    State.UNKNOWN: [0x0001, 0x0003, 0x0022, 0x0047, 0x004F, 0x0061, 0x0067],
}

STEPS = {
    (State.NOT_READY, Goal.ENABLED): 0x00,
    (State.SWITCH_ON_DISABLED, Goal.ENABLED): 0x06,
    (State.READY, Goal.ENABLED): 0x07,
    (State.SWITCHED_ON, Goal.ENABLED): 0x0F,
    (State.ENABLED, Goal.ENABLED): 0x0F,
    (State.QUICK_STOP, Goal.ENABLED): 0x00,
    (State.FAULT_REACTION, Goal.ENABLED): 0x00,
    (State.FAULT, Goal.ENABLED): 0x00,
    (State.UNKNOWN, Goal.ENABLED): 0x00,
    (State.NOT_READY, Goal.DISABLED): 0x00,
    (State.SWITCH_ON_DISABLED, Goal.DISABLED): 0x00,
    (State.READY, Goal.DISABLED): 0x00,
    (State.SWITCHED_ON, Goal.DISABLED): 0x06,
    (State.ENABLED, Goal.DISABLED): 0x07,
    (State.QUICK_STOP, Goal.DISABLED): 0x00,
    (State.FAULT_REACTION, Goal.DISABLED): 0x00,
    (State.FAULT, Goal.DISABLED): 0x00,
    (State.UNKNOWN, Goal.DISABLED): 0x00,
    **{(state, Goal.OFF): 0x00 for state in State},
    **{(state, Goal.QUICK_STOP): 0x00 for state in State},
    (State.ENABLED, Goal.QUICK_STOP): 0x02,
    (State.QUICK_STOP, Goal.QUICK_STOP): 0x02,
}


@pytest.mark.parametrize(("state", "word"), [(state, word) for state, words in WORDS.items() for word in words])
def test_statuswords(state: State, word: int) -> None:
    assert state_of(word) is state


def test_every_word_has_one_state_at_most() -> None:
    """Only the low byte without bits 4 and 7 tells the state."""
    for word in range(0x100):
        rows = [state for mask, value, state in STATUS_TABLE if word & mask == value]
        assert len(rows) <= 1
        assert state_of(word) is (rows[0] if rows else State.UNKNOWN)
        for other in (word | 0x10, word | 0x80, word | 0xFF00):
            assert state_of(other) is state_of(word)


def test_every_state_and_goal_has_its_step() -> None:
    assert set(STEPS) == {(state, goal) for state in State for goal in Goal}
    assert {pair: next_controlword(*pair) for pair in STEPS} == STEPS


def test_no_step_ever_resets_a_fault() -> None:
    assert not [pair for pair in STEPS if next_controlword(*pair) & 0x80]
    assert FAULT_RESET_SEQUENCE == (0x00, 0x80, 0x00)


def drive_after(state: State, word: int) -> State:
    """The drive's side of the standard: transitions 2 to 15 for the words that are used here."""
    if state is State.FAULT:
        return State.SWITCH_ON_DISABLED if word & 0x80 else State.FAULT
    if state in (State.NOT_READY, State.UNKNOWN, State.FAULT_REACTION):
        return state
    if not word & 0x02:
        return State.SWITCH_ON_DISABLED
    if not word & 0x04:
        return State.QUICK_STOP if state is State.ENABLED else state
    low = word & 0x0F
    if low == 0x06:
        return State.READY
    if low == 0x07:
        return {State.READY: State.SWITCHED_ON, State.ENABLED: State.SWITCHED_ON}.get(state, state)
    return State.ENABLED if low == 0x0F and state is not State.SWITCH_ON_DISABLED else state


def path_to(goal: Goal, state: State) -> list[State]:
    passed = [state]
    while not reached(state, goal) and len(passed) < 10:
        state = drive_after(state, next_controlword(state, goal))
        passed.append(state)
    return passed


def test_enabling_goes_through_every_state() -> None:
    wanted = [State.SWITCH_ON_DISABLED, State.READY, State.SWITCHED_ON, State.ENABLED]
    assert path_to(Goal.ENABLED, State.SWITCH_ON_DISABLED) == wanted
    assert path_to(Goal.ENABLED, State.QUICK_STOP) == [State.QUICK_STOP, *wanted]


def test_disabling_steps_down_and_off_falls_down() -> None:
    assert path_to(Goal.DISABLED, State.ENABLED) == [
        State.ENABLED, State.SWITCHED_ON, State.READY, State.SWITCH_ON_DISABLED,
    ]  # fmt: skip
    assert path_to(Goal.OFF, State.ENABLED) == [State.ENABLED, State.SWITCH_ON_DISABLED]


def test_a_quick_stop_is_of_enabled_drives_and_enabling_begins_again_after_it() -> None:
    assert path_to(Goal.QUICK_STOP, State.ENABLED) == [State.ENABLED, State.QUICK_STOP]
    assert path_to(Goal.QUICK_STOP, State.SWITCHED_ON) == [State.SWITCHED_ON, State.SWITCH_ON_DISABLED]
    # bit 1 set, bit 2 clear: the drive stops in its own way and keeps its power until it has
    assert next_controlword(State.ENABLED, Goal.QUICK_STOP) & 0x06 == 0x02


def test_a_fault_is_never_enabled_and_needs_the_whole_sequence() -> None:
    assert path_to(Goal.ENABLED, State.FAULT) == [State.FAULT] * 10
    state = State.FAULT
    for word in FAULT_RESET_SEQUENCE:
        state = drive_after(state, word)
    assert state is State.SWITCH_ON_DISABLED


def test_what_counts_as_off() -> None:
    for state in State:
        assert reached(state, Goal.ENABLED) == (state is State.ENABLED)
        assert reached(state, Goal.OFF) == reached(state, Goal.DISABLED)
        if reached(state, Goal.OFF):
            assert state not in POWERED
