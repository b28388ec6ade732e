# SPDX-License-Identifier: Apache-2.0
"""Two ODrives on a bus within this process, whose side puts its frames together by itself."""

from __future__ import annotations

import struct
import threading
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import can
import pytest
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
)

from fivebar_bringup.drives.run_files import private_bus_link
from fivebar_control.hardware.fault import DriveError
from fivebar_control.hardware.two_motors import TwoMotors
from fivebar_description.strict_yaml import InputError
from fivebar_odrive import odrive
from fivebar_odrive.odrive import FAULTS, ODrives, error_names, frame_id
from fivebar_odrive_emulation import odrive_bus as emulated
from fivebar_odrive_emulation.odrive_bus import ODriveBus
from fivebar_sim.motors.emulation import MotorsEmulation


def drives(**changed: Any) -> AbstractContextManager[MotorsEmulation]:
    return served("odrive", ODriveBus, emulated.ERRORS, (0, 1), **changed)


def connected(**changed: Any) -> TwoMotors:
    file = bridge_file("odrive", **changed)
    return TwoMotors(file, ODrives(file))


def test_torque_and_angle_go_over_the_bus() -> None:
    with drives() as emulation:
        motors = enabled(connected())
        motors.write((1.5, -1.5))
        exchanges = [motors.exchange() for _ in range(10)]
        assert not any(one.fault for one in exchanges)
        exchange = [one for one in exchanges if one.complete][-1]
        first, second = exchange.readings
        assert first is not None
        assert second is not None
        assert first.velocity > 0.0 > second.velocity
        assert [motor.torque for motor in emulation.motors.motors] == pytest.approx([1.5, -1.5])
        motors.disable(2.0)
        assert [motor.powered for motor in emulation.motors.motors] == [False, False]
        motors.close()


def test_a_torque_that_is_answered_has_acted() -> None:
    with drives():
        motors = enabled(connected())
        expect_torques_that_have_acted(motors)
        motors.close()


@pytest.mark.parametrize(
    ("name", "cycles"),
    [
        ("DC_BUS_UNDER_VOLTAGE", 0),
        ("BRAKE_RESISTOR_DISARMED", 1),
        ("MISSING_ESTIMATE", 2),
        ("ESTOP_REQUESTED", 20),
        ("DC_BUS_UNDER_VOLTAGE", 60),
    ],
)
def test_an_error_has_the_vendor_s_name_and_is_cleared_by_a_reset(name: str, cycles: int) -> None:
    with drives() as emulation:
        fault = f"odrive_error: q21 (node 1): {name}"
        expect_an_error_until_it_is_reset(emulation, enabled(connected()), cycles, f"fault 2 {name}", fault)


@pytest.mark.parametrize(("order", "silent"), [("silent 2", r"q21 \(id 1\)"), ("unplug", r"q.1 \(id .\)")])
def test_a_cable_that_is_pulled_is_a_fault(order: str, silent: str) -> None:
    with drives() as emulation:
        motors = enabled(connected(missing_limit=3, gather_deadline_us=1500))
        expect_a_pulled_cable_to_be_a_fault(emulation, motors, order, silent)


def test_an_axis_that_is_not_calibrated_gets_no_power_and_says_why() -> None:
    with drives(calibrated=False) as emulation:
        motors = connected()
        motors.set_up()
        with pytest.raises(DriveError, match=r"odrive_uncalibrated: q11 \(node 0\): NOT_CALIBRATED"):
            motors.enable(1.0)
        assert not any(motor.powered for motor in emulation.motors.motors)
        motors.close()


@pytest.mark.parametrize("how", MISPLACED)
def test_a_robot_that_does_not_stand_where_it_is_said_to_gets_no_power(how: str) -> None:
    with drives() as emulation:
        stands = posture_of(emulation)
    with drives(motors=misplaced(how, (0, 1))) as emulation:
        expect_no_power_where_it_stands(emulation, connected(posture=stands))


def test_another_firmware_is_refused() -> None:
    with drives(firmware=(0, 5)), pytest.raises(DriveError, match=r"odrive_firmware: q11 .*0\.5, expected 0\.6"):
        ODrives(bridge_file("odrive"))


def test_a_drive_of_another_id_is_missing() -> None:
    motors = bridge_file("odrive").model_dump(mode="json")["motors"]
    motors["q21"]["id"] = 7
    with drives(), pytest.raises(DriveError, match=r"drive_missing: q21 \(node 7\)"):
        ODrives(bridge_file("odrive", motors=motors))


def test_the_watchdog_of_a_drive_disarms_it() -> None:
    with drives(watchdog_ms=500) as emulation:
        motors = enabled(connected())
        deadline = threading.Event()
        while any(motor.powered for motor in emulation.motors.motors):
            deadline.wait(0.005)
        assert fault_of(motors).endswith("WATCHDOG_TIMER_EXPIRED")
        motors.close()
        # whoever opens them anew finds the error, and clears it
        motors = enabled(connected())
        assert motors.notes == ("cleared odrive_error: q11 (node 0): WATCHDOG_TIMER_EXPIRED",)
        motors.close()


def test_both_sides_know_the_same_errors() -> None:
    assert {name: bit for bit, name in odrive.ERRORS.items()} == emulated.ERRORS
    assert emulated.EMULATOR.understands("fault 1 THERMISTOR_DISCONNECTED")
    assert not emulated.EMULATOR.understands("fault 1 DC_BUS_UNDERVOLTAGE")
    assert error_names(0x28 | 0x80) == "MISSING_ESTIMATE, DRV_FAULT, 0x80"
    assert set(FAULTS) >= {"odrive_error", "odrive_firmware", "odrive_uncalibrated"}


def test_a_wrong_link_is_refused() -> None:
    with pytest.raises(InputError, match="link: interface"):
        ODrives(bridge_file("odrive", link={"interface": "canusb", "channel": "can0"}))
    assert private_bus_link({}, Path())["interface"] == "udp_multicast"


@pytest.mark.extra
def test_every_frame_is_the_vendor_s() -> None:
    """Against the frames' description that `odrive-can` ships."""
    get_dbc = pytest.importorskip("odrive_can").get_dbc
    described = get_dbc("odrive-cansimple-0.6.10")

    def of(command: int) -> Any:
        return described.get_message_by_frame_id(frame_id(0, command))

    assert of(odrive.SET_INPUT_TORQUE).encode({"Input_Torque": 1.25})[:4] == struct.pack("<f", 1.25)
    mode = of(odrive.SET_CONTROLLER_MODE).encode({"Control_Mode": "TORQUE_CONTROL", "Input_Mode": "PASSTHROUGH"})
    assert mode == struct.pack("<II", odrive.TORQUE_CONTROL, odrive.PASSTHROUGH)
    state = of(odrive.SET_AXIS_STATE).encode({"Axis_Requested_State": "CLOSED_LOOP_CONTROL"})
    assert state[:4] == struct.pack("<I", odrive.CLOSED_LOOP_CONTROL)
    results = of(odrive.HEARTBEAT).get_signal_by_name("Procedure_Result").choices
    assert str(results[odrive.NOT_CALIBRATED]) == "NOT_CALIBRATED"
    names = of(odrive.GET_ERROR).get_signal_by_name("Active_Errors").choices
    assert {int(value): str(name) for value, name in names.items() if value} == odrive.ERRORS
    sent: list[can.Message] = []
    with drives() as emulation, can.Bus(interface="virtual", channel="odrive") as bus:
        for command in (odrive.GET_VERSION, odrive.GET_ERROR, odrive.GET_ENCODER_ESTIMATES):
            bus.send(can.Message(arbitration_id=command, is_remote_frame=True, dlc=8, is_extended_id=False))
        while {one.arbitration_id & 31 for one in sent} < {0, 1, 3, 9}:
            message = bus.recv(2.0)
            assert message is not None
            sent.append(message)
        for one in (one for one in sent if one.arbitration_id < 32):
            values = described.decode_message(one.arbitration_id, one.data)
            if one.arbitration_id == 9:
                turns = emulation.motors.motors[0].state.position / 6.283185307179586
                assert values["Pos_Estimate"] == pytest.approx(turns, rel=1e-6)
            elif one.arbitration_id == 1:
                assert (str(values["Axis_State"]), str(values["Axis_Error"])) == ("IDLE", "NONE")
            elif one.arbitration_id == 0:
                assert (values["Fw_Version_Major"], values["Fw_Version_Minor"]) == (0, 6)
