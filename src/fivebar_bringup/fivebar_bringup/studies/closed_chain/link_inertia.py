"""The inertia of one link of a planar chain."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin


class LinkInertia(NamedTuple):
    """Mass (kg), its centre (m) along the link from the link's joint, and moment of inertia (kg m^2) about it."""

    mass: float
    centre: float
    inertia: float

    def spatial(self) -> Any:
        """Return it as Pinocchio's inertia in the frame of the link's joint, x along the link, z out of the plane."""
        return pin.Inertia(self.mass, np.array([self.centre, 0.0, 0.0]), np.diag([0.0, 0.0, self.inertia]))
