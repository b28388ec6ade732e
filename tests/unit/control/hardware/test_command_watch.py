# SPDX-License-Identifier: Apache-2.0
"""The watch over the torque command, with a clock that the test turns."""

from __future__ import annotations

from fivebar_control.hardware.command_watch import CommandWatch

TORQUES = (1.0, -2.0)


def test_before_the_first_command_there_is_zero_torque_and_no_fault() -> None:
    watch = CommandWatch(0.02, 500)
    assert watch.torques == (0.0, 0.0)
    assert watch.fault(10_000, 1e6) is None


def test_a_command_holds_until_it_is_stale_by_the_clock() -> None:
    watch = CommandWatch(0.02, 500)
    watch.take(3, TORQUES, 5.0)
    assert watch.torques == TORQUES
    assert watch.fault(4, 5.02) is None
    assert str(watch.fault(4, 5.03)) == "command_stale: last torque came 30 ms ago, limit 20 ms"


def test_a_command_that_answers_too_old_a_sample_is_stale() -> None:
    """20 ms at 500 Hz are 10 samples."""
    watch = CommandWatch(0.02, 500)
    watch.take(3, TORQUES, 5.0)
    assert watch.fault(13, 5.0) is None
    assert str(watch.fault(14, 5.0)).startswith("command_stale: sample 14 still waits for the torque of sample 4")


def test_which_commands_are_taken() -> None:
    watch = CommandWatch(0.02, 500)
    assert watch.accepts(0, 0)
    assert not watch.accepts(1, 0)
    watch.take(5, TORQUES, 0.0)
    assert [sample for sample in range(10) if watch.accepts(sample, 7)] == [5, 6, 7]


def test_a_pardon_holds_zero_and_begins_the_time_again() -> None:
    watch = CommandWatch(0.02, 500)
    watch.rearm(50, 1.0)
    assert watch.fault(99, 9.0) is None
    watch.take(3, TORQUES, 5.0)
    watch.rearm(50, 9.0)
    assert watch.torques == (0.0, 0.0)
    assert watch.fault(51, 9.01) is None
    assert watch.fault(51, 9.03) is not None
    watch.begin()
    assert watch.answered == -1
