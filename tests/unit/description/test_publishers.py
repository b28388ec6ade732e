# SPDX-License-Identifier: Apache-2.0
"""Who publishes a topic: living publishers and dead predecessors are told apart by name, machine and process."""

from __future__ import annotations

import os
import subprocess
import sys

from fivebar_description.joint_sample import JointSample, OneAnswer, part_of
from fivebar_description.publishers import (
    HALF,
    LONGEST_LEASE,
    Living,
    OneSender,
    PublisherOf,
    contradiction,
    processes_with,
    same,
    second_publisher,
)

HERE, THERE = b"\x01\x0f\xaa\xbb", b"\x01\x0f\xcc\xdd"
ALIVE, DEAD = 1000, 2000


def publisher(node: str, process: int, machine: bytes = HERE, number: int = 0) -> PublisherOf:
    return PublisherOf(node, machine + process.to_bytes(2, "little") + bytes([number] * 6) + b"\0\0\0\x03")


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def living(*publishers: PublisherOf, machine: bytes = HERE, clock: Clock | None = None) -> list[str]:
    known = Living(clock or Clock(), lambda half: half != DEAD)
    return [one.node for one in known.among(publishers, machine)]


def test_a_dead_predecessor_is_left_out_and_nobody_else() -> None:
    old, new = publisher("/ctc", DEAD), publisher("/ctc", ALIVE, number=1)
    assert living(old, new) == ["/ctc"]
    # another name, a process that runs, another machine, and an own identity that is not known
    assert living(publisher("/rogue", DEAD), new) == ["/rogue", "/ctc"]
    assert living(publisher("/ctc", ALIVE), new) == ["/ctc", "/ctc"]
    assert living(publisher("/ctc", DEAD, THERE), new) == ["/ctc", "/ctc"]
    assert living(old, new, machine=b"") == ["/ctc", "/ctc"]
    # of two publishers of one process neither is the other's predecessor
    assert living(old, publisher("/ctc", DEAD)) == ["/ctc", "/ctc"]


def test_no_predecessor_is_left_out_for_longer_than_a_lease() -> None:
    clock = Clock()
    known = Living(clock, lambda half: half != DEAD)
    both = [publisher("/ctc", DEAD), publisher("/ctc", ALIVE, number=1)]
    assert len(known.among(both, HERE)) == 1
    clock.now = LONGEST_LEASE + 1.0
    assert len(known.among(both, HERE)) == 2


def test_only_what_runs_is_a_process() -> None:
    assert processes_with(os.getpid() % HALF) == [os.getpid()]
    child = subprocess.Popen([sys.executable, "-c", ""])
    os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
    # it has ended, and nobody has taken note of that yet
    assert child.pid not in processes_with(child.pid % HALF)
    child.wait()
    assert child.pid not in processes_with(child.pid % HALF)


def test_the_fault_names_all_of_them() -> None:
    own = publisher("/ctc", os.getpid() % HALF)
    other = publisher("/cell/rogue", ALIVE, THERE)
    unknown = PublisherOf("_NODE_NAMESPACE_UNKNOWN_/_NODE_NAME_UNKNOWN_", own.gid)
    assert second_publisher("reference", [own, other], HERE) == (
        f"second_publisher: reference is published by /ctc (process {os.getpid()}) and"
        " /cell/rogue (on another machine), expected one publisher"
    )
    assert f"a node whose name is not known yet (process {os.getpid()})" in second_publisher("r", [own, unknown], HERE)
    assert contradiction("ctc/torque", "sample 7", [other], b"") == (
        "second_publisher: two different messages on ctc/torque for sample 7, which is published by /cell/rogue"
    )


def test_values_are_the_same_with_nan_in_them() -> None:
    nan = float("nan")
    assert same((nan, 1.0), (float("nan"), 1.0))
    assert not same((nan, 1.0), (nan, 2.0))


def test_a_sample_gets_one_torque_and_zero_after_it() -> None:
    answer = OneAnswer()
    assert not answer.contradicts(5, (1.0, 2.0))
    assert not answer.contradicts(5, (1.0, 2.0))
    assert answer.contradicts(5, (3.0, 3.0))
    assert not answer.contradicts(4, (9.0, 9.0))
    assert answer.contradicts(5, (3.0, 3.0))
    assert not answer.contradicts(5, (0.0, 0.0))
    assert answer.contradicts(5, (1.0, 2.0))
    assert not answer.contradicts(6, (3.0, 3.0))


def test_the_part_of_a_message_about_some_joints() -> None:
    message = JointSample(7, ("finger", "q21", "q11"), (9.0, 2.0, 1.0), (), (0.9, 0.2, 0.1))
    part = part_of(message, ("q11", "q21"))
    assert part is not None
    assert (part.stamp_ns, part.name) == (7, ("q11", "q21"))
    assert (part.position, part.velocity, part.effort) == ((1.0, 2.0), (), (0.1, 0.2))
    assert part_of(message, ("q12", "q22")) is None
    # for the reader to refuse
    assert part_of(message, ("q11", "q12")) is message
    short = JointSample(7, ("q11", "q21"), (1.0,), (), ())
    assert part_of(short, ("q11", "q21")) is short


def test_a_second_sender_shows_in_the_numbers_of_its_messages() -> None:
    sender = OneSender()
    # one sender, of which some messages are lost
    assert not any(sender.is_contradicted(number) for number in (3, 4, 7, None, 8))
    # another one, in whatever order both come
    assert [sender.is_contradicted(number) for number in (1, 9, 2, 10, 10)] == [True, False, True, False, True]
