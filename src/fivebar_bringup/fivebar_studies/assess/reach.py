# SPDX-License-Identifier: Apache-2.0
"""Where a robot can go, where it is singular, and at how much of the Type 2 locus there is room for a crossing."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from fivebar_bringup.map.measures import Measures, measure
from fivebar_control.model.state import WorkingMode
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.postures import WORKING_MODES
from fivebar_control.planning.roadmap import GATE_DISTANCE, roadmap
from fivebar_control.workspace.fields import evaluate
from fivebar_control.workspace.loci import singular_loci
from fivebar_description.robot_file import RobotFile

CELLS = 60
"""Along the longer side of the workspace; areas are good to about 0.1 %."""

REST = 0.1
"""Least 1/cond(A) of the rests before and behind a crossing."""


class LocusShare(NamedTuple):
    """The Type 2 locus of a working mode: its length (cm), the share with stretched distal links, and that with room.

    Attributes:
        working_mode: whose.
        length, stretched: cm.
        room: share of the locus near which a straight segment across it is free, from rest to rest.
    """

    working_mode: WorkingMode
    length: float
    stretched: float
    room: float


class RobotReach(NamedTuple):
    """The reach that the geometry of a robot gives it."""

    measures: Measures
    loci: list[LocusShare]

    def as_json(self) -> dict[str, Any]:
        """Return the reach as plain values, with the units in the names."""
        loci = [
            {
                "working_mode": list(locus.working_mode),
                "type2_length_cm": round(locus.length, 2),
                "stretched_share": round(locus.stretched / locus.length, 4) if locus.length else None,
                "share_with_room_to_cross": round(locus.room, 4),
            }
            for locus in self.loci
        ]
        return {**self.measures.as_json(), "loci": loci}


def reach_of(file: RobotFile) -> RobotReach:
    """Return where a robot can go and cross."""
    robot, limits = file.five_bar(), MotionLimits()
    loci = singular_loci(robot)
    measures = measure(loci, evaluate(robot, loci, CELLS, lambda done, total: None))
    shares = []
    for modes in measures.modes:
        ways = roadmap(robot, modes.working_mode, limits.serial_margin, REST, file.elbows_pass)
        middles = np.array([np.mean(gate, axis=0) for gate in ways.gates]).reshape(-1, 2)
        pieces = [piece.curve.platform for piece in loci.type2 if piece.working_mode == modes.working_mode]
        room = near = 0.0
        for piece in pieces:
            lengths = np.hypot(*np.diff(piece, axis=0).T)
            between = 0.5 * (piece[1:] + piece[:-1])
            distance = np.full(len(between), math.inf)
            for middle in middles:
                distance = np.minimum(distance, np.hypot(*(between - middle).T))
            room += float(np.sum(lengths))
            near += float(np.sum(lengths[distance <= GATE_DISTANCE]))
        length = modes.length_stretched + modes.length_folded
        shares.append(LocusShare(modes.working_mode, length, modes.length_stretched, near / room if room else 0.0))
    assert [share.working_mode for share in shares] == list(WORKING_MODES)
    return RobotReach(measures, shares)
