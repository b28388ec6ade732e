# SPDX-License-Identifier: Apache-2.0
"""A fault in the graph of an experiment: bringing the motion to it, what must follow, and the way back."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from fault_bench import ATTEMPTS, FaultBench
from lifecycle_msgs.msg import Transition

from fivebar_bringup.bag.reader import read_bag
from fivebar_description.interface import FAULTS, JOINT_STATES, TORQUE_COMMAND, Topic

ZERO = (0.0, 0.0)

STOP_CYCLES = 8
"""Cycles within which a lost part stops the robot: 160 ms, many times what a machine with other work stands still."""

NOTICED = {"mute": STOP_CYCLES + 4}
"""Cycles that a fault takes to show which takes nothing away at once.

A heartbeat may be two cycles older than a torque, its age is looked at once a cycle, and cycles are not exactly equal.
"""

ROUNDS_WITHOUT = 10
"""Cycles for which nothing may move after the stop."""


LATE = {"blender": "joined_late", "state_estimator": "estimate_lost"}
"""What a node says with the first sample that it hears after a restart: it does not know what stopped the robot, or
where it is."""


class Broken(NamedTuple):
    """How something is broken, the fault's name, whether a reset is possible once it is mended, and a node's answer.

    The blender misses a candidate one cycle before the bridge misses the torque. Where the machine stands still for
    that cycle, the bridge's fault, `or_first`, may be the first.
    """

    order: str
    name: str
    resets: bool = True
    or_first: str = ""
    answer: Topic | None = None


def expect_stop(rig: FaultBench, begun: int, cycles: int) -> None:
    """Zero torque for good within so many cycles and the one that has begun with a SYNC."""
    taken = rig.stopped_at() - begun
    print(f"no torque after {taken} SYNCs")
    assert taken <= cycles + 1


def expect_stop_after_answer(rig: FaultBench, topic: Topic) -> None:
    """Zero torque for good within the cycles after the last sample that a node answered on a topic."""
    stopped = rig.probe.wait_for(lambda: max(0, rig.sample_without_torque()), "a measured torque of zero")
    taken = stopped - rig.sample(topic)
    print(f"no torque measured {taken} samples after the last answer")
    # its torque acts from the next sample on, and what acts is measured one later
    assert taken <= STOP_CYCLES + 2


def expect_reset(rig: FaultBench, broken: Broken, most: float | None = None) -> None:
    """Reset in the order of the documentation: bridge, enable, blender; then with a torque (Nm) below the friction."""
    rig.enable_drives()
    rig.expect_no_torque_for(2 * rig.period)
    for _ in range(ATTEMPTS):
        before = len(rig.drives.log)
        answer = rig.reset_blender()
        assert answer.success is broken.resets, answer.message
        if not broken.resets:
            assert "only a new run clears" in answer.message
            rig.expect_no_torque_for(ROUNDS_WITHOUT * rig.period)
            return
        # the robot holds where it stands, with no bump
        rig.probe.spin_for(ROUNDS_WITHOUT * rig.period)
        if not rig.stopped():
            break
        rig.enable_drives()
    assert not rig.stopped(), rig.faults()
    since_then = rig.drives.log[before:]
    torques = [abs(torque) for look in since_then for torque in (look.first, look.second)]
    print(f"largest torque after the reset {max(torques):.3f} Nm")
    # the robot stands, and so it shall
    robot = rig.scenario.five_bar()
    friction = max(leg.coulomb + abs(leg.offset) for leg in (robot.leg1, robot.leg2))
    assert 0.0 < max(torques) < (friction if most is None else most)
    assert since_then[-1].speed < 0.1


def break_hardware(rig: FaultBench, broken: Broken, sample: int, cycles: int) -> None:
    """Break drives, board or bus at a sample: the fault is named, the torque ends in time, and no reset is possible."""
    arrive(rig, sample)
    known = len(rig.faults())
    begun = rig.drives.order(broken.order)
    assert rig.wait_for_fault(known) == broken.name
    expect_stop(rig, begun, cycles)
    rig.expect_no_torque_for(ROUNDS_WITHOUT * rig.period)
    assert not rig.ask("blender", "reset").success


def break_and_mend_node(rig: FaultBench, broken: Broken, sample: int) -> str:
    """Stop or kill a node at a sample, and continue or restart it without anything moving; return its name."""
    verb, node = broken.order.split()
    arrive(rig, sample)
    known = len(rig.faults())
    rig.kill(node, signal.SIGSTOP if verb == "stop" else signal.SIGKILL)
    assert rig.wait_for_fault(known) in {broken.name, broken.or_first}
    rig.stopped_at()
    if broken.answer is not None:
        expect_stop_after_answer(rig, broken.answer)
    rig.expect_no_torque_for(ROUNDS_WITHOUT * rig.period)
    if verb == "stop":
        rig.kill(node, signal.SIGCONT)
    else:
        rig.restart(node)
    late = LATE.get(node) if verb == "kill" else None
    if late is not None:
        rig.probe.wait_for(lambda: late in rig.faults()[known:], late)
    rig.expect_no_torque_for(ROUNDS_WITHOUT * rig.period)
    return node


def begin_with_new_bridge(rig: FaultBench, tripped: bool) -> None:
    """Configure a restarted bridge, whose first sample begins a new run; the drives may have tripped meanwhile."""
    rig.running = False
    assert rig.change(Transition.TRANSITION_CONFIGURE)
    if tripped:
        assert rig.ask(rig.bridge, "reset").success
    rig.begin()
    rig.wait_for_rest()
    assert rig.reset_blender().success


def expect_new_run_only(rig: FaultBench) -> None:
    """With an estimator that does not know where the robot is nothing moves, until a new run begins at home."""
    rig.enable_drives()
    answers = len(rig.probe.got(JOINT_STATES))
    assert not rig.ask("blender", "reset").success
    rig.expect_no_torque_for(ROUNDS_WITHOUT * rig.period)
    assert len(rig.probe.got(JOINT_STATES)) == answers
    rig.begin()
    rig.wait_for_rest()
    assert rig.reset_blender().success


def arrive(rig: FaultBench, sample: int) -> None:
    """Bring the motion to a sample; again where a cycle was missed on the way, as it happens on a busy machine."""
    for _ in range(ATTEMPTS):
        recover(rig)
        rig.begin()
        if rig.run_to(sample):
            return
    pytest.fail(f"not even once in {ATTEMPTS} times to sample {sample}: {rig.faults()[-ATTEMPTS:]}")


def recover(rig: FaultBench) -> None:
    """Make ready for a new run whatever the last case has left."""
    for name, process in rig.processes.items():
        if process.status is not None and name != rig.bridge:
            rig.restart(name)
    if not rig.running:
        return
    if rig.stopped():
        # a new run, for what only that clears; the robot holds in it, so another one is to follow
        rig.ask(rig.bridge, "reset")
        rig.begin()
        rig.wait_for_rest()
        assert rig.reset_blender().success


def expect_readable(bag: Path, faults: set[str], stop_recorder: Callable[[], None]) -> None:
    stop_recorder()
    recording = read_bag(bag)
    assert faults <= {text.partition(":")[0] for text in recording.texts(FAULTS)}
    efforts = recording.field(TORQUE_COMMAND, "effort")
    assert len(efforts) > 20
    assert np.all(np.isfinite(efforts))
    assert tuple(efforts[-1]) == ZERO
