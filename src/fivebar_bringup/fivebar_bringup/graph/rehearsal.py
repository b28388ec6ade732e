"""Rehearsal of an experiment: configuration files of bridge and emulated hardware that behave as a scenario's plant.

Bridge and hardware have separate files, as on a real robot: which ones follows from the drives of the robot's parameter
file. Those of drives on a CAN bus are the shipped ones with the scenario's rate, encoders and limits, on a bus of this
run only; those of a motor board have a port of this run only.
"""

from __future__ import annotations

import math
import secrets
from pathlib import Path
from typing import Any, NamedTuple

from fivebar_bringup.graph.bridges import BOARD_BRIDGE, bridge_of
from fivebar_bringup.scenario import Scenario
from fivebar_control.hardware.board_file import BoardFile, load_board
from fivebar_control.hardware.configuration import MICROSECONDS, DriveFile
from fivebar_description.board_file import CLOCK
from fivebar_description.settings import sections
from fivebar_description.share import share_file
from fivebar_description.strict_yaml import InputError, StrictModel, load_yaml, validate, yaml_text
from fivebar_description.text_file import write_file
from fivebar_sim.boards.configuration import BoardEmulationFile
from fivebar_sim.drives.configuration import EmulationFile
from fivebar_sim.effects.settings import MUJOCO, PlantSettings, has_effects

SHIPPED = "dextar_emulated.yaml"
DEFAULT_BOARD = "motkin"
"""Configuration of the bridge to a motor board from which a run's own is made."""

TORQUE_STEPS = 1000
"""Resolution of 0x6071: steps per rated torque."""


GATHER_FRACTION = 0.75
"""Fraction of a period after which the bridge stops waiting for the drives' PDOs."""

LOWEST_PORT, PORTS = 20_000, 12_000
"""Ports below Linux's ephemeral range."""


class DriveFiles(NamedTuple):
    """Configuration files of a run: of the emulated drives, and of the bridge."""

    emulation: Path
    drives: Path


class Rehearsal(NamedTuple):
    """A run on emulated drives: configuration files, and faults to inject ("1.2 fault 1")."""

    files: DriveFiles
    inject: tuple[str, ...] = ()


def write_drive_files(scenario: Scenario, folder: Path, board: str = DEFAULT_BOARD) -> DriveFiles:
    """Write both files of a scenario into a folder; the bridge's of a motor board from a named one.

    Raises:
        InputError: the scenario cannot be rehearsed on emulated drives; the text says what to change.
    """
    check_drivable(scenario)
    files = DriveFiles(folder / "emulation.yaml", folder / "drives.yaml")
    if bridge_of(scenario) == BOARD_BRIDGE:
        port = str((folder / "board").absolute())
        emulation: dict[str, Any] = _emulated_robot(scenario) | {
            "port": port,
            "period_us": MICROSECONDS // scenario.rate_hz,
        }
        _write(files.emulation, emulation, BoardEmulationFile)
        write_board_file(scenario, port, files.drives, board, pace="commands")
        return files
    emulation, drives = _can_files(scenario)
    _write(files.emulation, emulation, EmulationFile)
    _write(files.drives, drives, DriveFile)
    return files


def write_board_file(scenario: Scenario, port: str, path: Path, board: str = DEFAULT_BOARD, pace: str = CLOCK) -> None:
    """Write the bridge's file of a motor board on a port, real or emulated: a named one, changed for this scenario.

    With the pace `commands` time waits for the bridge, as it can with an emulated board alone.

    Raises:
        InputError: the scenario cannot be run on a motor board; the text says what to change.
    """
    check_drivable(scenario)
    if bridge_of(scenario) != BOARD_BRIDGE:
        raise InputError(f"{scenario.name}: robot {scenario.robot}: expected one whose drives are a motor board")
    content = load_board(board).model_dump(mode="json")
    start, cycles = scenario.initial_joints(), scenario.stop_cycles()
    period_us = MICROSECONDS // scenario.rate_hz
    content |= {
        "name": scenario.name,
        "port": port,
        "pace": pace,
        "period_us": period_us,
        "gather_deadline_us": int(GATHER_FRACTION * period_us),
        "watchdog_ms": max(1, cycles * period_us // 1000),
        # less than the blender tolerates, so that the bridge, which knows what is missing, reports the fault, and there
        # is time for the frame that takes the current
        "missing_limit": cycles - 3,
        "posture": {"q11": start.q11, "q21": start.q21, "tolerance_rad": scenario.ekf.homing_tolerance},
    }
    crossings = scenario.plan().crossings
    content["inner_loop"] |= {
        "robot": scenario.robot,
        # no narrower than the plan's blending zones
        "epsilon": max([content["inner_loop"]["epsilon"], *(crossing.epsilon for crossing in crossings)]),
    }
    for motor in content["motors"].values():
        # the lesser one, so that a file for the first power-on holds whatever the scenario says
        motor["torque_limit_nm"] = min(motor["torque_limit_nm"], scenario.torque_limit or 0.0)
        motor["counts_per_revolution"] = scenario.drives().encoder_counts
    _write(path, content, BoardFile)


def _write(path: Path, content: dict[str, Any], model: type[StrictModel]) -> None:
    validate(content, model, f"{content['name']} on drives")
    write_file(path, yaml_text(content))


def _emulated_robot(scenario: Scenario) -> dict[str, Any]:
    """Return what both kinds of emulation know of the robot."""
    plant = scenario.plant
    content: dict[str, Any] = {
        "name": scenario.name,
        "robot": scenario.robot,
        "initial_joints": list(scenario.initial_joints()),
        "mass_scale": plant.mass_scale,
        "inertia_scale": plant.inertia_scale,
        "friction_scale": plant.friction_scale,
    }
    if has_effects(plant) or plant.engine == MUJOCO:
        dumped = scenario.model_dump(mode="json")["plant"]
        content["effects"] = {name: dumped[name] for name in ("engine", "seed", *sections(PlantSettings))}
    return content


def _can_files(scenario: Scenario) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the contents of the files of emulated drives and of their bridge, on a bus of their own."""
    emulation, drives = _shipped("fivebar_sim"), _shipped("fivebar_control")
    plant, cycles = scenario.plant, scenario.stop_cycles()
    period_us = MICROSECONDS // scenario.rate_hz
    period_ms = max(1, -(-period_us // 1000))
    # half a period, so that every cycle sends one even if it starts slightly early
    beat_ms = max(1, period_ms // 2)
    address = f"239.{77 + secrets.randbelow(50)}.{secrets.randbelow(256)}.{1 + secrets.randbelow(254)}"
    bus = {"interface": "udp_multicast", "channel": address, "port": LOWEST_PORT + secrets.randbelow(PORTS)}
    counts = plant.encoder_counts or 0
    common = {"bus": bus, "sync_period_us": period_us}
    motor: dict[str, Any] = {"counts_per_revolution": counts, "velocity_units_per_rev_s": counts}
    if plant.torque_quantum:
        motor["rated_torque_nm"] = TORQUE_STEPS * plant.torque_quantum
    emulation |= common | _emulated_robot(scenario)
    drives |= common | {
        "name": scenario.name,
        "gather_deadline_us": int(GATHER_FRACTION * period_us),
        # one less than the blender tolerates, so that the bridge, which knows what is missing, reports the fault
        "missing_limit": cycles - 2,
        "master": {"node_id": 127, "heartbeat_ms": beat_ms, "timeout_ms": cycles * period_ms},
    }
    for joint in ("q11", "q21"):
        emulation["drives"][joint] |= motor
        monitored = motor | {
            "torque_limit_nm": scenario.torque_limit,
            "heartbeat_ms": beat_ms,
            "heartbeat_timeout_ms": (cycles + 2) * period_ms,
        }
        drives["drives"][joint] |= monitored
        if drives["drives"][joint]["sign"] < 0:
            # counts are rounded down in the motor's direction, which is up in the joint's
            drives["drives"][joint]["home_offset_rad"] = -math.tau / counts
    return emulation, drives


def check_drivable(scenario: Scenario) -> None:
    """Refuse a scenario that cannot be run on drives.

    Raises:
        InputError: the text says what to change.
    """
    plant = scenario.plant
    for missing, reason in (
        (not scenario.estimated, "estimator: expected ekf, since drives know their motors only"),
        (plant.delay_samples != 1, "plant.delay_samples: expected 1, since drives obey from the next SYNC on"),
        (plant.encoder_counts is None, "plant.encoder_counts: expected a number, since drives count"),
        (scenario.torque_limit is None, "plant.torque_limit: expected a number, which the drives are given"),
        (
            MICROSECONDS % scenario.rate_hz != 0,
            "rate_hz: expected a divisor of 1000000, since drives count microseconds",
        ),
    ):
        if missing:
            raise InputError(f"{scenario.name} on two drives: {reason}")


def _shipped(package: str) -> dict[str, Any]:
    content = load_yaml(share_file(package, "config", "drives", SHIPPED))
    assert isinstance(content, dict)
    return content
