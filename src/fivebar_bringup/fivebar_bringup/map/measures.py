# SPDX-License-Identifier: Apache-2.0
"""The numbers of a map: areas, lengths of the locus, Type 3 points."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import distance_transform_edt

from fivebar_control.model.state import WorkingMode
from fivebar_control.planning.postures import WORKING_MODES
from fivebar_control.workspace.fields import Fields, FloatArray, PlatformGrid
from fivebar_control.workspace.loci import Loci, Type3

CM2 = 1e4
"""cm^2 in a m^2."""


class ModeMeasures(NamedTuple):
    """One working mode: area (cm^2) of either assembly mode, length (cm) of the Type 2 locus."""

    working_mode: WorkingMode
    area_positive: float
    area_negative: float
    length_stretched: float
    length_folded: float


class Measures(NamedTuple):
    """The workspace's area (cm^2), the working modes', the part of all motor angles that closes, Type 3 points."""

    workspace_area: float
    modes: list[ModeMeasures]
    closing_share: float
    type3: list[Type3]

    def as_json(self) -> dict[str, Any]:
        """Return the measures with their units in their names."""
        return {
            "workspace_area_cm2": _rounded(self.workspace_area),
            "working_modes": [
                {
                    "working_mode": list(mode.working_mode),
                    "area_det_a_positive_cm2": _rounded(mode.area_positive),
                    "area_det_a_negative_cm2": _rounded(mode.area_negative),
                    "type2_length_cm": _rounded(mode.length_stretched + mode.length_folded),
                    "type2_length_distal_stretched_cm": _rounded(mode.length_stretched),
                    "type2_length_distal_folded_cm": _rounded(mode.length_folded),
                }
                for mode in self.modes
            ],
            "joint_space_closing_share": round(self.closing_share, 4),
            "type3_points": [
                {
                    "x_m": _exact(point.x),
                    "y_m": _exact(point.y),
                    "leg": point.leg,
                    "leg_is": point.shape,
                    "distal_links_are": point.distal_links,
                    "working_modes": [list(modes) for modes in point.working_modes],
                    "joints_rad": {name: _exact(angle) for name, angle in point.joints._asdict().items()},
                }
                for point in self.type3
            ],
        }


def measure(loci: Loci, fields: Fields) -> Measures:
    """Return the numbers of a map."""
    grid = fields.platform_grid
    inside = coverage(grid.reach, grid.cell)
    modes = []
    for working_mode in WORKING_MODES:
        positive = _share_positive(fields.platform[working_mode].locus, grid)
        lengths = {"stretched": 0.0, "folded": 0.0}
        for piece in loci.type2:
            if piece.working_mode == working_mode:
                lengths[piece.shape] += 100.0 * piece.curve.length
        modes.append(
            ModeMeasures(
                working_mode,
                CM2 * grid.cell**2 * float(np.sum(inside * positive)),
                CM2 * grid.cell**2 * float(np.sum(inside * (1.0 - positive))),
                lengths["stretched"],
                lengths["folded"],
            )
        )
    return Measures(
        workspace_area=CM2 * grid.cell**2 * float(np.sum(inside)),
        modes=modes,
        closing_share=float(np.mean(fields.motor_grid.closure > 0.0)),
        type3=loci.type3,
    )


def coverage(distance: FloatArray, cell: float) -> FloatArray:
    """Return which share of each cell lies inside a boundary, for the signed distance of its centre (m)."""
    share: FloatArray = np.clip(0.5 + distance / cell, 0.0, 1.0)
    return share


def _share_positive(locus: FloatArray, grid: PlatformGrid) -> FloatArray:
    """Return which share of each cell has det A > 0; cells with the centre out of reach are like their neighbours."""
    return coverage(continued(locus), grid.cell)


def continued(field: FloatArray) -> FloatArray:
    """Return a field with the nearest value in place of every NaN; a field of NaN stays one."""
    unknown = np.isnan(field)
    if np.all(unknown):
        return field
    rows, columns = distance_transform_edt(unknown, return_distances=False, return_indices=True)
    filled: FloatArray = field[rows, columns]
    return filled


def _rounded(value: float) -> float:
    return round(value, 3)


def _exact(value: float) -> float:
    """Round to what the postures are good for; never -0."""
    return round(value, 7) + 0.0
