# SPDX-License-Identifier: Apache-2.0
"""The emulated drive's power states: what each controlword leads to, and which one resets a fault."""

from __future__ import annotations

import pytest

from fivebar_sim.drives.power_state import PowerState, PowerStateMachine

SHUTDOWN, SWITCH_ON, ENABLE, QUICK_STOP, NO_VOLTAGE, RESET = 0x06, 0x07, 0x0F, 0x02, 0x00, 0x80


def after(*words: int, tripped: bool = False) -> PowerStateMachine:
    machine = PowerStateMachine()
    if tripped:
        machine.trip()
    for word in words:
        machine.control(word)
    return machine


@pytest.mark.parametrize(
    ("words", "state"),
    [
        ((), PowerState.SWITCH_ON_DISABLED),
        ((ENABLE,), PowerState.SWITCH_ON_DISABLED),
        ((SHUTDOWN,), PowerState.READY),
        ((SHUTDOWN, SWITCH_ON), PowerState.SWITCHED_ON),
        ((SHUTDOWN, ENABLE), PowerState.SWITCHED_ON),
        ((SHUTDOWN, SWITCH_ON, ENABLE), PowerState.ENABLED),
        ((SHUTDOWN, SWITCH_ON, ENABLE, ENABLE), PowerState.ENABLED),
        ((SHUTDOWN, SWITCH_ON, ENABLE, SWITCH_ON), PowerState.SWITCHED_ON),
        ((SHUTDOWN, SWITCH_ON, ENABLE, SHUTDOWN), PowerState.READY),
        ((SHUTDOWN, SWITCH_ON, ENABLE, QUICK_STOP), PowerState.SWITCH_ON_DISABLED),
        ((SHUTDOWN, SWITCH_ON, ENABLE, NO_VOLTAGE), PowerState.SWITCH_ON_DISABLED),
    ],
)
def test_a_controlword_leads_to_its_state(words: tuple[int, ...], state: PowerState) -> None:
    assert after(*words).state is state


@pytest.mark.parametrize(
    ("words", "state"),
    [
        ((), PowerState.FAULT),
        ((NO_VOLTAGE, SHUTDOWN, SWITCH_ON, ENABLE), PowerState.FAULT),
        ((RESET,), PowerState.SWITCH_ON_DISABLED),
        ((NO_VOLTAGE, RESET), PowerState.SWITCH_ON_DISABLED),
    ],
)
def test_a_fault_is_left_by_a_reset_only(words: tuple[int, ...], state: PowerState) -> None:
    assert after(*words, tripped=True).state is state


def test_bit_7_resets_when_it_rises_and_not_while_it_stays() -> None:
    """A master that never takes it back would clear a second fault unseen."""
    machine = after(RESET, tripped=True)
    machine.trip()
    assert not machine.control(RESET)
    assert not machine.control(RESET | ENABLE)
    assert machine.state is PowerState.FAULT
    assert not machine.control(NO_VOLTAGE)
    assert machine.control(RESET)
    assert machine.state is PowerState.SWITCH_ON_DISABLED
    # whatever the other bits were before
    for before in (SHUTDOWN, SWITCH_ON, ENABLE):
        assert after(before, RESET, tripped=True).state is PowerState.SWITCH_ON_DISABLED
    # nor does one that was set before the fault came
    machine = after(SHUTDOWN | RESET)
    assert machine.state is PowerState.READY
    machine.trip()
    assert not machine.control(RESET)
    assert machine.state is PowerState.FAULT
