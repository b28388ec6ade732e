# SPDX-License-Identifier: Apache-2.0
"""Every fault of drives has a recovery; their pages tell every key, and the load of the bus, as the code does."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable
from pathlib import Path

from fivebar_bringup.reference.faults import ADVICE, faults_page
from fivebar_control.hardware.configuration import Bus, Drive, StartPosture, load_drives
from fivebar_control.hardware.controlled_joints import FAULTS as JOINT_FAULTS
from fivebar_control.hardware.controlled_joints import JointsLink
from fivebar_control.hardware.drive_faults import FAULTS as BUS_FAULTS
from fivebar_moteus.moteus_faults import FAULTS as MOTEUS_FAULTS
from fivebar_motkin.board_faults import CAUSES
from fivebar_motkin.board_faults import FAULTS as BOARD_FAULTS
from fivebar_motkin.board_file import BoardDrive, BoardFile
from fivebar_motkin_emulation.commands import USAGE as BOARD_USAGE
from fivebar_odrive.odrive import FAULTS as ODRIVE_FAULTS
from fivebar_sim.drives.commands import WORDS
from fivebar_sim.ros.ros2_control import ERRORS as JOINT_ERRORS

ROOT = Path(__file__).parents[2]
BOARD_PAGE = (ROOT / "docs" / "motkin.md").read_text(encoding="utf-8")
PAGE = (ROOT / "docs" / "robot.md").read_text(encoding="utf-8")
DRIVERS = ROOT / "src" / "fivebar_control"
CONTROL = DRIVERS / "fivebar_control"


BOARD_ONLY = {*(DRIVERS / "fivebar_motkin").glob("*.py")}
ODRIVE_ONLY = {*(DRIVERS / "fivebar_odrive").glob("*.py")}
JOINT_PAGE = (ROOT / "docs" / "ros2_control.md").read_text(encoding="utf-8")
JOINTS_ONLY = {CONTROL / "ros" / name for name in ("controller_watch.py", "joints_port.py", "ros2_control.py")}
MOTEUS_ONLY = {*(DRIVERS / "fivebar_moteus").glob("*.py")}


def raised(paths: Iterable[Path]) -> set[str]:
    """Names of the faults in the source: first argument of Fault(...) and of the set-up's _fail(...)."""
    names = set()
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
                called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
                if called in ("Fault", "_fail"):
                    names.add(str(node.args[0].value))
    return names


def test_every_fault_of_drives_has_its_recovery_and_no_other_is_told() -> None:
    assert BOARD_ONLY
    shared = {*(CONTROL / "hardware").glob("*.py"), CONTROL / "ros" / "drive_bridge.py"}
    assert raised(shared) == set(BUS_FAULTS)
    assert raised(BOARD_ONLY | {CONTROL / "hardware" / "configuration.py"}) | {
        name for name, _ in CAUSES.values()
    } == set(BOARD_FAULTS)
    assert raised(ODRIVE_ONLY) <= set(ODRIVE_FAULTS)
    assert raised(MOTEUS_ONLY) <= set(MOTEUS_FAULTS)
    # published as texts: a second publisher's by a shared function, the watchdog's by a node
    assert raised(JOINTS_ONLY) | {"second_publisher", "command_lost"} == set(JOINT_FAULTS)


def test_the_page_of_faults_has_those_of_the_graph_and_of_all_drives() -> None:
    parts = faults_page().split("\n## ")[1:]
    tables = {
        part.partition("\n")[0]: re.findall(r"^\| `(\w+)` \| [^|]+\. \| [^|]+\. \|$", part, re.M) for part in parts
    }
    assert tables == {
        "The graph": list(ADVICE),
        "Drives: canopen": list(BUS_FAULTS),
        "Drives: moteus": list(MOTEUS_FAULTS),
        "Drives: motkin": list(BOARD_FAULTS),
        "Drives: odrive": list(ODRIVE_FAULTS),
        "Drives: ros2_control": list(JOINT_FAULTS),
    }


def test_every_fault_that_was_tried_is_one_that_there_is() -> None:
    own_drives = {*BUS_FAULTS, *ODRIVE_FAULTS, *MOTEUS_FAULTS}
    for page, own in ((PAGE, own_drives), (BOARD_PAGE, {*BOARD_FAULTS}), (JOINT_PAGE, {*JOINT_FAULTS})):
        rows = page.split("## Faults that were tried")[1].split("\n## ")[0]
        named = set(re.findall(r"`([a-z]+_[a-z_]+)`", rows)) - {"missing_limit"}
        assert len(named) > 5
        assert named <= {*ADVICE, *BUS_FAULTS, *own}
        tried = re.findall(
            r" \| (?:in one process|both ways|rehearsed|in a crossing|in a run)[^|]* \|$", rows, re.MULTILINE
        )
        assert len(tried) == rows.count("\n|") - 2


def test_every_key_of_the_joints_is_explained_and_every_way_to_break_them() -> None:
    assert not {key for key in JointsLink.model_fields if f"| `{key}` |" not in JOINT_PAGE}
    assert not [error for error in JOINT_ERRORS if f"| `fault 1 {error}` |" not in JOINT_PAGE]


def test_every_key_of_a_board_is_explained() -> None:
    keys = {*BoardFile.model_fields, *BoardDrive.model_fields, *StartPosture.model_fields} - {"name"}
    assert not {key for key in keys if f"`{key}`" not in BOARD_PAGE}


def test_every_way_to_break_a_board_is_told() -> None:
    orders = re.findall(r"[a-z]+", BOARD_USAGE.partition(";")[0])
    assert len(orders) > 10
    assert not [order for order in orders if not re.search(rf"`[a-z]* ?{order}\b", BOARD_PAGE)]


def test_every_key_of_a_drive_is_explained() -> None:
    keys = {*Drive.model_fields, "sync_period_us", "gather_deadline_us", "missing_limit", "posture"}
    assert not {key for key in keys if f"`{key}`" not in PAGE}


def test_every_interface_is_named_where_it_belongs() -> None:
    assert set(Bus.model_fields) == {"interface", "channel", "bitrate", "port"}
    for word in ("`socketcan`", "`udp_multicast`"):
        assert word in PAGE


def test_the_load_of_the_bus_is_the_computed_one() -> None:
    drives = load_drives("dextar_socketcan")
    assert f"| {drives.cycle_bits} |" in PAGE
    for period, rate in ((1000, "1000 Hz"), (2000, "**500 Hz**"), (4000, "250 Hz")):
        row = next(line for line in PAGE.splitlines() if line.startswith(f"| {rate} "))
        assert f"{100 * drives.model_copy(update={'sync_period_us': period}).bus_load:.1f} %" in row


def test_every_way_to_break_a_drive_is_told() -> None:
    assert WORDS
    assert not [word for word in WORDS if f"| `{word} 1" not in PAGE]
