# SPDX-License-Identifier: Apache-2.0
"""The side of two moteus drives on a CAN FD bus: registers, modes, watchdog and the text of the diagnostic protocol.

Frames are read and put together here anew, and not by the vendor's library, so that each side checks the other.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import NamedTuple

import can

from fivebar_description.drive_file import CanChannel
from fivebar_description.physical_bounds import Positive
from fivebar_description.strict_yaml import StrictModel
from fivebar_moteus_emulation import moteus_subframes as wire
from fivebar_sim.motors.can_link import CanLink
from fivebar_sim.motors.configuration import MotorsEmulationFile
from fivebar_sim.motors.emulation import emulating
from fivebar_sim.motors.motors import EmulatedMotors, ShaftState, SimulatedMotor

STOPPED, FAULT, ENABLING, IN_POSITION_MODE, TIMEOUT = 0, 1, 2, 10, 11
"""Modes."""

ENABLING_COMMANDS = 3
"""Commands until a stopped drive is in its position mode, which a real one is after some milliseconds."""

ERRORS = {
    "CALIBRATION_FAULT": 32,
    "MOTOR_DRIVER_FAULT": 33,
    "OVER_VOLTAGE": 34,
    "ENCODER_FAULT": 35,
    "MOTOR_NOT_CONFIGURED": 36,
    "PWM_CYCLE_OVERRUN": 37,
    "OVER_TEMPERATURE": 38,
    "OUTSIDE_LIMIT": 39,
    "UNDER_VOLTAGE": 40,
    "CONFIG_CHANGED": 41,
    "THETA_INVALID": 42,
    "POSITION_INVALID": 43,
    "DRIVER_ENABLE_FAULT": 44,
    "STOP_POSITION_DEPRECATED": 45,
    "TIMING_VIOLATION": 46,
    "BEMF_FEEDFORWARD_NO_ACCEL": 47,
    "INVALID_LIMITS": 48,
    "POSITION_CONTROL_ERROR": 49,
    "VELOCITY_CONTROL_ERROR": 50,
}
"""Errors that can be injected, by the vendor's names."""

DEFAULT_ERROR = "MOTOR_DRIVER_FAULT"
"""The error of a fault that is injected without a name."""

LOWEST_VOLTAGE = 4.0
"""Supply (V) below which a drive that has power reports a fault."""

MODE_REGISTER = 0x000
COMMAND_REGISTERS = range(0x020, 0x02E)
DEFAULT_COMMANDS = (
    dict.fromkeys(COMMAND_REGISTERS, 0.0)
    | dict.fromkeys((0x023, 0x024, 0x02B), 1.0)
    | dict.fromkeys((0x025, 0x026, 0x028, 0x029, 0x02A, 0x02C), math.nan)
)
"""Meaning of registers that a command leaves out."""

UUID, UUID_MASKS = range(0x150, 0x154), range(0x154, 0x158)
INTEGERS_ONLY = {*range(0x100, 0x103), *UUID}
"""Registers that are read as integers of 32 bits."""

KINDS = wire.kinds(
    {
        wire.POSITION: (0x001, 0x006, 0x020, 0x026, 0x038, 0x050),
        wire.VELOCITY: (0x002, 0x021, 0x028, 0x039, 0x051),
        wire.ACCELERATION: (0x029,),
        wire.TORQUE: (0x003, 0x022, 0x025, 0x03A),
        wire.SCALE: (0x023, 0x024, 0x02B),
        wire.CURRENT: (0x004, 0x005, 0x02C),
        wire.POWER: (0x007,),
        wire.VOLTAGE: (0x00D, 0x02A),
        wire.TEMPERATURE: (0x00A, 0x00E),
        wire.TIME: (0x027,),
    }
)
"""Kinds of registers that are no whole numbers."""

BROADCAST, WITH_ANSWER = 0x7F, 0x8000

SETTINGS = {
    "servo.timeout_mode": "0",
    "servo.fixed_voltage_mode": "0",
    "servo.voltage_mode_control": "0",
    "servo.default_timeout_s": "0.100000",
    "servo.pid_position.kp": "4.000000",
    "servo.pid_position.kd": "0.050000",
    "motor.poles": "14",
    "motor.Kv": "304.0",
    "motor_position.commutation_source": "0",
    "motor_position.output.source": "0",
}
"""Settings of a drive as it says them, where the file has no others."""


class MoteusLinkFile(CanChannel, StrictModel):
    """Section `link`: the bus, and what both drives are like.

    Attributes:
        bitrate: of the wire (bit/s), which an emulated bus has not.
        rotor_to_output_ratio: the setting of that name; a motor's encoder and torque are those of the drive's output.
        firmware: its ABI version.
        register_map: version of the register map.
        voltage: supply (V).
        home_state: what the position refers to: nothing, the rotor, the output.
        encoder_validity: bits of the encoders that can be read, two for each.
        settings: further settings, and others than the usual ones.
    """

    bitrate: int = 1_000_000
    rotor_to_output_ratio: Positive = 1.0
    firmware: int = 0x010100
    register_map: int = 5
    voltage: float = 24.0
    home_state: int = 1
    encoder_validity: int = 3
    settings: Mapping[str, str] = {}


class Commanded(NamedTuple):
    """The last command of the position mode: its registers, where it began, and when it ends (s)."""

    registers: Mapping[int, float]
    held: float
    ends: float


NOTHING_COMMANDED = Commanded(DEFAULT_COMMANDS, 0.0, math.inf)


class MoteusState:
    """The memory of a drive."""

    def __init__(self, link: MoteusLinkFile) -> None:
        self.mode, self.fault, self.enabling = STOPPED, 0, 0
        self.voltage = link.voltage
        self.commanded = NOTHING_COMMANDED
        self.heard, self.to_say = b"", b""
        ratio = f"{link.rotor_to_output_ratio:f}"
        self.settings = SETTINGS | {"motor_position.rotor_to_output_ratio": ratio} | dict(link.settings)

    def obey(self, text: bytes) -> None:
        """Take text of the diagnostic protocol, and answer its lines."""
        *lines, self.heard = (self.heard + text).replace(b"\r", b"\n").split(b"\n")
        for line in filter(None, lines):
            match line.decode("latin1").split():
                case ["conf", "get", name] if name in self.settings:
                    self.to_say += f"{self.settings[name]}\r\n".encode()
                case ["conf", "set", name, value] if name in self.settings:
                    self.settings[name] = value
                    self.to_say += b"OK\r\n"
                case ["tel", "stop"] | ["conf", "write"]:
                    self.to_say += b"OK\r\n"
                case _:
                    self.to_say += b"ERR unknown command\r\n"


class MoteusBus(CanLink[MoteusLinkFile]):
    """The `MotorLink` of two moteus drives."""

    def __init__(self, file: MotorsEmulationFile) -> None:
        """Open the bus.

        Raises:
            InputError: it cannot be opened.
        """
        super().__init__(file, MoteusLinkFile, fd=True)
        self.states = MoteusState(self.link), MoteusState(self.link)

    def watch(self, motors: EmulatedMotors) -> None:
        """Note injected faults, a supply that has gone, and commands that have ended."""
        now = time.monotonic()
        for state, motor in zip(self.states, motors.motors, strict=True):
            if motor.faulty and state.mode != FAULT:
                _fail(state, motor, motor.fault or DEFAULT_ERROR)
            elif state.mode == IN_POSITION_MODE and state.voltage < LOWEST_VOLTAGE:
                _fail(state, motor, "UNDER_VOLTAGE")
            elif state.mode == IN_POSITION_MODE and (now > state.commanded.ends or not motor.powered):
                state.mode = TIMEOUT
                motor.command(False, 0.0)

    def answer(self, motors: EmulatedMotors, message: can.Message) -> None:
        """Answer a frame to one of the drives, or to all."""
        if message.is_remote_frame or message.arbitration_id >> 16:
            return
        source, destination = message.arbitration_id >> 8 & 0x7F, message.arbitration_id & 0xFF
        reached = [motors.number_of(motor.facts.id) for motor in motors.motors]
        for number in (index for index in reached if index is not None):
            motor = motors.motors[number]
            if destination in (motor.facts.id, BROADCAST):
                said = self._answered(motors, number, bytes(message.data))
                if said is not None and message.arbitration_id & WITH_ANSWER:
                    self.send(motor.facts.id << 8 | source, wire.filled(said))

    def _answered(self, motors: EmulatedMotors, number: int, data: bytes) -> bytes | None:
        """Do what a frame asks for, and return the answer; None where the frame is not meant."""
        state = self.states[number]
        asked = list(wire.subframes(data))
        if any(subframe.kind == wire.WRITE and subframe.register in UUID_MASKS for subframe in asked):
            return None
        written = {
            subframe.register: wire.scaled(subframe.raw, subframe.resolution, KINDS.get(subframe.register, wire.WHOLE))
            for subframe in asked
            if subframe.kind == wire.WRITE
        }
        shaft = self._command(motors, number, written)
        registers = self._registers(motors.motors[number], state, shaft)
        said = b""
        for subframe in asked:
            if subframe.kind == wire.READ:
                said += _read(registers, subframe)
            elif subframe.kind == wire.SAY:
                state.obey(subframe.text)
            elif subframe.kind == wire.POLL:
                text, state.to_say = state.to_say[: subframe.resolution], state.to_say[subframe.resolution :]
                said += wire.said(subframe.register, text)
        return said

    def _command(self, motors: EmulatedMotors, number: int, written: Mapping[int, float]) -> ShaftState:
        """Obey what a frame writes, and return the state that it finds; without a mode it commands nothing."""
        state, motor, now = self.states[number], motors.motors[number], time.monotonic()
        mode = written.get(MODE_REGISTER)
        if mode == STOPPED:
            state.mode = state.fault = STOPPED
            state.commanded = NOTHING_COMMANDED
            motor.faulty = False
        elif mode == IN_POSITION_MODE:
            self._to_position_mode(state, motor)
            registers = DEFAULT_COMMANDS | {key: written[key] for key in COMMAND_REGISTERS if key in written}
            ends = registers[0x027] or float(state.settings["servo.default_timeout_s"])
            state.commanded = Commanded(registers, motor.state.position, math.inf if math.isnan(ends) else now + ends)
        else:
            return motor.state
        powered = state.mode == IN_POSITION_MODE
        return motors.command(number, powered, _torque(state, motor.state) if powered else 0.0, now)

    def _to_position_mode(self, state: MoteusState, motor: SimulatedMotor) -> None:
        if state.mode == STOPPED:
            state.mode, state.enabling = ENABLING, ENABLING_COMMANDS
        elif state.mode == ENABLING:
            state.enabling -= 1
            if state.enabling <= 0:
                state.mode = IN_POSITION_MODE
                if not (float(state.settings["motor.poles"]) and float(state.settings["motor.Kv"])):
                    _fail(state, motor, "MOTOR_NOT_CONFIGURED")
                elif not self.link.encoder_validity & 1:
                    _fail(state, motor, "THETA_INVALID")

    def _registers(self, motor: SimulatedMotor, state: MoteusState, shaft: ShaftState) -> dict[int, float]:
        """Return what can be read of a drive whose last frame has found a state.

        Motion, torque and current are those that it found, and not what it leads to.
        """
        turns, speed = shaft.position / math.tau, shaft.velocity / math.tau
        return {
            MODE_REGISTER: state.mode,
            0x001: turns,
            0x002: speed,
            0x003: shaft.torque,
            0x004: shaft.torque / motor.facts.torque_constant,
            0x005: 0.0,
            0x007: shaft.torque * shaft.velocity,
            0x00A: 0.0,
            0x00B: 1,
            0x00C: self.link.home_state,
            0x00D: state.voltage,
            0x00E: 30.0,
            0x00F: state.fault,
            0x03A: shaft.torque,
            0x050: turns % 1.0,
            0x051: speed,
            0x058: self.link.encoder_validity,
            0x100: 0,
            0x101: self.link.firmware,
            0x102: self.link.register_map,
            **dict(zip(UUID, (motor.facts.id, 0, 0, 0), strict=True)),
            0x158: 1,
            **state.commanded.registers,
        }


def _read(registers: Mapping[int, float], asked: wire.Subframe) -> bytes:
    """Return the answer to a register that is read."""
    register, resolution = asked.register, asked.resolution
    if register not in registers or (register in INTEGERS_ONLY and resolution != wire.INT32):
        return wire.read_error(register)
    return wire.reply(register, registers[register], resolution, KINDS.get(register, wire.WHOLE))


def _fail(state: MoteusState, motor: SimulatedMotor, error: str) -> None:
    state.mode, state.fault = FAULT, ERRORS[error]
    motor.command(False, 0.0)


def _torque(state: MoteusState, shaft: ShaftState) -> float:
    """Return the torque (Nm) of the last command: that of the loop about its position, and what is fed forward."""
    registers, held, _ = state.commanded
    position, speed = registers[0x020], registers[0x021]
    turns = (held / math.tau if math.isnan(position) else position) - shaft.position / math.tau
    rate = (0.0 if math.isnan(speed) else speed) - shaft.velocity / math.tau
    kp, kd = (float(state.settings[f"servo.pid_position.{gain}"]) for gain in ("kp", "kd"))
    kp_scale = registers[0x023]
    torque = kp_scale * kp * turns + min(registers[0x024], kp_scale) * kd * rate + registers[0x022]
    limit = registers[0x025]
    return torque if math.isnan(limit) else max(-limit, min(limit, torque))


EMULATOR = emulating(MoteusBus, ERRORS)
"""The emulation of the interface."""
