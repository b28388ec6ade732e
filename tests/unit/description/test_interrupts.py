# SPDX-License-Identifier: Apache-2.0
"""Signals that ask for a stop become KeyboardInterrupt, at once or where they cannot do harm."""

from __future__ import annotations

import ctypes
import signal
import threading
import time

import pytest

from fivebar_description.interrupts import (
    REPEAT_PERIOD,
    STOP_SIGNALS,
    _Interrupts,
    interrupts_allowed,
    interrupts_deferred,
    keyboard_interrupts,
    service_signals,
)


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


@pytest.mark.parametrize("late", [False, True])
def test_a_signal_soon_after_another_repeats_it(late: bool) -> None:
    """As a terminal and `ros2 launch` both pass Ctrl-C on."""
    went_on = False
    with keyboard_interrupts():
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        if late:
            _Interrupts.raised_at -= REPEAT_PERIOD
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
            went_on = True
            raise KeyboardInterrupt
    assert went_on is not late


@pytest.mark.parametrize("early", [False, True])
def test_a_block_is_interrupted_once_where_it_allows_it(early: bool) -> None:
    steps = []
    with keyboard_interrupts(), interrupts_deferred():
        try:
            if early:
                signal.raise_signal(signal.SIGHUP)
            steps.append("prepared")
            with interrupts_allowed():
                if not early:
                    signal.raise_signal(signal.SIGHUP)
                steps.append("worked")
        except KeyboardInterrupt:
            steps.append("interrupted")
        _Interrupts.raised_at -= REPEAT_PERIOD
        signal.raise_signal(signal.SIGTERM)
        steps.append("stopped in order")
    assert steps == ["prepared", "interrupted", "stopped in order"]


def test_a_signal_after_the_work_still_interrupts() -> None:
    steps = []
    with keyboard_interrupts(), pytest.raises(KeyboardInterrupt), interrupts_deferred():
        with interrupts_allowed():
            steps.append("worked")
        signal.raise_signal(signal.SIGINT)
        steps.append("stopped in order")
    assert steps == ["worked", "stopped in order"]


def _wait_for_an_interrupt() -> None:
    until = time.monotonic() + 10.0
    while time.monotonic() < until:
        pass


@pytest.mark.parametrize("number", STOP_SIGNALS)
def test_a_function_that_llvm_has_called_ends_before_it_is_interrupted(number: signal.Signals) -> None:
    steps = []

    def _raw_object_cache_notify() -> None:
        signal.raise_signal(number)
        steps.append("handed over")

    call = ctypes.CFUNCTYPE(None)(_raw_object_cache_notify)
    with pytest.raises(KeyboardInterrupt), keyboard_interrupts():
        call()
        steps.append("compiled")
        _wait_for_an_interrupt()
    assert steps == ["handed over", "compiled"]


def test_an_interrupt_that_is_lost_is_repeated() -> None:
    """Python drops exceptions where nothing called the function that they are raised in."""

    class Disposed:
        def __del__(self) -> None:
            signal.raise_signal(signal.SIGTERM)

    steps = []
    with pytest.raises(KeyboardInterrupt), keyboard_interrupts():
        found = Disposed()
        del found
        steps.append("went on")
        _wait_for_an_interrupt()
    assert steps == ["went on"]


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
    previous = {number: signal.signal(number, signal.SIG_IGN) for number in STOP_SIGNALS}
    try:
        with keyboard_interrupts():
            for number in STOP_SIGNALS:
                signal.raise_signal(number)
        # a node has to hear who has started it; only `nohup` is heeded
        assert service_signals() == (signal.SIGINT, signal.SIGTERM)
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
    assert service_signals() == STOP_SIGNALS
