# SPDX-License-Identifier: Apache-2.0
"""What each node answers: the plain functions' figures to the last bit, under the stamp of the sample."""

from __future__ import annotations

import time
from array import array

import pytest
from bound_laws import bound_law
from graph_probe import RATE_HZ, Bench, Probe
from middle_motion import MiddleMotion

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.estimation.imu_check import ImuCheck
from fivebar_control.laws.blend import blending_weight
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.scenario.guard_settings import motor_torque_limit
from fivebar_description.imu import STANDARD_GRAVITY, ImuSettings
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    CTC_TORQUE,
    IMU_DATA,
    IMU_ERROR,
    JOINT_STATES,
    REFERENCE,
    REFERENCE_NAMES,
    SUPERVISOR_NAMES,
    SUPERVISOR_SIGMA,
    SUPERVISOR_STATE,
    UNIFIED_TORQUE,
    VHC_TORQUE,
    sample_stamp_ns,
)
from fivebar_description.ros.messages import stamp_of

PARTS = {
    "trajectory_generator": ([JOINT_STATES], [REFERENCE]),
    "supervisor": ([JOINT_STATES], [SUPERVISOR_STATE, SUPERVISOR_SIGMA]),
    "ctc_controller": ([JOINT_STATES, REFERENCE], [CTC_TORQUE]),
    "vhc_controller": ([JOINT_STATES, REFERENCE], [VHC_TORQUE]),
    "unified_controller": ([JOINT_STATES, REFERENCE], [UNIFIED_TORQUE]),
    "imu_listener": ([IMU_DATA, REFERENCE], [IMU_ERROR]),
}
"""Default gains of both laws."""


@pytest.fixture(scope="module")
def probes(shared_bench: Bench) -> dict[str, Probe]:
    """Every node in a namespace of its own, with a probe that plays the rest of the graph."""
    for node in PARTS:
        shared_bench.start(node, f"/{node}")
    probes = {node: shared_bench.probe(f"/{node}") for node in PARTS}
    for node, (inputs, outputs) in PARTS.items():
        probes[node].join(node, inputs, outputs)
    return probes


def interesting_samples(motion: MiddleMotion) -> list[int]:
    """Start, a segment's middle, around the locus, the boundary of the segments, and past the end."""
    zone = range(motion.crossing - 12, motion.crossing + 13, 4)
    return sorted({0, 1, 2, 7, 100, *zone, 499, 500, 501, 999, 1000, 1001})


def test_trajectory_generator_is_one_sample_ahead(probes: dict[str, Probe], motion: MiddleMotion) -> None:
    probe = probes["trajectory_generator"]
    probe.ask([(JOINT_STATES, motion.joint_states_message(0))], [REFERENCE], 1)
    assert probe.samples(REFERENCE)[:2] == [0, 1]
    for sample in interesting_samples(motion)[1:]:
        before = len(probe.got(REFERENCE))
        probe.publish(JOINT_STATES, motion.joint_states_message(sample))
        probe.answer(REFERENCE, sample + 1)
        assert probe.samples(REFERENCE)[before:][-1:] == [sample + 1]
        # that of the sample itself, too, where the one before was not measured
        assert sample in probe.samples(REFERENCE)
    for sample, message in zip(probe.samples(REFERENCE), probe.got(REFERENCE), strict=True):
        assert sample is not None
        x, y, vx, vy, ax, ay = motion.plan.path.at(sample / RATE_HZ)
        assert tuple(message.name) == REFERENCE_NAMES
        assert tuple(message.position) == (x, y, vx, vy)
        assert tuple(message.velocity) == (vx, vy, ax, ay)
        assert len(message.effort) == 0


def test_supervisor_weighs_every_sample(probes: dict[str, Probe], motion: MiddleMotion) -> None:
    probe = probes["supervisor"]
    sigmas = []
    for sample in interesting_samples(motion):
        if sample == 0:
            probe.ask([(JOINT_STATES, motion.joint_states_message(0))], [SUPERVISOR_STATE], 0)
            probe.wait_for(lambda: probe.got(SUPERVISOR_SIGMA), "sigma of sample 0")
        else:
            probe.publish(JOINT_STATES, motion.joint_states_message(sample))
        message = probe.answer(SUPERVISOR_STATE, sample)
        kappa = inverse_condition(motion.state(sample))
        sigma = blending_weight(kappa, motion.plan.epsilon_at(sample / RATE_HZ))
        assert tuple(message.name) == SUPERVISOR_NAMES
        assert tuple(message.position) == (sigma, kappa)
        assert (len(message.velocity), len(message.effort)) == (0, 0)
        probe.wait_for(lambda wanted=sigma: probe.got(SUPERVISOR_SIGMA)[-1].data == wanted, "the same sigma alone")
        sigmas.append(sigma)
    assert set(sigmas) > {0.0, 1.0}, "the samples are to cover outside, inside and the rim of a zone"


@pytest.mark.parametrize("node", ["ctc_controller", "vhc_controller", "unified_controller"])
def test_candidates_are_the_laws_torques(probes: dict[str, Probe], motion: MiddleMotion, node: str) -> None:
    probe, topic = probes[node], PARTS[node][1][0]
    names = {"ctc_controller": "ctc", "vhc_controller": "vhc_cartesian", "unified_controller": "unified"}
    # the unified law keeps to the drives' limit
    more = {"unified": {"torque_limit": motor_torque_limit(load_scenario("unified_middle"))}}
    laws = {
        one: bound_law(name, motion.robot, motion.plan, RATE_HZ, **more.get(name, {})) for one, name in names.items()
    }
    for sample in interesting_samples(motion):
        inputs = [(JOINT_STATES, motion.joint_states_message(sample)), (REFERENCE, motion.reference_message(sample))]
        if sample == 0:
            probe.ask(inputs, [topic], 0)
        for one, message in reversed(inputs):
            probe.publish(one, message)
        answer = probe.answer(topic, sample)
        assert tuple(answer.name) == ACTIVE_JOINTS
        assert tuple(answer.effort) == laws[node](sample, motion.state(sample), motion.reference(sample))
        assert (len(answer.position), len(answer.velocity)) == (0, 0)


def test_imu_listener_compares_magnitudes(probes: dict[str, Probe], motion: MiddleMotion) -> None:
    probe = probes["imu_listener"]
    plan = motion.plan
    check = ImuCheck(motion.robot, plan.mode, RATE_HZ, ImuSettings())
    for sample in (0, 1, 2, 100, 400):
        measured = (3.0 + 0.1 * sample, -1.0 / 3.0)
        wanted = check.error((*measured, STANDARD_GRAVITY), plan.path.at(sample / RATE_HZ))
        asked = 0.0

        def answered(sample: int = sample, measured: tuple[float, float] = measured, wanted: float = wanted) -> bool:
            nonlocal asked
            if time.monotonic() - asked > 0.2:
                asked = time.monotonic()
                probe.publish(REFERENCE, motion.reference_message(sample))
                probe.publish(IMU_DATA, motion.imu_message(sample, measured))
            return any(message.data == wanted for message in probe.got(IMU_ERROR))

        probe.wait_for(answered, f"the error {wanted} of sample {sample}")
    # its answers carry no stamp: one each, in order, is what there is to see
    assert len(probe.got(IMU_ERROR)) == 5


@pytest.mark.parametrize(
    "node", ["trajectory_generator", "supervisor", "ctc_controller", "vhc_controller", "unified_controller"]
)
def test_repeated_sample_gets_the_same_answer_again(probes: dict[str, Probe], motion: MiddleMotion, node: str) -> None:
    probe, topic = probes[node], PARTS[node][1][0]
    # the generator's answers are one sample ahead
    ahead = 1 if topic is REFERENCE else 0
    start = 2000

    def publish(sample: int, velocity: float | None = None) -> None:
        message = motion.joint_states_message(sample)
        if velocity is not None:
            message.velocity = array("d", [velocity] * 4)
        probe.publish(JOINT_STATES, message)

    for sample in (start, start + 1, start + 2):
        if REFERENCE in PARTS[node][0]:
            probe.publish(REFERENCE, motion.reference_message(sample))
        publish(sample)
        # a sample is repeated once it is answered
        probe.answer(topic, sample + ahead)
        if sample == start + 1:
            # other figures under the same stamp: the answer must not be computed anew; an old stamp gets none
            publish(start + 1, velocity=7.0)
            publish(start)
    stamps = [stamp_of(message) for message in probe.got(topic)]
    first = stamps.index(sample_stamp_ns(start + 1 + ahead, RATE_HZ))
    assert stamps[first:] == [sample_stamp_ns(start + ahead + k, RATE_HZ) for k in (1, 1, 2)]
    assert probe.got(topic)[first] == probe.got(topic)[first + 1]
