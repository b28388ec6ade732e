# SPDX-License-Identifier: Apache-2.0
"""Every fault at three moments of a crossing: no torque in time, a name, a reset where one is possible, a bag.

What breaks drives, bus and processes happens to the whole graph in real time; what breaks a message happens to the last
node alone, between the recorded samples of the same crossing. Time is counted in SYNCs and samples, because a virtual
machine stands still now and then.
"""

from __future__ import annotations

import math
import signal
from collections.abc import Iterable, Iterator
from typing import Any

import pytest
from fault_bench import FaultBench, fault_bench
from fault_cases import (
    NOTICED,
    ROUNDS_WITHOUT,
    STOP_CYCLES,
    ZERO,
    Broken,
    begin_with_new_bridge,
    break_and_mend_node,
    break_hardware,
    expect_new_run_only,
    expect_readable,
    expect_reset,
)
from graph_probe import Bench
from middle_motion import MiddleMotion, Pair
from std_msgs.msg import String

from fivebar_bringup.drives.kinds import CANOPEN_DRIVES
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.loop.supervisor import Supervisor
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import state_from_platform
from fivebar_description.interface import (
    CTC_TORQUE,
    FAULTS,
    JOINT_STATES,
    JOINTS,
    REFERENCE,
    RUN_READY,
    SAFETY_STATE,
    SUPERVISOR_STATE,
    TORQUE_COMMAND,
    TORQUE_REQUESTED,
    VHC_TORQUE,
    Topic,
    sample_stamp_ns,
)
from fivebar_description.ros.messages import joint_state

RATE_HZ = 50
"""Slow enough for a machine that has other work to do: a cycle is 20 ms."""

DRIVES = {
    "drive fault": Broken("fault 1", "drive_fault"),
    "lost heartbeat": Broken("mute 1", "drive_lost"),
    "frozen encoder": Broken("frozen 1", "encoder_frozen", resets=False),
    "bus off": Broken("bus_off", "feedback_missing", resets=False),
}

NODES = {
    "stale command": Broken("stop blender", "command_stale", answer=TORQUE_COMMAND),
    "killed controller": Broken(
        "kill ctc_controller", "candidate_missing", or_first="command_stale", answer=CTC_TORQUE
    ),
    "killed supervisor": Broken(
        "kill supervisor", "candidate_missing", or_first="command_stale", answer=SUPERVISOR_STATE
    ),
    "killed generator": Broken(
        "kill trajectory_generator", "candidate_missing", or_first="command_stale", answer=REFERENCE
    ),
    "killed estimator": Broken(
        "kill state_estimator", "state_stale", or_first="command_stale", answer=JOINT_STATES, resets=False
    ),
    "killed blender": Broken("kill blender", "command_stale", answer=TORQUE_COMMAND),
    "killed bridge": Broken(f"kill {CANOPEN_DRIVES.bridge}", "state_stale", resets=False),
}


def scenario() -> Scenario:
    content = load_scenario("middle_robot").model_dump(mode="json")
    gains = {"kp": 100.0, "kd": 20.0, "kp_vhc": 100.0, "kd_vhc": 20.0}
    content |= {"name": "matrix", "rate_hz": RATE_HZ, "gains": gains, "safety": {"stop_cycles": STOP_CYCLES}}
    return Scenario.model_validate(content)


def moments() -> dict[str, int]:
    """Samples of the reference away from the locus, in the blending zone and on the locus."""
    made = scenario()
    robot, plan = made.five_bar(), made.plan()
    supervise = Supervisor(plan, RATE_HZ, "condition")
    crossing = round(plan.crossings[0].time * RATE_HZ)

    def sigma(sample: int) -> float:
        x, y, vx, vy, *_ = plan.path.at(sample / RATE_HZ)
        return supervise(sample, state_from_platform(robot, plan.mode, x, y, vx, vy)).sigma

    inside = [sample for sample in range(crossing) if 0.0 < sigma(sample) < 1.0]
    assert sigma(crossing) == 1.0
    assert sigma(crossing // 2) == 0.0
    return {"away": crossing // 2, "in the zone": inside[-1], "on the locus": crossing}


MOMENTS = moments()

ALL_MOMENTS = [pytest.param(one, marks=() if one == "on the locus" else pytest.mark.extra) for one in MOMENTS]
"""Where the least can be done is tried in every test run, the others with the long tests."""

IN_EVERY_RUN = ("lost heartbeat", "killed bridge")
"""One fault of the drives and one of the nodes; the others with the long tests."""


def with_marks(faults: Iterable[str]) -> list[Any]:
    return [pytest.param(one, marks=() if one in IN_EVERY_RUN else pytest.mark.extra) for one in faults]


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FaultBench]:
    with fault_bench(tmp_path_factory.mktemp("matrix"), scenario()) as rig:
        yield rig


@pytest.mark.clock
@pytest.mark.parametrize("moment", ALL_MOMENTS)
@pytest.mark.parametrize("fault", with_marks(DRIVES))
def test_drives_and_bus(rig: FaultBench, fault: str, moment: str) -> None:
    broken = DRIVES[fault]
    break_hardware(rig, broken, MOMENTS[moment], NOTICED.get(broken.order.split()[0], STOP_CYCLES))
    rig.drives.order("mend 1", "mend 2", "bus_on")
    rig.expect_no_torque_for(ROUNDS_WITHOUT * rig.period)
    rig.wait_for_rest()
    expect_reset(rig, broken)


@pytest.mark.clock
@pytest.mark.parametrize("fault", with_marks(NODES))
@pytest.mark.parametrize("moment", ALL_MOMENTS)
def test_nodes(rig: FaultBench, fault: str, moment: str) -> None:
    broken = NODES[fault]
    node = break_and_mend_node(rig, broken, MOMENTS[moment])
    if node == CANOPEN_DRIVES.bridge:
        # the drives have tripped over its silence
        begin_with_new_bridge(rig, tripped=True)
        return
    if node == "state_estimator":
        expect_new_run_only(rig)
        return
    rig.wait_for_rest()
    expect_reset(rig, broken)


@pytest.mark.extra
@pytest.mark.clock
def test_the_bag_tells_it_all(rig: FaultBench) -> None:
    """The recorder has run through all of the above; where another fault may be the first, the name need not come."""
    names = {one.name for one in (*DRIVES.values(), *NODES.values()) if not one.or_first}
    expect_readable(rig.bag, names, rig.stop_recorder)


class LastNode:
    """The blender between the samples of the crossing, and a recorder."""

    def __init__(self, bench: Bench) -> None:
        self.motion = MiddleMotion()
        self.bag = bench.folder / "bag"
        settings = {"workspace": [-0.05, 0.05, 0.01, 0.16], "joint_speed_limit": 5.0, "rest_speed": 0.5}
        safety = {f"safety.{name}": value for name, value in settings.items()}
        bench.start("blender", candidate_deadline_ms=10_000.0, **safety)
        topics = [TORQUE_COMMAND, TORQUE_REQUESTED, FAULTS, SAFETY_STATE]
        self._recorder = bench.start("bag_recorder", directory=str(self.bag), topics=[topic.name for topic in topics])
        self.probe = bench.probe()
        inputs = [JOINT_STATES, REFERENCE, CTC_TORQUE, VHC_TORQUE, SUPERVISOR_STATE]
        self.probe.join("blender", [*inputs, FAULTS], topics)
        self.probe.wait_for(lambda: "bag_recorder" in {one.data for one in self.probe.got(RUN_READY)}, "the recorder")
        self.probe.ask(self.messages(0), [TORQUE_COMMAND], 0)

    def messages(
        self, sample: int, torque: Pair = (0.3, -0.2), speed: float = 1.0, dx: float = 0.0
    ) -> list[tuple[Topic, Any]]:
        """Return a sample's inputs: the robot `speed` times as fast as it was, robot and reference `dx` m aside."""
        motion, stamp = self.motion, sample_stamp_ns(sample, 500)
        x, y, *_ = motion.plan.path.at(sample / 500)
        joints = inverse_geometry(motion.robot, motion.plan.mode, x + dx, y)
        _, velocity = motion.joints(sample)
        return [
            (REFERENCE, motion.reference_message(sample, dx)),
            (CTC_TORQUE, motion.torque_message(sample, torque)),
            (VHC_TORQUE, motion.torque_message(sample, torque)),
            (SUPERVISOR_STATE, motion.supervisor_message(sample, 0.5)),
            (JOINT_STATES, joint_state(stamp, JOINTS, joints, [speed * one for one in velocity], (0.0,) * 4)),
        ]

    def command(self, sample: int, **changes: Any) -> Pair:
        for topic, message in self.messages(sample, **changes):
            self.probe.publish(topic, message)
        tau1, tau2 = self.probe.answer(TORQUE_COMMAND, sample).effort
        return tau1, tau2

    def stop_recorder(self) -> None:
        self._recorder.send(signal.SIGINT)
        assert self._recorder.wait() == 0


@pytest.fixture(scope="module")
def last_node(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LastNode]:
    with Bench(tmp_path_factory.mktemp("last_node")) as bench:
        yield LastNode(bench)


MESSAGES: dict[str, tuple[str, dict[str, Any]]] = {
    "NaN torque": ("torque_undefined", {"torque": (math.nan, 0.1)}),
    "over-speed": ("over_speed", {"speed": 60.0}),
    "out of workspace": ("out_of_workspace", {"dx": 0.051}),
}
SAMPLES_OF_500_HZ = {moment: sample * 500 // RATE_HZ for moment, sample in MOMENTS.items()}


@pytest.mark.parametrize("fault", MESSAGES)
@pytest.mark.parametrize("moment", SAMPLES_OF_500_HZ)
def test_messages(last_node: LastNode, moment: str, fault: str) -> None:
    name, changes = MESSAGES[fault]
    # a little later for each fault, since samples only go on
    first = SAMPLES_OF_500_HZ[moment] + 20 * list(MESSAGES).index(fault)
    assert last_node.command(first) == (0.3, -0.2)
    # no torque in the very cycle in which it is seen, and for as long as it lasts
    for sample in range(first + 1, first + 4):
        assert last_node.command(sample, **changes) == ZERO
    faults = last_node.probe.got(FAULTS)
    last_node.probe.wait_for(
        lambda: bool(faults) and faults[-1].data.startswith(f"{name}: at sample {first + 1}"), name
    )

    def refused() -> bool:
        answer = last_node.probe.reset("/blender")
        assert not answer.success
        return f"not cleared, {name}" in answer.message

    last_node.probe.wait_for(refused, "a refusal that names the cause")
    for sample in range(first + 4, first + 8):
        assert last_node.command(sample) == ZERO
    last_node.probe.wait_for(lambda: last_node.probe.reset("/blender").success, "a reset")
    assert last_node.command(first + 8) == (0.3, -0.2)


def test_the_bag_of_the_last_node(last_node: LastNode) -> None:
    last_node.probe.publish(FAULTS, String(data="emergency_stop: the end"))
    last_node.probe.wait_for(lambda: tuple(last_node.probe.got(TORQUE_COMMAND)[-1].effort) == ZERO, "no torque")
    expect_readable(last_node.bag, {name for name, _ in MESSAGES.values()}, last_node.stop_recorder)
