# SPDX-License-Identifier: Apache-2.0
"""A private DDS domain for each run, so that concurrent runs and tests do not receive each other's messages.

Reserved is a UDP port that belongs to the domain and that DDS itself leaves free: the kernel gives it to one process of
the machine, whoever its user is and whatever its environment says, and takes it back when that process ends. There is
no file of locks that another user could plant or damage.
"""

from __future__ import annotations

import errno
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from fivebar_description.errors import InputError

PRIVATE_DOMAINS = range(20, 100)
"""Candidate domains: above those usually chosen by hand, below those whose ports are in Linux's ephemeral range."""

FIRST_PORT, PORTS_OF_A_DOMAIN = 7400, 250
"""First port of domain 0, and number of ports of each domain (RTPS 9.6.1.1): 0 and 1 are for multicast, 10 and more for
participants."""

RESERVED_PORT = 2
"""Index of the port of a domain that is taken to reserve it; the standard uses none from 2 to 9."""

LOOPBACK = "127.0.0.1"

SOCKET_TABLES = (Path("/proc/net/udp"), Path("/proc/net/udp6"))


class BoundPort(NamedTuple):
    """A UDP port in use on this machine, and the user who has bound it."""

    port: int
    uid: int


@contextmanager
def private_domain() -> Iterator[int]:
    """Reserve a domain that no other run of this machine has reserved, and in which no process takes part.

    Raises:
        InputError: all domains are in use.
    """
    for domain in PRIVATE_DOMAINS:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as reservation:
            # others may come after this look only where they have not reserved the domain
            if _reserve(reservation, domain) and not _has_participants(domain):
                yield domain
                return
    raise InputError(f"no free DDS domain between {PRIVATE_DOMAINS.start} and {PRIVATE_DOMAINS.stop - 1}")


def held_domains() -> list[int]:
    """Return the domains that runs of this user have reserved."""
    domain_of = {_first_port(domain) + RESERVED_PORT: domain for domain in PRIVATE_DOMAINS}
    own = {bound.port for bound in bound_ports() if bound.uid == os.geteuid()}
    return sorted(domain_of[port] for port in own & domain_of.keys())


def bound_ports() -> list[BoundPort]:
    """Return the UDP ports that are in use on this machine; none where the system does not tell."""
    ports = []
    for table in SOCKET_TABLES:
        try:
            lines = table.read_text(encoding="utf-8").splitlines()[1:]
        except OSError:
            continue
        # columns: number, address:port in hexadecimal, remote address, state, queues, timer, retransmissions, user
        ports += [BoundPort(int(words[1].rpartition(":")[2], 16), int(words[7])) for words in map(str.split, lines)]
    return ports


def _first_port(domain: int) -> int:
    return FIRST_PORT + PORTS_OF_A_DOMAIN * domain


def _reserve(reservation: socket.socket, domain: int) -> bool:
    """Take the port by which a domain is reserved; return whether it was free."""
    try:
        reservation.bind((LOOPBACK, _first_port(domain) + RESERVED_PORT))
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            return False
        raise InputError(f"DDS domain {domain}: {LOOPBACK} cannot be used: {error.strerror}") from error
    return True


def _has_participants(domain: int) -> bool:
    """Return whether a process takes part in a domain, such as a node started by hand or one that is still ending."""
    first = _first_port(domain)
    ports = set(range(first, first + PORTS_OF_A_DOMAIN)) - {first + RESERVED_PORT}
    return any(bound.port in ports for bound in bound_ports())
