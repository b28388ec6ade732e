# SPDX-License-Identifier: Apache-2.0
"""The bridge as a node, with emulated drives in a process of their own beside it."""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticStatus
from graph_probe import Bench, ChildProcess
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fivebar_description.files import share_file
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ALL_WELL,
    DRIVES_STATE,
    FAULTS,
    MOTOR_STATES,
    NANOSECONDS,
    RUN_READY,
    RUN_STATUS,
    TORQUE_COMMAND,
    sample_stamp_ns,
)
from fivebar_description.ros.messages import joint_state, stamp_of

pytestmark = pytest.mark.clock
"""The drives follow the clock: nothing else may run beside them."""

RATE_HZ = 100
"""Slow enough for a machine that has other work to do."""

HEARTBEAT_TIMEOUT_MS = 5000
"""Age at which a heartbeat counts as lost, longer than a shared machine stands still."""

STOP_CYCLES = 100
"""Cycles for which the bridge holds the last torque: a second, as for the first command."""

BRIDGE = "/dextar_bridge"


class Rig:
    """Bridge, drives, and a probe that answers samples when it is told to."""

    def __init__(self, bench: Bench, folder: Path, bus: dict[str, Any], **parameters: Any) -> None:
        self.torque: tuple[float, float] | None = None
        self.states: list[Any] = []
        own = {"bus": bus, "sync_period_us": 1_000_000 // RATE_HZ}
        emulation = rewritten("fivebar_sim", folder, own)
        self._bench = bench
        self._emulator = [str(Path(sys.executable).parent / "emulated_drives"), str(emulation)]
        self.probe = bench.probe()
        # before the bridge, which looks for them as soon as it starts where it is to start by itself
        self.start_drives()
        path = rewritten("fivebar_control", folder, {**own, "gather_deadline_us": 8000, "missing_limit": 100}, patient)
        self.process = bench.start(
            "dextar_bridge",
            drives=str(path),
            rate_hz=RATE_HZ,
            command_timeout_ms=1000.0,
            **{"safety.stop_cycles": STOP_CYCLES},
            **parameters,
        )
        self.probe.listen(MOTOR_STATES, callback=self._on_states)
        self.probe.join("dextar_bridge", [TORQUE_COMMAND, FAULTS], [FAULTS, DRIVES_STATE])

    def start_drives(self) -> None:
        self.drives = self._bench.run(self._emulator)
        self.probe.wait_for(lambda: "ready" in self.drives.stdout, "the drives are there")

    def _on_states(self, message: Any) -> None:
        self.states.append(message)
        sample = self.probe.sample(message, RATE_HZ)
        if self.torque is not None and sample is not None:
            self.command(sample, self.torque)

    def command(self, sample: int, torque: tuple[float, float]) -> None:
        stamp = sample_stamp_ns(sample, RATE_HZ, self.probe.epoch_ns)
        self.probe.publish(TORQUE_COMMAND, joint_state(stamp, ACTIVE_JOINTS, effort=torque))

    def change(self, transition: int) -> bool:
        request = ChangeState.Request(transition=Transition(id=transition))
        return bool(self.probe.call(ChangeState, f"{BRIDGE}/change_state", request).success)

    def state(self) -> int:
        return int(self.probe.call(GetState, f"{BRIDGE}/get_state", GetState.Request()).current_state.id)

    def ask(self, service: str) -> Trigger.Response:
        return self.probe.call(Trigger, f"{BRIDGE}/{service}", Trigger.Request())

    def silent(self) -> bool:
        """Listen for the time of many samples; return whether none has come."""
        count = len(self.states)
        self.probe.spin_for(30 / RATE_HZ)
        return len(self.states) == count

    def faults(self) -> list[str]:
        return [message.data.partition(":")[0] for message in self.probe.got(FAULTS)]

    def wait_for_state(self, text: str) -> None:
        """Wait until drives/state begins with a text."""
        told = self.probe.got(DRIVES_STATE)
        self.probe.wait_for(lambda: bool(told) and told[-1].data.startswith(text), f"drives/state {text}")

    def wait_for_effort(self, torque: tuple[float, float]) -> None:
        self.probe.wait_for(
            lambda: bool(self.states) and tuple(self.states[-1].effort) == pytest.approx(torque, abs=1e-9),
            f"an applied torque of {torque} Nm",
        )


def patient(content: dict[str, Any]) -> None:
    """Let drives and bridge wait for each other's heartbeats."""
    content["master"]["timeout_ms"] = HEARTBEAT_TIMEOUT_MS
    for drive in content["drives"].values():
        drive["heartbeat_timeout_ms"] = HEARTBEAT_TIMEOUT_MS


def rewritten(
    package: str,
    folder: Path,
    changes: dict[str, Any],
    change: Callable[[dict[str, Any]], None] = lambda content: None,
) -> Path:
    content = yaml.safe_load(share_file(package, "config", "drives", "dextar_emulated.yaml").read_text())
    change(content)
    path = folder / f"{package}.yaml"
    path.write_text(yaml.safe_dump({**content, **changes}))
    return path


@pytest.fixture
def bus_section() -> dict[str, Any]:
    rng = random.Random(os.getpid() ^ time.monotonic_ns())
    channel = f"239.75.{rng.randrange(256)}.{rng.randrange(1, 255)}"
    return {"interface": "udp_multicast", "channel": channel, "port": rng.randrange(20000, 60000)}


@pytest.fixture
def rig(bench: Bench, tmp_path: Path, bus_section: dict[str, Any]) -> Iterator[Rig]:
    yield Rig(bench, tmp_path, bus_section)


def activated(rig: Rig) -> None:
    assert rig.change(Transition.TRANSITION_CONFIGURE), rig.faults()
    assert rig.change(Transition.TRANSITION_ACTIVATE), rig.faults()


def test_a_life_from_configure_to_cleanup(rig: Rig) -> None:
    assert rig.state() == State.PRIMARY_STATE_UNCONFIGURED
    # what cannot be done in this state is refused, and is not the end of the node
    assert not rig.change(Transition.TRANSITION_DEACTIVATE)
    assert rig.change(Transition.TRANSITION_CONFIGURE), rig.faults()
    assert rig.state() == State.PRIMARY_STATE_INACTIVE
    assert rig.states == []
    assert rig.change(Transition.TRANSITION_ACTIVATE), rig.faults()
    # sample 0 until it is answered, at zero torque
    rig.probe.wait_for(lambda: len(rig.states) > 3, "repeats of sample 0")
    # a stamp is the time: of sample 0 the present one, and where the machine is slow an earlier one
    assert {stamp_of(message) for message in rig.states} <= set(rig.probe.epochs[1:])
    now, period = rig.probe.node.get_clock().now().nanoseconds, NANOSECONDS // RATE_HZ
    assert abs(now - rig.probe.epoch_ns) < 60 * NANOSECONDS
    assert rig.probe.epoch_ns % period == 0
    assert all(list(message.name) == list(ACTIVE_JOINTS) for message in rig.states)
    # the friction offset lets the motors creep
    assert list(rig.states[0].position) == pytest.approx([1.65734029, 1.48425236], abs=5e-3)
    rig.torque = (0.8, -0.6)
    rig.command(0, rig.torque)
    rig.wait_for_effort(rig.torque)
    samples = [rig.probe.sample(message, RATE_HZ) for message in rig.states]
    started = [sample for sample in samples if sample]
    assert started == sorted(set(started))
    rig.probe.wait_for(lambda: rig.states[-1].position[0] > 1.67, "the robot moves")
    assert rig.change(Transition.TRANSITION_DEACTIVATE)
    rig.torque = None
    rig.probe.wait_for(rig.silent, "the end of the samples")
    count = len(rig.states)
    # begins anew where the robot stands, and now
    before = rig.probe.epoch_ns
    assert rig.change(Transition.TRANSITION_ACTIVATE), rig.faults()
    rig.probe.wait_for(lambda: len(rig.states) > count, "sample 0 again")
    assert stamp_of(rig.states[-1]) == rig.probe.epoch_ns > before
    assert rig.states[-1].position[0] > 1.67
    assert rig.change(Transition.TRANSITION_DEACTIVATE)
    assert rig.change(Transition.TRANSITION_CLEANUP)
    assert rig.state() == State.PRIMARY_STATE_UNCONFIGURED
    assert rig.faults() == []


def test_a_stale_command_is_zero_torque_until_reset(rig: Rig) -> None:
    activated(rig)
    rig.torque = (0.5, 0.5)
    rig.wait_for_effort(rig.torque)
    rig.torque = None
    rig.probe.wait_for(lambda: rig.faults() == ["command_stale"], "the fault")
    rig.wait_for_effort((0.0, 0.0))
    status, _ = rig.probe.health(BRIDGE)
    assert (status.level, status.message.startswith("command_stale: ")) == (DiagnosticStatus.ERROR, True)
    # commands that come again change nothing before the reset
    rig.torque = (0.5, 0.5)
    count = len(rig.states)
    rig.probe.wait_for(lambda: len(rig.states) > count + 20, "more samples")
    assert {tuple(message.effort) for message in rig.states[count + 2 :]} == {(0.0, 0.0)}
    rig.wait_for_state("command_stale: ")
    answer = rig.ask("reset")
    assert answer.success
    assert answer.message.startswith("cleared command_stale: ")
    # the quick stop has switched the drives off, and nothing enables by itself
    rig.wait_for_state("drives_off: dextar_bridge/enable ")
    count = len(rig.states)
    rig.probe.wait_for(lambda: len(rig.states) > count + 20, "more samples")
    assert {tuple(message.effort) for message in rig.states[count:]} == {(0.0, 0.0)}
    assert rig.ask("enable").success
    rig.wait_for_state(ALL_WELL)
    rig.wait_for_effort(rig.torque)
    assert rig.faults() == ["command_stale"]


@pytest.mark.extra
def test_a_fault_of_another_node_stops_the_drives(rig: Rig) -> None:
    # while there is no power there is nothing to stop
    rig.probe.publish(FAULTS, String(data="tracking_lost: early"))
    activated(rig)
    rig.wait_for_state(ALL_WELL)
    rig.torque = (0.5, 0.5)
    rig.wait_for_effort(rig.torque)
    rig.probe.publish(FAULTS, String(data="tracking_lost: 60 mm"))
    rig.wait_for_state("tracking_lost: 60 mm")
    rig.wait_for_effort((0.0, 0.0))
    answer = rig.ask("enable")
    assert (answer.success, answer.message) == (False, "reset first: tracking_lost: 60 mm")
    assert rig.ask("reset").success
    assert rig.ask("enable").success
    rig.wait_for_effort(rig.torque)
    assert rig.change(Transition.TRANSITION_DEACTIVATE)
    rig.wait_for_state("drives_off: dextar_bridge is not active")
    assert "command_stale" not in rig.faults()


@pytest.mark.extra
def test_the_drives_follow_the_brake_until_it_commands_zero(bench: Bench, tmp_path: Path, bus_section: Any) -> None:
    """A fault that the blender brakes for stops the drives with its zero torque, another one at once."""
    rig = Rig(bench, tmp_path, bus_section, **{"safety.brake_duration": 59.0})
    activated(rig)
    rig.torque = (0.5, 0.5)
    rig.wait_for_effort(rig.torque)
    rig.probe.publish(FAULTS, String(data="tracking_lost: 60 mm"))
    rig.torque = (-0.4, 0.2)
    rig.wait_for_effort(rig.torque)
    assert rig.probe.got(DRIVES_STATE)[-1].data == ALL_WELL
    rig.torque = (0.0, 0.0)
    rig.wait_for_state("tracking_lost: 60 mm")
    assert rig.ask("reset").success
    assert rig.ask("enable").success
    rig.torque = (0.5, 0.5)
    rig.wait_for_effort(rig.torque)
    rig.probe.publish(FAULTS, String(data="near_type_1: 0.1"))
    rig.probe.publish(FAULTS, String(data="estimate_lost: mirrored"))
    rig.wait_for_state("estimate_lost: mirrored")
    rig.wait_for_effort((0.0, 0.0))


@pytest.mark.extra
def test_the_drives_do_not_follow_a_brake_for_longer_than_its_limit(
    bench: Bench, tmp_path: Path, bus_section: Any
) -> None:
    rig = Rig(bench, tmp_path, bus_section, **{"safety.brake_duration": 0.1})
    activated(rig)
    rig.torque = (0.5, 0.5)
    rig.wait_for_effort(rig.torque)
    rig.probe.publish(FAULTS, String(data="tracking_lost: 60 mm"))
    rig.wait_for_state("tracking_lost: 60 mm")
    rig.wait_for_effort((0.0, 0.0))


@pytest.mark.extra
def test_an_emergency_stop_needs_reset_and_enable(rig: Rig) -> None:
    activated(rig)
    rig.torque = (0.5, 0.5)
    rig.wait_for_effort(rig.torque)
    assert rig.ask("emergency_stop").success
    rig.wait_for_effort((0.0, 0.0))
    assert rig.faults() == ["emergency_stop"]
    answer = rig.ask("enable")
    assert (answer.success, answer.message.startswith("reset first: emergency_stop")) == (False, True)
    answer = rig.ask("reset")
    assert answer.success
    assert answer.message.endswith("the drives are off, dextar_bridge/enable switches them on")
    count = len(rig.states)
    rig.probe.wait_for(lambda: len(rig.states) > count + 20, "more samples")
    assert {tuple(message.effort) for message in rig.states[count:]} == {(0.0, 0.0)}
    assert rig.ask("enable").success
    rig.wait_for_effort(rig.torque)


def test_malformed_commands_move_nothing(rig: Rig) -> None:
    rig.command(0, (1.0, 1.0))
    rig.probe.wait_for(lambda: "torque_command: the drives are not enabled" in rig.process.stderr, "a warning")
    activated(rig)
    rig.probe.wait_for(lambda: len(rig.states) > 1, "sample 0")
    for effort in ((float("nan"), 0.0), (float("inf"), 0.0), (1.0,), ()):
        stamp = rig.probe.epoch_ns
        rig.probe.publish(TORQUE_COMMAND, joint_state(stamp, ACTIVE_JOINTS, effort=effort))
    rig.command(7, (1.0, 1.0))
    rig.probe.wait_for_dropped(BRIDGE, 6)
    assert {tuple(message.effort) for message in rig.states} == {(0.0, 0.0)}
    assert rig.faults() == []


@pytest.mark.extra
def test_lost_drives_are_a_named_fault_and_found_again_by_configuring(rig: Rig, bench: Bench, tmp_path: Path) -> None:
    activated(rig)
    rig.drives.close()
    rig.probe.wait_for(lambda: bool(rig.faults()), "the fault")
    assert rig.faults()[0] in ("drive_lost", "feedback_missing")
    answer = rig.ask("reset")
    assert (answer.success, answer.message.startswith("still there: ")) == (False, True)
    assert rig.change(Transition.TRANSITION_DEACTIVATE)
    assert rig.change(Transition.TRANSITION_CLEANUP)
    assert not rig.change(Transition.TRANSITION_CONFIGURE)
    assert rig.faults()[-1] == "drive_missing"
    again: ChildProcess = bench.run(
        [str(Path(sys.executable).parent / "emulated_drives"), str(tmp_path / "fivebar_sim.yaml")]
    )
    rig.probe.wait_for(lambda: "ready" in again.stdout, "the drives are back")
    activated(rig)


@pytest.mark.extra
def test_autostart_and_an_orderly_end(bench: Bench, tmp_path: Path, bus_section: dict[str, Any]) -> None:
    rig = Rig(bench, tmp_path, bus_section, autostart=True)
    rig.torque = (0.5, 0.5)
    rig.wait_for_effort(rig.torque)
    rig.process.send(signal.SIGTERM)
    assert rig.process.wait() == 0, rig.process.stderr
    assert "Traceback" not in rig.process.stderr, rig.process.stderr


@pytest.fixture
def laboratory(bench: Bench, tmp_path: Path, bus_section: dict[str, Any]) -> Iterator[Rig]:
    """As in a run, with a last sample and a node that is awaited."""
    yield Rig(bench, tmp_path, bus_section, samples=1000, wait_for_nodes=["late"])


def test_configure_and_activate_may_follow_at_once(laboratory: Rig) -> None:
    """The node that lacks announces itself while configure waits for it."""
    probe = laboratory.probe
    probe.node.create_timer(1.0, lambda: probe.publish(RUN_READY, String(data="late")))
    activated(laboratory)
    probe.wait_for(lambda: laboratory.states, "sample 0")
    assert laboratory.faults() == []


def test_the_operator_tries_again_where_configure_has_failed(laboratory: Rig) -> None:
    probe = laboratory.probe
    probe.listen(RUN_STATUS)
    probe.publish(RUN_READY, String(data="late"))
    laboratory.drives.close()
    assert not laboratory.change(Transition.TRANSITION_CONFIGURE)
    assert laboratory.state() == State.PRIMARY_STATE_UNCONFIGURED
    laboratory.wait_for_state("drive_")
    status, _ = probe.health(BRIDGE)
    assert status.level == DiagnosticStatus.ERROR
    laboratory.start_drives()
    activated(laboratory)
    laboratory.wait_for_state("ok")
    probe.wait_for(lambda: laboratory.states, "sample 0")
    assert laboratory.faults() == []
    assert {json.loads(message.data)["state"] for message in probe.got(RUN_STATUS)} == {"running"}
