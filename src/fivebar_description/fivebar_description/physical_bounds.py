"""Numbers in files, most of them with the bounds of any robot of this kind: beyond them a number is a mistake.

The commonest one is that of the unit.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

Positive = Annotated[float, Field(ge=1e-9, le=1e9)]
"""A positive value of any unit."""

Duration = Annotated[float, Field(ge=1e-4, le=1e9)]
"""Duration of a motion (s); a robot's limits decide long before, and a sample takes 0.1 ms at least."""

Length = Annotated[float, Field(ge=1e-4, le=10.0)]
"""Length of a link, or between the bases (m)."""

Coordinate = Annotated[float, Field(ge=-10.0, le=10.0)]
"""Coordinate of a place, or of a centre of mass along its link (m)."""

MassOrInertia = Annotated[float, Field(gt=0.0, le=1000.0)]
"""kg, or kg m^2."""

MassOrInertiaOrZero = Annotated[float, Field(ge=0.0, le=1000.0)]
"""kg, or kg m^2."""

ResidualInertia = Annotated[float, Field(ge=-1000.0, le=1000.0)]
"""kg m^2."""

Torque = Annotated[float, Field(ge=-1e4, le=1e4)]
"""Nm."""

CoulombFriction = Annotated[float, Field(ge=0.0, le=1e4)]
"""Nm."""

FrictionWidth = Annotated[float, Field(gt=0.0, le=1e3)]
"""Width of the smoothing of Coulomb friction (rad/s)."""
