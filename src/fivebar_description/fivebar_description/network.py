# SPDX-License-Identifier: Apache-2.0
"""Faults of this machine's network, where nodes do not hear each other or a bus cannot be opened."""

from __future__ import annotations

import errno
import logging
import os
import socket
from collections.abc import Mapping

from fivebar_description.errors import unwrapped

LOOPBACK = "127.0.0.1"

LONGEST_WAY = 0.5
"""Time (s) within which a datagram on the loopback interface has arrived."""

PROFILE_VARIABLES = ("FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE")
"""Variables with which Fast DDS gets a profile, which says where its participants are found."""


def discovery_hint(domain: int, environment: Mapping[str, str] = os.environ) -> str:
    """Return why nodes on this machine may not find each other in a domain, and what to do."""
    if environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE") == "OFF":
        return "ROS_AUTOMATIC_DISCOVERY_RANGE is OFF, so that no node looks for others: unset it"
    problem = loopback_problem()
    if problem is not None:
        return f"the network interface lo does not carry datagrams ({problem}): `ip link set lo up`"
    variables = [name for name in (*PROFILE_VARIABLES, "ROS_DISCOVERY_SERVER") if environment.get(name)]
    if variables:
        return f"look at {' and '.join(variables)}, which say where nodes are found, or unset them"
    first = 7400 + 250 * domain
    return f"look at the network: a firewall may block UDP on lo, of domain {domain} ports {first} to {first + 249}"


def loopback_problem() -> str | None:
    """Return why a datagram to this machine itself does not arrive, None where it does."""
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as endpoint:
            endpoint.bind((LOOPBACK, 0))
            endpoint.settimeout(LONGEST_WAY)
            endpoint.sendto(b"fivebar", endpoint.getsockname())
            endpoint.recv(16)
    except OSError as error:
        return error.strerror or "it is lost"
    return None


def can_problem(interface: str, channel: str, error: Exception) -> str:
    """Return why a CAN interface could not be opened, for people; of an emulated bus, whether it lacks a route."""
    cause = error.__cause__ if isinstance(error.__cause__, OSError) else error
    if interface == "udp_multicast" and getattr(cause, "errno", None) in (errno.ENODEV, errno.ENETUNREACH):
        return f"{interface} {channel}: no multicast route: `ip route add 239.0.0.0/8 dev lo`"
    return f"{interface} {channel}: {unwrapped(error)}"


def _is_no_echo(record: logging.LogRecord) -> bool:
    return "was not properly shut down" not in str(record.msg)


# python-can warns so of a bus that could not be opened, after the error that says why
logging.getLogger("can.bus").addFilter(_is_no_echo)
