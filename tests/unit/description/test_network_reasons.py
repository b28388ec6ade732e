# SPDX-License-Identifier: Apache-2.0
"""What is said of a network that does not work; those that take one away need root, or a user's own namespaces."""

from __future__ import annotations

import shutil
import subprocess
import sys
from functools import cache

import pytest

from fivebar_description.network import discovery_hint

NO_NETWORK = ("unshare", "--net", "--map-root-user")
"""A command in a network of its own, where lo is down and there is no route."""

OPENED = """
from fivebar_control.hardware.can_port import open_bus
from fivebar_control.hardware.configuration import load_drives
from fivebar_control.hardware.fault import DriveError

try:
    open_bus(load_drives("dextar_emulated").bus)
except DriveError as error:
    raise SystemExit(str(error))
"""


@cache
def can_unshare() -> bool:
    """Return whether this system lets a process have a network of its own."""
    if shutil.which("unshare") is None:
        return False
    return subprocess.run([*NO_NETWORK, "true"], capture_output=True, check=False).returncode == 0


def without_network(*command: str) -> subprocess.CompletedProcess[str]:
    if not can_unshare():
        pytest.skip("a network of its own needs `unshare --net`, which this system does not allow")
    return subprocess.run([*NO_NETWORK, *command], capture_output=True, text=True, check=False, timeout=60.0)


@pytest.mark.parametrize(
    ("environment", "expected"),
    [
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, "ROS_AUTOMATIC_DISCOVERY_RANGE is OFF"),
        ({"FASTRTPS_DEFAULT_PROFILES_FILE": "mine.xml"}, "look at FASTRTPS_DEFAULT_PROFILES_FILE"),
        ({}, "a firewall may block UDP on lo, of domain 7 ports 9150 to 9399"),
    ],
)
def test_a_hint_names_what_keeps_nodes_from_each_other(environment: dict[str, str], expected: str) -> None:
    assert expected in discovery_hint(7, environment)


def test_an_interface_that_is_down_is_named() -> None:
    hint = "from fivebar_description.network import discovery_hint; print(discovery_hint(0, {}))"
    printed = without_network(sys.executable, "-c", hint).stdout
    assert printed.startswith("the network interface lo does not carry datagrams")
    assert "`ip link set lo up`" in printed


@pytest.mark.parametrize(
    "program",
    [
        "from fivebar_sim.emulators.drives import main; main()",
        OPENED,
    ],
    ids=["emulated drives", "bridge"],
)
def test_the_missing_multicast_route_is_the_last_line(program: str) -> None:
    """And no warning of the library that the bus, which was never open, was not closed."""
    result = without_network(sys.executable, "-c", program)
    assert result.returncode != 0
    assert "udp_multicast 239.74.163.2: no multicast route: `ip route add 239.0.0.0/8 dev lo`" in result.stderr
    assert len(result.stderr.splitlines()) == 1
