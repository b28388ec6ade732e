"""Numbers in files with the bounds of any robot of this kind: beyond them a number is a mistake, mostly of the unit."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

Positive = Annotated[float, Field(gt=0)]

Length = Annotated[float, Field(ge=1e-4, le=10.0)]
"""m."""

Centre = Annotated[float, Field(ge=-10.0, le=10.0)]
"""Of mass, from a joint (m)."""

Weighed = Annotated[float, Field(gt=0.0, le=1000.0)]
"""kg, or of an inertia kg m^2."""

NoneOrWeighed = Annotated[float, Field(ge=0.0, le=1000.0)]
"""The same, or 0."""

Residual = Annotated[float, Field(ge=-1000.0, le=1000.0)]
"""The same, of either sign."""

Torque = Annotated[float, Field(ge=-1e4, le=1e4)]
"""Nm."""

Coulomb = Annotated[float, Field(ge=0.0, le=1e4)]
"""Nm."""

Width = Annotated[float, Field(gt=0.0, le=1e3)]
"""rad/s."""
