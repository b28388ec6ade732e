# SPDX-License-Identifier: Apache-2.0
"""The bridge to the motor board as a node, with an emulated board beside it.

What it shares with the bridge to drives on a bus is tested there.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from bench_robot import board_content, posture, robot_file
from diagnostic_msgs.msg import DiagnosticStatus
from graph_probe import Bench
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from served_board import Served, made
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ALL_WELL,
    DRIVES_STATE,
    FAULTS,
    JOINT_STATES,
    JOINTS,
    MOTOR_STATES,
    REFERENCE,
    REFERENCE_NAMES,
    TORQUE_COMMAND,
    sample_stamp_ns,
)
from fivebar_description.ros.messages import joint_state
from fivebar_motkin_emulation.protocol import CommandFrame, CommandReader

pytestmark = pytest.mark.clock

RATE_HZ = 100
STOP = {"safety.stop_cycles": 3}
BRIDGE = "/motkin_bridge"
PUSH = (0.003, -0.003)
"""Less than the friction."""


@pytest.fixture
def board(tmp_path: Path) -> Iterator[Served]:
    served = Served(made(tmp_path, period_us=10_000, button_s=0.0))
    yield served
    served.close()


@pytest.mark.extra
def test_a_button_stops_the_bench_and_is_named_until_it_is_held_again(
    bench: Bench, tmp_path: Path, board: Served
) -> None:
    path = tmp_path / "board.yaml"
    path.write_text(yaml.safe_dump(board_content(tmp_path)))
    probe = bench.probe()
    bench.start("motkin_bridge", drives=str(path), rate_hz=RATE_HZ, command_timeout_ms=10_000.0, **STOP)
    states: list[Any] = []
    answering = True

    def answer(message: Any) -> None:
        states.append(message)
        sample = probe.sample(message, RATE_HZ)
        if answering and sample is not None:
            stamp = sample_stamp_ns(sample, RATE_HZ, probe.epoch_ns)
            probe.publish(TORQUE_COMMAND, joint_state(stamp, ACTIVE_JOINTS, effort=PUSH))

    def change(transition: int) -> bool:
        request = ChangeState.Request(transition=Transition(id=transition))
        return bool(probe.call(ChangeState, f"{BRIDGE}/change_state", request).success)

    def ask(service: str) -> Trigger.Response:
        return probe.call(Trigger, f"{BRIDGE}/{service}", Trigger.Request())

    def pushes() -> bool:
        return bool(states) and tuple(states[-1].effort) == pytest.approx(PUSH, rel=1e-3)

    probe.listen(MOTOR_STATES, callback=answer)
    probe.join("motkin_bridge", [TORQUE_COMMAND, FAULTS], [FAULTS, DRIVES_STATE])
    told = probe.got(DRIVES_STATE)
    assert change(Transition.TRANSITION_CONFIGURE)
    assert change(Transition.TRANSITION_ACTIVATE)
    probe.wait_for(pushes, "the torque")
    assert states[0].position[0] == pytest.approx(yaml.safe_load(path.read_text())["posture"]["q11"], abs=5e-3)
    probe.wait_for(lambda: told[-1].data == ALL_WELL, "drives that follow")
    board.order("button press")
    probe.wait_for(lambda: told[-1].data.startswith("emergency_button: cause 9: "), "the fault")
    status, _ = probe.health(BRIDGE)
    assert (status.level, status.message.partition(":")[0]) == (DiagnosticStatus.ERROR, "emergency_button")
    board.order("button release")
    refused = ask("reset")
    assert not refused.success
    assert "still there: emergency_button" in refused.message
    assert "hold it again for 3 s" in refused.message
    board.order("button hold")
    probe.wait_for(lambda: ask("reset").success, "a reset")
    assert told[-1].data.startswith("drives_off: motkin_bridge/enable ")
    board.order("home")
    assert ask("enable").success
    count = len(states)
    probe.wait_for(lambda: len(states) > count and pushes(), "the torque again")
    answering = False
    assert change(Transition.TRANSITION_DEACTIVATE)
    assert change(Transition.TRANSITION_CLEANUP)
    assert {one.data.partition(":")[0] for one in probe.got(FAULTS)} <= {"emergency_button", "command_stale"}


@pytest.mark.extra
def test_the_inner_loop_follows_the_reference_of_the_present_sample_and_ends_with_a_fault(
    bench: Bench, tmp_path: Path, board: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "board.yaml"
    inner_loop = {"stiffness": 1.0, "robot": str(robot_file(tmp_path))}
    path.write_text(yaml.safe_dump(board_content(tmp_path, inner_loop=inner_loop)))
    frames: list[CommandFrame] = []
    reader, take = CommandReader(), board.board.take

    def recorded(data: bytes, now: float) -> Iterator[bytes]:
        frames.extend(reader.read(data))
        return take(data, now)

    monkeypatch.setattr(board.board, "take", recorded)
    probe = bench.probe()
    bench.start("motkin_bridge", drives=str(path), rate_hz=RATE_HZ, command_timeout_ms=10_000.0, **STOP)
    referenced = True

    def answer(message: Any) -> None:
        sample = probe.sample(message, RATE_HZ)
        if sample is None:
            return
        stamp = sample_stamp_ns(sample, RATE_HZ, probe.epoch_ns)
        probe.publish(JOINT_STATES, joint_state(stamp, JOINTS, posture(tmp_path), (0.0,) * 4))
        if referenced:
            probe.publish(REFERENCE, joint_state(stamp, REFERENCE_NAMES, (0.0, 0.119, 0.0, 0.0), (0.0,) * 4))
        probe.publish(TORQUE_COMMAND, joint_state(stamp, ACTIVE_JOINTS, effort=PUSH))

    def change(transition: int) -> bool:
        request = ChangeState.Request(transition=Transition(id=transition))
        return bool(probe.call(ChangeState, f"{BRIDGE}/change_state", request).success)

    def led() -> bool:
        first, second = frames[-1].motors
        assert first.kp == second.kp
        return first.kp > 0.0 and first.current != 0.0

    probe.listen(MOTOR_STATES, callback=answer)
    probe.join("motkin_bridge", [TORQUE_COMMAND, FAULTS, REFERENCE, JOINT_STATES], [FAULTS, DRIVES_STATE])
    assert change(Transition.TRANSITION_CONFIGURE)
    assert change(Transition.TRANSITION_ACTIVATE)
    probe.wait_for(led, "the inner loop")
    assert frames[-1].motors[0].kp == pytest.approx(1.0)
    referenced = False
    probe.wait_for(lambda: not led() and frames[-1].motors[0].current != 0.0, "the torque alone")
    referenced = True
    probe.wait_for(led, "the inner loop again")
    probe.publish(FAULTS, String(data="tracking_lost: at sample 9"))
    probe.wait_for(lambda: frames[-1].enabled == 0, "motors that are off")
    assert [tuple(motor) for motor in frames[-1].motors] == [(0.0,) * 5] * 2
    assert change(Transition.TRANSITION_DEACTIVATE)
    assert change(Transition.TRANSITION_CLEANUP)
