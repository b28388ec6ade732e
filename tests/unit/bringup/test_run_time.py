# SPDX-License-Identifier: Apache-2.0
"""Log times of a run in lockstep: those of its samples."""

from __future__ import annotations

from fivebar_bringup.bag.run_time import RunTime, stamp_in
from fivebar_bringup.bag.serialize import joint_state
from fivebar_description.interface import START_STAMP_NS, sample_stamp_ns


def stamp(sample: int) -> int:
    return sample_stamp_ns(sample, 500)


def test_a_message_is_logged_at_the_time_of_its_sample() -> None:
    time = RunTime()
    # before the run, a text
    assert time.of("run/plan", None, False) == START_STAMP_NS
    assert time.of("joint_states", stamp(0), True) == stamp(0)
    # a sample ahead, which does not move the time
    assert time.of("reference", stamp(1), False) == stamp(1)
    assert time.of("faults", None, False) == stamp(0)
    assert time.of("joint_states", stamp(3), True) == stamp(3)
    # late in coming, and a text after it
    assert time.of("torque_command", stamp(2), False) == stamp(2)
    assert time.of("faults", None, False) == stamp(3)


def test_times_of_a_topic_never_go_back_and_those_of_others_do_not_count() -> None:
    time = RunTime()
    assert time.of("joint_states", stamp(9), True) == stamp(9)
    assert time.of("joint_states", stamp(4), True) == stamp(9)
    # an arm on the same topic, by the clock of the system
    assert time.of("joint_states", 1_700_000_000_000_000_000, True) == stamp(9)
    assert time.of("faults", None, False) == stamp(9)


def test_the_stamp_is_read_from_the_bytes() -> None:
    data = joint_state(5_000_000_123, ("q11",), (0.5,))
    assert stamp_in(data) == 5_000_000_123
    assert stamp_in(data[:11]) is None
