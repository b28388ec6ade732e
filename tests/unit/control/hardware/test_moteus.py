# SPDX-License-Identifier: Apache-2.0
"""Two moteus drives on a bus within this process, whose side makes and reads its frames by itself."""

from __future__ import annotations

import asyncio
import math
import os
import queue
import struct
import threading
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import can
import moteus
import pytest
from moteus.protocol import Register
from served_motors import (
    MISPLACED,
    bridge_file,
    enabled,
    expect_a_pulled_cable_to_be_a_fault,
    expect_an_error_until_it_is_reset,
    expect_no_power_where_it_stands,
    expect_torques_that_have_acted,
    fault_of,
    misplaced,
    posture_of,
    served,
    virtual_link,
)

from fivebar_bringup.drives.run_files import private_bus_link
from fivebar_control.hardware.can_port import CanPort
from fivebar_control.hardware.fault import DriveError
from fivebar_control.hardware.two_motors import NO_POWER, PairCommand, TwoMotors
from fivebar_description.drive_kinds import confirm_installed
from fivebar_description.strict_yaml import InputError, validate
from fivebar_moteus import moteus_faults
from fivebar_moteus.fdcanusb import received
from fivebar_moteus.moteus import MoteusDrives, MoteusLink, open_link
from fivebar_moteus.moteus_frames import DriveFrames, registers_in, sender, text_in
from fivebar_moteus_emulation import moteus_bus as emulated
from fivebar_moteus_emulation import moteus_subframes as wire
from fivebar_moteus_emulation.moteus_bus import MoteusBus
from fivebar_sim.motors.emulation import MotorsEmulation
from fivebar_vendor_drives.kinds import MOTEUS_DRIVES


def drives(**changed: Any) -> AbstractContextManager[MotorsEmulation]:
    return served("moteus", MoteusBus, emulated.ERRORS, (1, 2), **changed)


def connected(**changed: Any) -> TwoMotors:
    motors = bridge_file("moteus").model_dump(mode="json")["motors"]
    for motor in motors.values():
        motor["counts_per_revolution"] = 20000
    file = bridge_file("moteus", **{"motors": motors, **changed})
    return TwoMotors(file, MoteusDrives(file))


def test_torque_and_angle_go_over_the_bus() -> None:
    with drives() as emulation:
        motors = enabled(connected(pace="commands"))
        motors.write((1.5, -1.5))
        for _ in range(10):
            exchange = motors.exchange()
            assert exchange.fault is None
            first, second = exchange.readings
            assert first is not None
            assert second is not None
            # both as they were before their commands
            found = emulation.motors.history[-1].angles
            assert (first.position, second.position) == pytest.approx(found, abs=1e-5)
        assert first.velocity > 0.0 > second.velocity
        assert (first.torque, second.torque) == pytest.approx((1.5, -1.5))
        assert [motor.torque for motor in emulation.motors.motors] == pytest.approx([1.5, -1.5])
        motors.write((9.0, 0.0))
        motors.exchange()
        assert emulation.motors.motors[0].torque == pytest.approx(3.0)
        motors.disable(2.0)
        assert [motor.powered for motor in emulation.motors.motors] == [False, False]
        motors.close()


def test_a_torque_that_is_answered_has_acted() -> None:
    with drives():
        motors = enabled(connected(pace="commands"))
        expect_torques_that_have_acted(motors)
        motors.close()


def test_a_drive_that_is_left_has_no_power() -> None:
    with drives() as emulation:
        motors = enabled(connected())
        motors.write((1.0, 1.0))
        motors.exchange()
        motors.close()
        assert [motor.powered for motor in emulation.motors.motors] == [False, False]


@pytest.mark.parametrize(
    ("name", "cycles"),
    [
        ("UNDER_VOLTAGE", 0),
        ("MOTOR_DRIVER_FAULT", 1),
        ("ENCODER_FAULT", 2),
        ("OVER_TEMPERATURE", 20),
        ("UNDER_VOLTAGE", 60),
    ],
)
def test_an_error_has_the_vendor_s_name_and_is_cleared_by_a_reset(name: str, cycles: int) -> None:
    with drives() as emulation:
        motors = enabled(connected(pace="commands"))
        fault = f"moteus_error: q21 (id 2): {name} ({emulated.ERRORS[name]})"
        expect_an_error_until_it_is_reset(emulation, motors, cycles, f"fault 2 {name}", fault)


def test_a_supply_that_sags_is_a_fault() -> None:
    with drives(voltage=9.0), pytest.raises(DriveError, match=r"moteus_voltage: q11 \(id 1\): 9\.0 V, expected at"):
        connected(set_up_timeout_ms=50).set_up()


def test_the_watchdog_of_a_drive_takes_its_torque() -> None:
    with drives() as emulation:
        motors = enabled(connected(watchdog_ms=100))
        motors.write((0.5, 0.5))
        motors.exchange()
        deadline = threading.Event()
        while any(motor.powered for motor in emulation.motors.motors):
            deadline.wait(0.005)
        assert fault_of(motors) == "moteus_watchdog: q11 (id 1): no command in time"
        assert [motor.torque for motor in emulation.motors.motors] == [0.0, 0.0]
        motors.reset(2.0)
        motors.enable(2.0)
        motors.close()


@pytest.mark.parametrize(("order", "silent"), [("silent 2", r"q21 \(id 2\)"), ("unplug", r"q.1 \(id .\)")])
def test_a_cable_that_is_pulled_is_a_fault(order: str, silent: str) -> None:
    with drives() as emulation:
        motors = enabled(connected(missing_limit=3, gather_deadline_us=1500))
        expect_a_pulled_cable_to_be_a_fault(emulation, motors, order, silent)


@pytest.mark.parametrize(
    ("link", "fault"),
    [
        ({"firmware": 0x010D}, r"moteus_firmware: q11 \(id 1\): firmware 0\.1\.13 with register map 5, expected 1\.x"),
        ({"firmware": 0x020000}, r"moteus_firmware: q11 \(id 1\): firmware 2\.0\.0"),
        ({"register_map": 4}, r"moteus_firmware: .* with register map 4, expected 1\.x with register map 5"),
        (
            {"settings": {"servo.timeout_mode": "12"}},
            r"moteus_configuration: .*timeout_mode is 12, expected 0, so that",
        ),
        ({"settings": {"servo.fixed_voltage_mode": "1"}}, r"moteus_configuration: .*fixed_voltage_mode is 1"),
        ({"rotor_to_output_ratio": 0.5}, r"moteus_configuration: .*rotor_to_output_ratio is 0\.5, expected 1"),
        ({"settings": {"motor.poles": "0"}}, r"moteus_uncalibrated: q11 \(id 1\): motor.poles is 0"),
        ({"encoder_validity": 0}, r"moteus_uncalibrated: .*encoder 0 of commutation has no angle"),
        ({"home_state": 0}, r"moteus_uncalibrated: .*the position refers to nothing yet"),
        ({"settings": {"motor.Kv": "?"}}, r"moteus_configuration: .*motor.Kv cannot be read, answer '\?'"),
    ],
)
def test_a_drive_that_is_not_set_up_gets_no_power(link: dict[str, Any], fault: str) -> None:
    with drives(**link) as emulation:
        with pytest.raises(DriveError, match=fault):
            connected()
        assert not any(motor.powered for motor in emulation.motors.motors)


def test_a_drive_of_another_id_is_missing() -> None:
    motors = bridge_file("moteus").model_dump(mode="json")["motors"]
    motors["q21"]["id"] = 7
    expected = r"drive_missing: q21 \(id 7\): no answer in 1 s; drives that answer: 1, 2"
    with drives(), pytest.raises(DriveError, match=expected):
        connected(motors=motors)


@pytest.mark.parametrize("how", MISPLACED)
def test_a_robot_that_does_not_stand_where_it_is_said_to_gets_no_power(how: str) -> None:
    with drives() as emulation:
        stands = posture_of(emulation)
    with drives(motors=misplaced(how, (1, 2))) as emulation:
        expect_no_power_where_it_stands(emulation, connected(posture=stands))


def test_an_answer_that_comes_late_is_counted_and_not_taken_for_the_next() -> None:
    with drives():
        driver = MoteusDrives(bridge_file("moteus"))
        drive = driver.drives[0]
        assert driver.exchange(NO_POWER, 2.0).late == 0
        driver.send(*drive.frames.query)
        with driver.received:
            assert driver.received.wait_for(lambda: driver._late == 1, 2.0)
        assert driver.exchange(NO_POWER, 2.0).late == 1
        # one that comes once the next command is out
        driver.exchange(PairCommand(True, (0.0, 0.0)), 2.0)
        stale, driver._tag = driver._tag, driver._tag + 1
        driver.send(*drive.frames.torque(0.0, stale))
        answer = driver.exchange(PairCommand(True, (0.0, 0.0)), 2.0)
        assert (answer.late, None in answer.readings) == (1, False)
        driver.close()


def test_both_sides_know_the_same_errors() -> None:
    assert {name: code for code, name in moteus_faults.ERRORS.items()} == emulated.ERRORS
    assert emulated.EMULATOR.understands("fault 1 THETA_INVALID")
    assert not emulated.EMULATOR.understands("fault 1 THETA")
    assert moteus_faults.error_name(77) == "fault (77)"


def test_a_wrong_link_is_refused() -> None:
    with pytest.raises(InputError, match="link: interface"):
        MoteusDrives(bridge_file("moteus", link={"interface": "canusb", "channel": "can0"}))
    link = private_bus_link({"rotor_to_output_ratio": 0.2, "bitrate": 500_000}, Path())
    assert (link["interface"], link["rotor_to_output_ratio"], "bitrate" in link) == ("udp_multicast", 0.2, False)


def test_what_is_not_installed_is_named() -> None:
    confirm_installed(MOTEUS_DRIVES)
    with pytest.raises(InputError, match=r"'moteus': needs the module no_such, .* pip install 'fivebar\[moteus\]'"):
        confirm_installed(MOTEUS_DRIVES._replace(library="no_such"))


def test_frames_are_those_of_the_vendor_s_transport() -> None:
    made = moteus.Controller(id=5)
    frames = DriveFrames(5, 1.5, 0.02)
    sent = moteus.Transport([])._command_to_frame(made.make_stop(query=True))
    assert frames.stop.can_id == sent.arbitration_id == 0x8005
    read = moteus.parse_registers(frames.torque(0.75, 3).data)
    command = read.command
    assert command[Register.MODE] == moteus.Mode.POSITION
    assert math.isnan(command[Register.COMMAND_POSITION])
    assert command[Register.COMMAND_FEEDFORWARD_TORQUE] == 0.75
    assert command[Register.COMMAND_POSITION_MAX_TORQUE] == 1.5
    assert command[Register.COMMAND_TIMEOUT] == pytest.approx(0.02, rel=0.01)
    assert frames.tag_of(command) == 3
    gains = (Register.COMMAND_KP_SCALE, Register.COMMAND_KD_SCALE, Register.COMMAND_ILIMIT_SCALE)
    assert [command[one] for one in gains] == [0.0, 0.0, 0.0]
    assert command[Register.COMMAND_VELOCITY_LIMIT] < 0.0 > command[Register.COMMAND_ACCEL_LIMIT]
    assert {int(register) for register, _ in read.query} == {0, 1, 2, 3, 13, 14, 15, 0x27}
    assert (sender(0x500), sender(0x8005), sender(0x501)) == (5, None, None)
    assert text_in(b"\x41\x01\x02ab\x50") == b"ab"
    assert text_in(frames.query.data) is None


def test_the_emulation_s_values_are_the_vendor_s() -> None:
    """In every resolution: what the emulation writes the vendor reads, and the other way round."""
    values = {0x001: 0.25, 0x002: -1.5, 0x003: 2.0, 0x00D: 24.5, 0x00E: 30.0, 0x00F: 40.0}
    for resolution in range(4):
        data = b"".join(
            wire.reply(register, value, resolution, emulated.KINDS.get(register, wire.WHOLE))
            for register, value in values.items()
        )
        step = 0.5 if resolution == 0 else 0.05
        assert registers_in(data) == pytest.approx(values, abs=step)
        nothing = wire.reply(0x001, math.nan, resolution, wire.POSITION)
        assert math.isnan(registers_in(nothing)[0x001])
    asked = list(wire.subframes(DriveFrames(1, 1.5, 0.02).torque(0.75, 3).data))
    written = {
        one.register: wire.scaled(one.raw, one.resolution, emulated.KINDS.get(one.register, wire.WHOLE))
        for one in asked
        if one.kind == wire.WRITE
    }
    assert written[0x022] == 0.75
    assert math.isnan(written[0x020])


def test_the_vendor_s_library_drives_the_emulation() -> None:
    """Its transport, its controller and its diagnostic stream, on the same bus."""

    async def driven() -> None:
        transport = moteus.Transport(moteus.PythonCanDevice(**virtual_link("moteus")))
        found = await transport.discover()
        assert [one.can_id for one in found] == [1, 2]
        drive = moteus.Controller(id=1, transport=transport)
        stream = moteus.Stream(drive, use_flow_control=False)
        assert await stream.command(b"conf get servo.timeout_mode", allow_any_response=True) == b"0"
        assert (await drive.query()).values[Register.MODE] == moteus.Mode.STOPPED
        command = {"position": math.nan, "kp_scale": 0.0, "kd_scale": 0.0, "feedforward_torque": 0.5, "query": True}
        for _ in range(6):
            answer = await drive.set_position(watchdog_timeout=math.nan, **command)
        assert answer.values[Register.MODE] == moteus.Mode.POSITION
        assert answer.values[Register.TORQUE] == pytest.approx(0.5)
        # with its loops about where it stands it does not let itself be pushed; the next answer has their torque
        for _ in range(2):
            held = await drive.set_position(position=math.nan, velocity=1.0, watchdog_timeout=math.nan, query=True)
        assert held.values[Register.TORQUE] != pytest.approx(0.0, abs=1e-3)
        assert (await drive.set_stop(query=True)).values[Register.MODE] == moteus.Mode.STOPPED
        transport.close()

    with drives():
        asyncio.run(asyncio.wait_for(driven(), 20.0))


def test_a_frame_that_is_cut_off_is_no_answer() -> None:
    with pytest.raises(struct.error):
        registers_in(b"\x2f\x01\x00")
    assert list(wire.subframes(b"\x0f\x01\x00")) == []
    with drives(), can.Bus(**virtual_link("moteus")) as bus:
        motors = enabled(connected())
        bus.send(can.Message(arbitration_id=0x100, data=b"\x2f\x01\x00", is_extended_id=False, is_fd=True))
        assert motors.exchange().fault is None
        motors.close()


def test_a_fdcanusb_carries_frames_as_the_vendor_s_transport_does() -> None:
    """Against the vendor's own lines, on a pty in the place of the adapter."""
    written: list[bytes] = []

    class Port:
        def write(self, line: bytes) -> None:
            written.append(line)

    vendor = moteus.FdcanusbDevice.__new__(moteus.FdcanusbDevice)
    vendor._serial, vendor._disable_brs, vendor._checksum_active = Port(), False, False
    vendor._padding_hex, vendor._debug_log = "50", None
    made = DriveFrames(1, 1.5, 0.02)
    frame = moteus.Frame(made.stop.can_id, made.stop.data, is_fd=True, bitrate_switch=True)
    asyncio.run(vendor._write_send_frame(frame))
    adapter, host = os.openpty()
    bus = open_link(validate({"interface": "fdcanusb", "channel": os.ttyname(host)}, MoteusLink, "test"))
    try:
        port = CanPort(bus, lambda can_id, data: taken.put((can_id, data)), fd=True)
        taken: queue.Queue[tuple[int, bytes]] = queue.Queue()
        port.send(*made.stop)
        assert os.read(adapter, 512) == written[0]
        os.write(adapter, b"OK\r\nERR no\r\nrcv 100 210000 B F\r\nrcv zz\nrcv 10")
        assert taken.get(timeout=2.0) == (0x100, b"\x21\x00\x00")
        os.write(adapter, b"0 2100 E B F\n")
        assert taken.get(timeout=2.0) == (0x100, b"\x21\x00")
        assert port.unreadable == 2
        parsed = vendor._parse_frame(b"rcv 100 210000 B F")
        ours = received(b"rcv 100 210000 B F")
        assert ours is not None
        assert (ours.arbitration_id, ours.is_fd, ours.bitrate_switch) == (parsed.arbitration_id, True, True)
        assert bytes(ours.data) == parsed.data
        port.close()
    finally:
        os.close(adapter)
        os.close(host)
    with pytest.raises(DriveError, match="bus_missing: fdcanusb /no/port: "):
        MoteusDrives(bridge_file("moteus", link={"interface": "fdcanusb", "channel": "/no/port"}))
