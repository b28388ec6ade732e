"""docs/robot.md tells every fault of the hardware, every key of a drive and the load of the bus as the code does."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from fivebar_control.hardware.bus_load import bus_load, cycle_bits
from fivebar_control.hardware.configuration import Bus, Drive, load_drives
from fivebar_sim.drives.commands import WORDS

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "robot.md").read_text(encoding="utf-8")
CONTROL = ROOT / "src" / "fivebar_control" / "fivebar_control"


def raised() -> set[str]:
    """Names of the faults in the source: first argument of Fault(...) and of the set-up's _fail(...)."""
    names = set()
    for path in [*(CONTROL / "hardware").glob("*.py"), CONTROL / "nodes" / "dextar_bridge.py"]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
                called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
                if called in ("Fault", "_fail"):
                    names.add(str(node.args[0].value))
    return names


def test_every_fault_has_its_recovery_and_no_other_is_told() -> None:
    section = PAGE.split("## Faults and recovery")[1].split("\n## ")[0]
    assert set(re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE)) == raised()


@pytest.mark.parametrize("key", sorted({*Drive.model_fields, "sync_period_us", "gather_deadline_us", "missing_limit"}))
def test_every_key_of_a_drive_is_explained(key: str) -> None:
    assert f"`{key}`" in PAGE


def test_every_interface_is_named_where_it_belongs() -> None:
    assert set(Bus.model_fields) == {"interface", "channel", "bitrate", "port"}
    for word in ("`socketcan`", "`udp_multicast`"):
        assert word in PAGE


def test_the_load_of_the_bus_is_the_computed_one() -> None:
    drives = load_drives("dextar_socketcan")
    assert f"| {cycle_bits(drives)} |" in PAGE
    for period, rate in ((1000, "1000 Hz"), (2000, "**500 Hz**"), (4000, "250 Hz")):
        row = next(line for line in PAGE.splitlines() if line.startswith(f"| {rate} "))
        assert f"{100 * bus_load(drives.model_copy(update={'sync_period_us': period})):.1f} %" in row


@pytest.mark.parametrize("word", sorted(WORDS))
def test_every_way_to_break_a_drive_is_told(word: str) -> None:
    assert f"| `{word} 1" in PAGE
