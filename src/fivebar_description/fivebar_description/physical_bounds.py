# SPDX-License-Identifier: Apache-2.0
"""Numbers in files, most of them with the bounds of any robot of this kind: beyond them a number is a mistake.

The commonest one is that of the unit, which a description ends with, as that of a `Setting` does. What depends on the
size of the robot is in `plausibility`.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

Positive = Annotated[float, Field(ge=1e-9, le=1e9)]
"""A positive value of any unit."""

Duration = Annotated[float, Field(ge=1e-4, le=1e9)]
"""Duration of a motion (s); a robot's limits decide long before, and a sample takes 0.1 ms at least."""

Length = Annotated[float, Field(ge=1e-4, le=10.0, description="Length of a link, or between the bases. Unit: m.")]

Coordinate = Annotated[float, Field(ge=-10.0, le=10.0, description="Place, or centre of mass along its link. Unit: m.")]

Mass = Annotated[float, Field(gt=0.0, le=1000.0, description="Mass. Unit: kg.")]

MassOrZero = Annotated[float, Field(ge=0.0, le=1000.0, description="Mass. Unit: kg.")]

Inertia = Annotated[float, Field(gt=0.0, le=1000.0, description="Inertia. Unit: kg m^2.")]

InertiaOrZero = Annotated[float, Field(ge=0.0, le=1000.0, description="Inertia. Unit: kg m^2.")]

ResidualInertia = Annotated[float, Field(ge=-1000.0, le=1000.0, description="Residual inertia. Unit: kg m^2.")]

Torque = Annotated[float, Field(ge=-500.0, le=500.0, description="Torque. Unit: Nm.")]

CoulombFriction = Annotated[float, Field(ge=0.0, le=500.0, description="Coulomb friction. Unit: Nm.")]

FrictionWidth = Annotated[
    float, Field(gt=0.0, le=10.0, description="Width of the smoothing of Coulomb friction. Unit: rad/s.")
]

TorqueConstant = Annotated[float, Field(ge=1e-5, le=20.0, description="Torque per current. Unit: Nm/A.")]
