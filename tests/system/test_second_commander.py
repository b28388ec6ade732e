"""A whole run beside another program that publishes its topics, or beside a second run: stopped, and said by whom."""

from __future__ import annotations

import signal
from collections.abc import Callable

import numpy as np
import pytest
from fivebar_command import RATE_HZ, FivebarCommand, GraphRun
from graph_probe import Probe

from fivebar_description.interface import (
    ACTIVE_JOINTS,
    CTC_TORQUE,
    FAULTS,
    JOINT_STATES,
    TORQUE_COMMAND,
    Topic,
    sample_stamp_ns,
)
from fivebar_description.ros.messages import joint_state, stamp_of

FOREIGN = (3.0, -3.0)


def torque_for_next(run: GraphRun) -> object:
    """Return a foreign torque for the sample after the newest."""
    newest = run.probe.got(JOINT_STATES)[-1]
    return joint_state(stamp_of(newest) + sample_stamp_ns(1, RATE_HZ, 0), ACTIVE_JOINTS, effort=FOREIGN)


def first_fault(run: GraphRun) -> str:
    faults = run.probe.got(FAULTS)
    run.probe.wait_for(lambda: faults, "the fault")
    return str(faults[0].data)


@pytest.mark.parametrize("topic", [CTC_TORQUE, TORQUE_COMMAND], ids=lambda topic: topic.name)
@pytest.mark.parametrize("mode", ["lockstep", pytest.param("realtime", marks=pytest.mark.clock)])
def test_a_rogue_in_the_middle_of_a_run(graph_run: Callable[..., GraphRun], mode: str, topic: Topic) -> None:
    run = graph_run(*(["--realtime"] if mode == "realtime" else []))
    run.probe.listen(FAULTS)
    run.wait_for_sample(150)
    rogue = Probe(run.probe.domain, name="rogue")
    try:
        rogue.advertise(topic)
        for _ in range(50):
            rogue.publish(topic, torque_for_next(run))
            run.probe.spin_for(0.002)
        fault = first_fault(run)
        run.expect_no_torque()
    finally:
        rogue.close()
    assert fault.startswith(f"second_publisher: {topic.name} is published by /")
    assert "/rogue (process " in fault
    run.command.send(signal.SIGINT)
    summary = run.finish()
    assert summary["faults"][0] == "second_publisher"
    applied = run.bag().field(JOINT_STATES, "effort")[:, [0, 2]]
    assert not np.any(np.all(applied == FOREIGN, axis=1)), "no torque of the rogue has acted"


def test_a_second_run_in_the_domain_of_the_first(graph_run: Callable[..., GraphRun]) -> None:
    first = graph_run()
    first.probe.listen(FAULTS)
    first.wait_for_sample(150)
    folder = first.out.parent / "second"
    arguments = ("run", str(first.out.parent / "scenario.yaml"), "--json", "--out", str(folder / "out"))
    second = FivebarCommand(folder, *arguments, "--domain", str(first.probe.domain), domain=first.probe.domain)
    try:
        assert first_fault(first).startswith("second_publisher: ")
        first.expect_no_torque()
        first.probe.wait_for(lambda: second.status is not None, "the end of the second run")
        assert second.finish() != 0
        print(second.stdout, second.stderr)
        assert "second_publisher: " in second.stdout + second.stderr
    finally:
        second.close()
    first.command.send(signal.SIGINT)
    assert "second_publisher" in first.finish()["faults"]
