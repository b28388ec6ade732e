# SPDX-License-Identifier: Apache-2.0
"""Two robots in one domain: what happens in one namespace does not reach the other."""

from __future__ import annotations

from graph_probe import Bench
from middle_motion import MiddleMotion
from std_msgs.msg import String

from fivebar_description.interface import (
    CTC_TORQUE,
    FAULTS,
    JOINT_STATES,
    REFERENCE,
    SUPERVISOR_SIGMA,
    SUPERVISOR_STATE,
    TORQUE_COMMAND,
)


def test_two_robots_do_not_mix(bench: Bench, motion: MiddleMotion) -> None:
    probes = {namespace: bench.probe(namespace) for namespace in ("/a", "/b")}
    for namespace in probes:
        bench.start("supervisor", namespace)
        bench.start("blender", namespace, controller="ctc")
    outputs = [SUPERVISOR_STATE, SUPERVISOR_SIGMA, TORQUE_COMMAND]
    for probe in probes.values():
        probe.advertise(REFERENCE, CTC_TORQUE, FAULTS)
        probe.join("supervisor", [JOINT_STATES], outputs)
        probe.join("blender", [JOINT_STATES, REFERENCE, CTC_TORQUE, FAULTS], [])

    def ask(namespace: str, sample: int, torque: tuple[float, float]) -> tuple[float, ...]:
        inputs = [
            (REFERENCE, motion.reference_message(sample)),
            (CTC_TORQUE, motion.torque_message(sample, torque)),
            (JOINT_STATES, motion.joint_states_message(sample)),
        ]
        probes[namespace].ask(inputs, [SUPERVISOR_STATE, TORQUE_COMMAND], sample)
        return tuple(probes[namespace].answer(TORQUE_COMMAND, sample).effort)

    assert ask("/a", 0, (1.0, 2.0)) == (1.0, 2.0)
    assert ask("/b", 3, (3.0, 4.0)) == (3.0, 4.0)
    assert set(probes["/a"].samples(TORQUE_COMMAND)) == set(probes["/a"].samples(SUPERVISOR_STATE)) == {0}
    assert set(probes["/b"].samples(TORQUE_COMMAND)) == set(probes["/b"].samples(SUPERVISOR_STATE)) == {3}

    # a fault in one of them stops that one
    probes["/a"].publish(FAULTS, String(data="drive_hot: 90 degrees"))

    def stopped() -> bool:
        status, _ = probes["/b"].health("/a/blender")
        return status.message == "drive_hot: 90 degrees"

    probes["/b"].wait_for(stopped, "the blender of /a has the fault")
    assert ask("/a", 5, (1.0, 2.0)) == (0.0, 0.0)
    assert ask("/b", 5, (3.0, 4.0)) == (3.0, 4.0)
