# SPDX-License-Identifier: Apache-2.0
"""Bridge bus and emulated drives on one virtual bus in this process, the drives in a thread of their own."""

from __future__ import annotations

import gc
import itertools
import random
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any
from uuid import uuid4

import can
import pytest
from closed_posture import closed_posture
from emulation_file import load_emulation

from fivebar_control.hardware.cia402 import DriveState
from fivebar_control.hardware.configuration import DriveFile, Identity, StartPosture, load_drives
from fivebar_control.hardware.drive_bus import DriveBus
from fivebar_control.hardware.drive_interface import ZERO, Exchange
from fivebar_control.hardware.fault import DriveError
from fivebar_sim.drives.commands import execute
from fivebar_sim.drives.drive import InjectedFault
from fivebar_sim.drives.emulation import Emulation
from fivebar_sim.drives.power_state import PowerState

PERIOD_US = 10_000
DEADLINE = 20.0
ON, OFF = (DriveState.ENABLED, DriveState.ENABLED), (DriveState.SWITCH_ON_DISABLED, DriveState.SWITCH_ON_DISABLED)
PUSH = (0.8, -0.8)


class Bench:
    """Two drives that run, and a bus object that talks to them; time between cycles does not matter to either."""

    def __init__(self) -> None:
        self.channel = uuid4().hex
        self.drives = slow(load_drives("dextar_emulated"))
        file = load_emulation("dextar_emulated").model_copy(update={"sync_period_us": PERIOD_US})
        self._bus = self.open()
        self.emulation = Emulation(file, self._bus)
        self._ending = threading.Event()
        self._errors: list[BaseException] = []
        self._thread = threading.Thread(target=self._run)
        self._thread.start()
        self.other = self.open()
        """A third party on the bus."""

    def _run(self) -> None:
        try:
            self.emulation.run(self._ending)
        except BaseException as error:
            self._errors.append(error)

    def open(self) -> can.BusABC:
        return can.Bus(interface="virtual", channel=self.channel)

    def send(self, can_id: int, data: bytes, extended: bool = False) -> None:
        self.other.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=extended))

    def close(self) -> None:
        self._ending.set()
        self._thread.join()
        self._bus.shutdown()
        self.other.shutdown()
        assert not self._errors


def slow(drives: DriveFile) -> DriveFile:
    """Limits that a busy machine keeps, even where it stands still for a while."""
    watched = {"heartbeat_ms": 20, "heartbeat_timeout_ms": 2000}
    pair = drives.drives.model_copy(
        update={"q11": drives.pair[0].model_copy(update=watched), "q21": drives.pair[1].model_copy(update=watched)}
    )
    master = drives.master.model_copy(update={"heartbeat_ms": 20, "timeout_ms": 2000})
    return drives.model_copy(
        update={
            "sync_period_us": PERIOD_US, "gather_deadline_us": 9000, "missing_limit": 50, "sdo_timeout_ms": 10_000,
            "drives": pair, "master": master,
        }
    )  # fmt: skip


@pytest.fixture
def bench() -> Iterator[Bench]:
    # a collection of all that a process with thousands of tests holds stops both ends of the bus for a second
    gc.disable()
    try:
        bench = Bench()
        yield bench
        bench.close()
    finally:
        gc.enable()


@pytest.fixture
def bus(bench: Bench) -> Iterator[DriveBus]:
    with DriveBus(bench.drives, bench.open()) as bus:
        yield bus


@pytest.fixture
def patient_bus(bench: Bench) -> Iterator[DriveBus]:
    """A bus that awaits every answer, however busy the machine is: exchanges do not wait for the deadline."""
    patient = bench.drives.model_copy(update={"sync_period_us": 100_000, "gather_deadline_us": 90_000})
    with DriveBus(patient, bench.open()) as bus:
        yield bus


def cycles_until(bus: DriveBus, condition: Callable[[Exchange], bool]) -> Exchange:
    end = time.monotonic() + DEADLINE
    while time.monotonic() < end:
        cycle = bus.exchange_paced()
        if condition(cycle):
            return cycle
    raise AssertionError("not seen before the deadline")


def settled(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.001)


def fault_name(cycle: Exchange) -> str:
    return cycle.fault.name if cycle.fault is not None else ""


def push(bus: DriveBus, cycles: int) -> Exchange:
    """Exchange so many times or, where an answer came late, until both have come in time; return the last exchange."""
    for _ in range(cycles - 1):
        bus.write(PUSH)
        bus.exchange()
    end = time.monotonic() + DEADLINE
    while True:
        bus.write(PUSH)
        cycle = bus.exchange()
        if cycle.complete:
            return cycle
        assert time.monotonic() < end


def test_the_two_files_describe_the_same_drives() -> None:
    drives, emulation = load_drives("dextar_emulated"), load_emulation("dextar_emulated")
    assert (drives.bus.interface, drives.bus.channel, drives.bus.port) == tuple(
        getattr(emulation.bus, key) for key in ("interface", "channel", "port")
    )
    assert drives.sync_period_us == emulation.sync_period_us
    for drive, facts in zip(drives.pair, emulation.pair, strict=True):
        assert drive.identity == Identity(vendor=facts.vendor, product=facts.product)
        for key in (
            "node_id", "counts_per_revolution", "gear_ratio", "sign", "home_offset_rad", "rated_torque_nm",
            "velocity_units_per_rev_s",
        ):  # fmt: skip
            assert getattr(drive, key) == getattr(facts, key)


def test_set_up_leaves_the_drives_off(bench: Bench, bus: DriveBus) -> None:
    bus.set_up()
    cycle = cycles_until(bus, lambda cycle: cycle.complete)
    assert cycle.fault is None
    assert bus.states == OFF
    # RPDO 3 and 4 and TPDO 4 are what these drives lack; the TPDO 3 that they came with is silent now
    assert [note.split(": ")[1] for note in bus.notes] == ["0x1402", "0x1403", "0x1803"] * 2
    assert bus.counters == (0, 0, 0)


def test_torque_moves_the_robot_that_the_bus_reads(bench: Bench, patient_bus: DriveBus) -> None:
    bus = patient_bus
    bus.set_up()
    bus.enable(5.0)
    assert bus.states == ON
    before = bench.emulation.plant.joints
    cycle = push(bus, 15)
    first, second = cycle.readings
    assert first is not None and second is not None
    assert (first.torque, second.torque) == pytest.approx(PUSH, abs=1e-12)
    # the plant itself is where it will be at the next SYNC
    at_sync = bench.emulation.history[-1].truth
    after = at_sync.position
    assert after[0] - before[0] > 0.01
    assert after[2] - before[2] < -0.01
    step = 2.0 * 3.1416 / 262144
    assert (first.position, second.position) == pytest.approx((after[0], after[2]), abs=step)
    speeds = at_sync.velocity
    assert (first.velocity, second.velocity) == pytest.approx((speeds[0], speeds[2]), abs=step)
    bus.disable(5.0)
    assert bus.states == OFF
    assert [drive.torque for drive in bench.emulation.drives] == [0.0, 0.0]


def test_a_command_acts_from_the_next_sync_on_and_is_seen_at_the_one_after(patient_bus: DriveBus) -> None:
    bus = patient_bus
    bus.set_up()
    bus.enable(5.0)
    efforts = []
    for torque in (0.4, -0.2, 0.0):
        bus.write((torque, 0.0))
        reading = bus.exchange().readings[0]
        assert reading is not None
        efforts.append(reading.torque)
    assert efforts == pytest.approx([0.0, 0.4, -0.2])


def test_torque_is_quantised_and_limited(bench: Bench, bus: DriveBus) -> None:
    """0.1 % of 2 Nm are 2 mNm; the limit is 5 Nm."""
    bus.set_up()
    bus.enable(5.0)
    for asked, applied in ((0.0131, 0.014), (-0.0029, -0.002), (77.0, 5.0), (-1e6, -5.0)):
        bus.write((asked, 0.0))
        bus.exchange()
        # the answer to a SYNC goes out before the command is obeyed
        settled(lambda wanted=applied: bench.emulation.drives[0].torque == pytest.approx(wanted, abs=1e-12))
    with pytest.raises(ValueError, match="expected finite numbers"):
        bus.write((float("nan"), 1.0))
    bus.exchange()
    settled(lambda: [drive.torque for drive in bench.emulation.drives] == [0.0, 0.0])


def test_no_torque_before_enabling(bench: Bench, bus: DriveBus) -> None:
    bus.set_up()
    push(bus, 5)
    assert bus.states == OFF
    assert [drive.torque for drive in bench.emulation.drives] == [0.0, 0.0]


def test_a_fault_stops_both_and_needs_reset_and_enable(bench: Bench, bus: DriveBus) -> None:
    bus.set_up()
    bus.enable(5.0)
    push(bus, 3)
    bench.emulation.drives[0].inject(InjectedFault.FAULT)
    cycle = cycles_until(bus, lambda cycle: cycle.fault is not None and "7305" in str(cycle.fault))
    assert str(cycle.fault).startswith("drive_fault: q11 (node 1): statusword 0x02")
    cycles_until(bus, lambda _: bus.states == (DriveState.FAULT, DriveState.SWITCH_ON_DISABLED))
    push(bus, 5)
    assert [drive.torque for drive in bench.emulation.drives] == [0.0, 0.0]
    assert not bus.enabled
    with pytest.raises(DriveError, match="drive_fault: q11"):
        bus.enable(1.0)
    bus.reset(5.0)
    push(bus, 5)
    assert bus.states == OFF
    bus.enable(5.0)
    assert bus.states == ON


def with_option(drives: DriveFile, option: int) -> DriveFile:
    q11, q21 = (drive.model_copy(update={"quick_stop_option": option}) for drive in drives.pair)
    return drives.model_copy(update={"drives": drives.drives.model_copy(update={"q11": q11, "q21": q21})})


@pytest.mark.parametrize(("option", "ends"), [(0, OFF), (2, OFF), (6, (DriveState.QUICK_STOP, DriveState.QUICK_STOP))])
def test_a_quick_stop_does_what_its_option_says(
    bench: Bench, option: int, ends: tuple[DriveState, DriveState], monkeypatch: pytest.MonkeyPatch
) -> None:
    """0: no torque at once; 2: the drive brakes, then switches off; 6: it brakes and stays powered."""
    plant, drives, moved = bench.emulation.plant, bench.emulation.drives, bench.emulation.move
    # the torque and the speed of each motor at every SYNC
    applied: list[tuple[tuple[float, float], tuple[float, float]]] = []

    def move(torques: tuple[float, float]) -> None:
        q11, _, q21, _ = plant.joint_velocities.tolist()
        applied.append((torques, (q11, q21)))
        # until an answer comes in time there may be any number of SYNCs; the robot is pushed at twelve of them
        if torques != PUSH or [earlier for earlier, _ in applied].count(PUSH) <= 12:
            moved(torques)

    with DriveBus(with_option(bench.drives, option), bench.open()) as bus:
        bus.set_up()
        bus.enable(5.0)
        monkeypatch.setattr(bench.emulation, "move", move)
        push(bus, 12)
        assert plant.kinetic_energy() > 1e-4
        bus.quick_stop()
        cycles_until(bus, lambda _: bus.states == ends and [drive.torque for drive in drives] == [0.0, 0.0])
        assert not bus.enabled
        # the last torque acts until the SYNC that brings the stop has been obeyed
        pushed = itertools.dropwhile(lambda each: each[0] != PUSH, applied)
        after = list(itertools.dropwhile(lambda each: each[0] == PUSH, pushed))
        powers = [[torque * speed for torque, speed in zip(*each, strict=True)] for each in after]
        if option == 0:
            assert all(torques == (0.0, 0.0) for torques, _ in after)
        else:
            assert all(power <= 0.0 for pair in powers for power in pair)
            # each motor has braked
            assert all(min(of_motor) < 0.0 for of_motor in zip(*powers, strict=True))
        bus.enable(5.0)
        assert bus.states == ON


def test_a_lost_drive_is_noticed_by_the_age_of_its_heartbeat(bench: Bench, bus: DriveBus) -> None:
    bus.set_up()
    bus.enable(5.0)
    bench.emulation.drives[1].inject(InjectedFault.LOST)
    cycles_until(bus, lambda cycle: cycle.readings[1] is None)
    cycle = cycles_until(bus, lambda cycle: fault_name(cycle) == "drive_lost")
    assert "q21 (node 2): last heartbeat" in str(cycle.fault)
    # nor is the other motor left with power
    cycles_until(bus, lambda _: bus.states[0] is DriveState.SWITCH_ON_DISABLED)
    assert not bus.enabled
    # it cannot hear us either, so it stops by itself; once back, its fault is seen
    settled(lambda: bench.emulation.drives[1].state is PowerState.FAULT)
    bench.emulation.drives[1].inject(InjectedFault.NONE)
    cycles_until(bus, lambda cycle: fault_name(cycle) == "drive_fault")
    bus.reset(5.0)
    bus.enable(5.0)


def test_a_master_that_falls_silent_stops_the_drives(bench: Bench, bus: DriveBus) -> None:
    bus.set_up()
    bus.enable(5.0)
    push(bus, 3)
    watched = bench.other
    codes = set()
    end = time.monotonic() + DEADLINE
    while len(codes) < 2 and time.monotonic() < end:
        message = watched.recv(0.1)
        if message is not None and message.arbitration_id in (0x081, 0x082):
            codes.add((message.arbitration_id, int.from_bytes(message.data[:2], "little")))
    assert codes == {(0x081, 0x8130), (0x082, 0x8130)}
    assert [drive.state for drive in bench.emulation.drives] == [PowerState.FAULT] * 2
    assert [drive.torque for drive in bench.emulation.drives] == [0.0, 0.0]


def test_released_drives_do_not_mind_the_silence(bench: Bench, bus: DriveBus) -> None:
    bus.set_up()
    bus.enable(5.0)
    bus.disable(5.0)
    bus.release()
    silence = time.monotonic() + 2.5 * bench.drives.master.timeout_ms / 1e3
    while time.monotonic() < silence:
        message = bench.other.recv(0.05)
        assert message is None or message.arbitration_id not in (0x081, 0x082)
    assert [drive.state for drive in bench.emulation.drives] == [PowerState.SWITCH_ON_DISABLED] * 2


def test_late_answers_are_missing_answers(bench: Bench, bus: DriveBus) -> None:
    bus.set_up()
    bus.enable(5.0)
    assert execute(bench.emulation, "late 1 15\n") == "done: late 1 15"
    cycles_until(bus, lambda cycle: cycle.readings[0] is None)
    execute(bench.emulation, "mend 1")
    cycles_until(bus, lambda cycle: cycle.complete and cycle.fault is None)


def test_bus_off_and_back(bench: Bench, bus: DriveBus) -> None:
    bus.set_up()
    bus.enable(5.0)
    execute(bench.emulation, "bus_off")
    cycles_until(bus, lambda cycle: fault_name(cycle) in ("feedback_missing", "drive_lost"))
    execute(bench.emulation, "bus_on")
    cycles_until(bus, lambda cycle: cycle.complete)


def test_a_frozen_encoder_is_noticed(bench: Bench, bus: DriveBus) -> None:
    bus.set_up()
    bus.enable(5.0)
    execute(bench.emulation, "frozen 1")

    def pushed() -> bool:
        bus.write((1.2, 0.0))
        return fault_name(bus.exchange()) == "encoder_frozen"

    end = time.monotonic() + DEADLINE
    while not pushed():
        assert time.monotonic() < end


def test_a_fault_injected_over_the_bus(bench: Bench, bus: DriveBus) -> None:
    """Object 0x2000 := 1, as an expedited SDO download."""
    bus.set_up()
    bench.send(0x602, bytes((0x2F, 0x00, 0x20, 0x00, 1, 0, 0, 0)))
    cycle = cycles_until(bus, lambda cycle: fault_name(cycle) == "drive_fault")
    assert "q21 (node 2)" in str(cycle.fault)


def test_a_drive_sent_out_of_operational_while_powered_stops(bench: Bench, bus: DriveBus) -> None:
    bus.set_up()
    bus.enable(5.0)
    bench.send(0x000, bytes((0x80, 1)))
    cycle = cycles_until(bus, lambda cycle: cycle.fault is not None)
    assert fault_name(cycle) in ("drive_restarted", "drive_emergency")
    assert bench.emulation.drives[0].state is PowerState.FAULT


def test_noise_on_the_bus_is_counted_and_moves_nothing(bench: Bench, bus: DriveBus) -> None:
    """Frames of unknown ids and of wrong lengths, to the bridge and to the drives, between good cycles."""
    bus.set_up()
    bus.enable(5.0)
    rng = random.Random(1)
    known = (0x181, 0x182, 0x281, 0x282, 0x701, 0x702)
    unknown = malformed = 0
    for _ in range(200):
        if rng.random() < 0.5:
            bench.send(rng.choice(known), rng.randbytes(rng.choice((0, 3, 4, 5, 7, 8))))
            malformed += 1
        else:
            bench.send(rng.choice((0x183, 0x1FF, 0x480, 0x7FF)), rng.randbytes(rng.randrange(9)))
            unknown += 1
    bench.send(0x18DAF110, bytes(8), extended=True)
    # a thread of its own reads the bus, and may have counted all of it before the first cycle
    cycle = cycles_until(bus, lambda _: bus.counters == (unknown, malformed, 1))
    assert bus.states == ON
    assert cycle.fault is None
    assert [drive.torque for drive in bench.emulation.drives] == [0.0, 0.0]


def test_a_short_command_is_not_replies(bench: Bench, bus: DriveBus) -> None:
    bus.set_up()
    bus.enable(5.0)
    bench.send(0x201, bytes((0x0F, 0x00, 0xFF)))
    cycle = cycles_until(bus, lambda cycle: cycle.fault is not None)
    assert "drive_emergency: q11 (node 1): PDO too short (0x8210)" in str(cycle.fault)
    assert bench.emulation.drives[0].torque == 0.0


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"node_id": 9}, r"drive_missing: q11 \(node 9\): No SDO response"),
        ({"identity": Identity(vendor=1, product=2)}, r"drive_identity: q11 \(node 1\): 0x1018 says vendor 0x0000F1BA"),
        ({"rated_torque_nm": 2.1}, r"drive_scale: q11 \(node 1\): 0x6076 says a rated torque of 2 Nm"),
    ],
)
def test_a_drive_that_is_not_the_one_expected(bench: Bench, change: dict[str, object], text: str) -> None:
    first = bench.drives.pair[0].model_copy(update=change)
    pair = bench.drives.drives.model_copy(update={"q11": first})
    # a drive that is not there does not answer later either
    changed = {"drives": pair, **({"sdo_timeout_ms": 500} if "node_id" in change else {})}
    with (
        DriveBus(bench.drives.model_copy(update=changed), bench.open()) as bus,
        pytest.raises(DriveError, match=text),
    ):
        bus.set_up()


@pytest.mark.extra
@pytest.mark.parametrize(
    ("spoil", "text"),
    [
        # a mode that is accepted, and another one that is displayed
        (
            lambda node: node._read_callbacks.insert(0, lambda index, **_: 8 if index == 0x6061 else None),
            r"drive_mode: q21 \(node 2\)",
        ),
        (lambda node: setattr(node.object_dictionary[0x6060], "access_type", "ro"), r"drive_setup: q21 \(node 2\)"),
    ],
    ids=["mode", "object"],
)
def test_firmware_without_the_torque_mode_is_refused(bench: Bench, spoil: Callable[[Any], None], text: str) -> None:
    spoil(bench.emulation.drives[1]._node)
    with DriveBus(bench.drives, bench.open()) as bus, pytest.raises(DriveError, match=text):
        bus.set_up()


def test_a_drive_that_does_not_enable_is_named(bench: Bench, bus: DriveBus, monkeypatch: pytest.MonkeyPatch) -> None:
    """As one whose motor or encoder is not calibrated, or whose STO is open."""
    bus.set_up()
    monkeypatch.setattr(bench.emulation.drives[1]._power, "control", lambda word: False)
    with pytest.raises(DriveError, match=r"drive_stuck: not enabled within 0\.3 s: .*q21 \(node 2\) is switch on"):
        bus.enable(0.3)
    assert not bus.enabled
    settled(lambda: [drive.torque for drive in bench.emulation.drives] == [0.0, 0.0])


def placed(drives: DriveFile, **first: object) -> DriveFile:
    """Bridge's file that declares where the robot of the emulation stands, with other keys of the first drive."""
    q11, _, q21, _ = closed_posture()
    posture = StartPosture(q11=q11, q21=q21, tolerance_rad=0.02)
    pair = drives.drives.model_copy(update={"q11": drives.pair[0].model_copy(update=first)})
    return drives.model_copy(update={"posture": posture, "drives": pair})


@pytest.mark.parametrize("wrong", ["", "swapped", "reversed", "geared", "zero"])
def test_a_robot_that_stands_elsewhere_gets_no_power(bench: Bench, wrong: str) -> None:
    """Also where it seems to, since motors are exchanged or reversed, or have another gear."""
    first, second = bench.drives.pair
    changed: dict[str, object] = {
        "reversed": {"sign": -first.sign},
        "geared": {"gear_ratio": 2.0 * first.gear_ratio},
        "zero": {"home_offset_rad": first.home_offset_rad + 0.1},
    }.get(wrong, {})
    file = placed(bench.drives, **changed)
    if wrong == "swapped":
        exchanged = file.drives.model_copy(
            update={
                "q11": first.model_copy(update={"node_id": second.node_id}),
                "q21": second.model_copy(update={"node_id": first.node_id}),
            }
        )
        file = file.model_copy(update={"drives": exchanged})
    with DriveBus(file, bench.open()) as bus:
        bus.set_up()
        if not wrong:
            bus.confirm_start(DEADLINE)
            bus.enable(DEADLINE)
            return
        with pytest.raises(DriveError, match=r"posture_unconfirmed: q.1 reads .* declared"):
            bus.confirm_start(DEADLINE)
        assert bus.states == OFF
        assert [drive.torque for drive in bench.emulation.drives] == [0.0, 0.0]


@pytest.mark.parametrize(
    ("cycles", "code", "words"),
    [
        (0, "3220", "under-voltage of the DC link"),
        (1, "7110", "brake chopper"),
        (2, "7305", "incremental encoder 1"),
        (20, "4310", "over-temperature of the drive"),
        (60, "3220", "under-voltage of the DC link"),
    ],
)
def test_a_fault_stops_both_drives_at_any_moment(
    bench: Bench, patient_bus: DriveBus, cycles: int, code: str, words: str
) -> None:
    patient_bus.set_up()
    patient_bus.enable(DEADLINE)
    for _ in range(cycles):
        push(patient_bus, 1)
    execute(bench.emulation, f"fault 2 {code}")
    cycle = cycles_until(patient_bus, lambda cycle: cycle.fault is not None and words in str(cycle.fault))
    assert fault_name(cycle) in ("drive_fault", "drive_emergency")
    assert f"(0x{code})" in str(cycle.fault)
    # by the next command at the latest
    cycles_until(patient_bus, lambda _: not patient_bus.enabled)
    settled(lambda: [drive.torque for drive in bench.emulation.drives] == [0.0, 0.0])


@pytest.mark.parametrize(
    "line", ["", "fault", "fault 3", "late 1 nan", "late 1 -5", "late 1 1e9", "explode 1", "fault 1 0000"]
)
def test_a_line_that_is_not_understood_changes_nothing(bench: Bench, line: str) -> None:
    assert execute(bench.emulation, line).startswith("not understood: ")
    assert [drive.network.cut for drive in bench.emulation.drives] == [False, False]


def test_an_interrupted_enabling_switches_off(bench: Bench, bus: DriveBus) -> None:
    bus.set_up()
    bus.enable(5.0)
    bus.switch_off()
    cycles_until(bus, lambda _: bus.states == OFF)
    bus.write(ZERO)
    assert not bus.enabled
