# SPDX-License-Identifier: Apache-2.0
"""The newest samples of a running graph, joined by stamp and thinned to what a page can draw."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from fivebar_control.model.kinematics import det_a, state_from_joints
from fivebar_description.interface import NANOSECONDS
from fivebar_description.parameters import FiveBar

KEPT = 2000
"""Number of messages of a topic that are kept: those of some seconds, until a page shows them."""

APART = 8_000_000
"""Least time (ns) between two rows: a page draws no more than 125 a second."""

COLUMNS = ("time", "x", "y", "q11", "q21", "mode", "torque1", "torque2", "sigma", "kappa", "error")
"""Columns of the rows: s, mm, mm, rad, rad, sign of det A, Nm, Nm, -, -, mm."""


class JointStateSample(NamedTuple):
    """A message of `joint_states`: positions (rad) in the order of the joints, and the torques (Nm) of both motors."""

    position: tuple[float, float, float, float]
    torque: tuple[float, float]


class Messages:
    """The latest messages of a topic by stamp, as they came."""

    def __init__(self) -> None:
        self._by_stamp: dict[int, bytes] = {}
        self.newest = -1
        """The largest stamp, -1 before the first message."""

    def put(self, stamp: int, data: bytes) -> None:
        """Keep a message, and forget the oldest one of many."""
        self._by_stamp[stamp] = data
        self.newest = max(self.newest, stamp)
        if len(self._by_stamp) > KEPT:
            del self._by_stamp[next(iter(self._by_stamp))]

    def get(self, stamp: int) -> bytes | None:
        """Return the message with a stamp, None where there is none."""
        return self._by_stamp.get(stamp)

    def after(self, stamp: int) -> list[int]:
        """Return the stamps after one, in order."""
        return sorted(known for known in self._by_stamp if known > stamp)

    def clear(self) -> None:
        """Forget all messages."""
        self._by_stamp.clear()
        self.newest = -1


def thinned(stamps: Sequence[int]) -> list[int]:
    """Return stamps (ns) that are at least `APART` from each other, the last one among them."""
    kept: list[int] = []
    for stamp in reversed(stamps):
        if not kept or kept[-1] - stamp >= APART:
            kept.append(stamp)
    return kept[::-1]


def row(
    robot: FiveBar,
    since_begin: int,
    joints: JointStateSample,
    reference: tuple[float, float] | None,
    supervisor: tuple[float, float] | None,
) -> Mapping[str, float | None]:
    """Return one row, of a sample so long (ns) after sample 0; None where something is not known."""
    state = state_from_joints(robot, *joints.position, 0.0, 0.0, 0.0, 0.0)
    error = math.nan if reference is None else 1e3 * math.hypot(state.x - reference[0], state.y - reference[1])
    sigma, kappa = supervisor or (math.nan, math.nan)
    values = (
        since_begin / NANOSECONDS,
        1e3 * state.x,
        1e3 * state.y,
        joints.position[0],
        joints.position[2],
        math.copysign(1.0, det_a(state)),
        *joints.torque,
        sigma,
        kappa,
        error,
    )
    return {name: value if math.isfinite(value) else None for name, value in zip(COLUMNS, values, strict=True)}
