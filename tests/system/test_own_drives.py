# SPDX-License-Identifier: Apache-2.0
"""An interface of drives that is in no package crosses in a rehearsal, from the page that shows it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from doc_blocks import write_files
from fivebar_command import FivebarCommand
from rehearsed import expect_crossing, expect_stop

REHEARSED = ("run", "middle_robot", "--hardware", "emulated", "--json")


@pytest.fixture(scope="module")
def drives(folder: Path) -> Iterator[str]:
    """The configuration, while every process finds the module of the interface."""
    write_files("tutorials/own_drives.md", folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(Path(__file__).parents[1] / "support"))
        yield str(folder / "my_drives.yaml")


@pytest.mark.extra
@pytest.mark.clock
def test_a_crossing(fivebar: Callable[..., FivebarCommand], folder: Path, drives: str) -> None:
    call = fivebar(*REHEARSED, "--drives", drives, "--out", str(folder / "own"))
    expect_crossing(call)


@pytest.mark.clock
@pytest.mark.extra
@pytest.mark.parametrize(
    ("broken", "fault"),
    [
        ("fault 1", "udp_drive_error: drive 1 is in error"),
        ("silent 2", "feedback_missing: q21 (id 2): no answer in 2 cycles in a row"),
        ("kill drive_bridge", "node_died: drive_bridge "),
    ],
)
def test_a_fault_on_the_way(
    fivebar: Callable[..., FivebarCommand], folder: Path, drives: str, broken: str, fault: str
) -> None:
    rehearsed = (*REHEARSED, "--drives", drives)
    expect_stop(fivebar, rehearsed, f"0.8 {broken}", folder / broken.replace(" ", "_"), fault)


def test_a_module_that_cannot_be_imported_is_named(
    fivebar: Callable[..., FivebarCommand], folder: Path, drives: str
) -> None:
    other = Path(drives).read_text(encoding="utf-8").replace("udp_drives:KIND", "no_such_module:KIND")
    (folder / "other.yaml").write_text(other, encoding="utf-8")
    call = fivebar(*REHEARSED, "--drives", str(folder / "other.yaml"))
    assert call.finish() == 2
    assert call.stderr == "fivebar: no_such_module:KIND: cannot be loaded: No module named 'no_such_module'\n"
