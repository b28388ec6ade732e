# SPDX-License-Identifier: Apache-2.0
"""The files of a rehearsal, of which one part is a function of whoever adds an interface."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from fivebar_bringup.drives.motor_files import MotorRunFiles
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.hardware.motors_file import load_motors
from fivebar_description.strict_yaml import InputError


def without_its_key(link: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    return {"port": link["serial_port"]}


def refused(link: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    raise InputError("--drives: expected a link with a free port")


def on_its_own_channel(link: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    return {**link, "channel": "239.74.163.77", "interface": "udp_multicast"}


def test_a_private_link_that_fails_names_its_interface_error_and_link(tmp_path: Path) -> None:
    files = MotorRunFiles(without_its_key, shipped="odrive")
    with pytest.raises(InputError, match=r"^interface 'odrive': .* with KeyError: 'serial_port'; .* link: \{") as it:
        files.write_rehearsal(load_scenario("middle_odrive"), tmp_path, None)
    assert "\n" not in str(it.value)
    assert not list(tmp_path.iterdir())


def test_a_private_link_that_is_refused_is_so_in_the_words_of_its_interface(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"^--drives: expected a link with a free port$"):
        MotorRunFiles(refused, shipped="odrive").write_rehearsal(load_scenario("middle_odrive"), tmp_path, None)


def test_a_rehearsal_is_on_its_private_link(tmp_path: Path) -> None:
    written = MotorRunFiles(on_its_own_channel, shipped="odrive").write_rehearsal(
        load_scenario("middle_odrive"), tmp_path, None
    )
    assert load_motors(str(written.drives)).link["channel"] == "239.74.163.77"
