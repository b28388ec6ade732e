"""SIGINT and SIGTERM become KeyboardInterrupt, at once or where they cannot do harm."""

from __future__ import annotations

import signal
import threading

import pytest

from fivebar_description.interrupts import STOP_SIGNALS, interrupts_deferred, keyboard_interrupts


@pytest.mark.parametrize("number", STOP_SIGNALS)
def test_a_signal_interrupts_at_once(number: signal.Signals) -> None:
    went_on = False
    with pytest.raises(KeyboardInterrupt), keyboard_interrupts():
        signal.raise_signal(number)
        went_on = True
    assert not went_on


@pytest.mark.parametrize("number", STOP_SIGNALS)
def test_a_deferred_one_interrupts_at_the_end_and_once(number: signal.Signals) -> None:
    went_on = False
    with keyboard_interrupts():
        with pytest.raises(KeyboardInterrupt), interrupts_deferred():
            signal.raise_signal(number)
            signal.raise_signal(number)
            went_on = True
        with interrupts_deferred():
            pass
    assert went_on


def test_another_thread_defers_nothing() -> None:
    inside, done = threading.Event(), threading.Event()

    def other() -> None:
        with interrupts_deferred():
            inside.set()
            done.wait()

    thread = threading.Thread(target=other)
    thread.start()
    try:
        assert inside.wait(10.0)
        with pytest.raises(KeyboardInterrupt), keyboard_interrupts():
            signal.raise_signal(signal.SIGTERM)
    finally:
        done.set()
        thread.join()


def test_handlers_are_put_back_and_an_ignored_signal_stays_ignored() -> None:
    before = [signal.getsignal(number) for number in STOP_SIGNALS]
    with keyboard_interrupts():
        assert all(signal.getsignal(number) not in before for number in STOP_SIGNALS)
    assert [signal.getsignal(number) for number in STOP_SIGNALS] == before
    previous = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with keyboard_interrupts():
            signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, previous)
