"""Settings of the simulated robot: deviations from its parameter file, encoders and drives."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting
from fivebar_description.shared_settings import DRIVE_TORQUE_LIMIT, DelaySamples, DriveTorqueLimit, EncoderCounts

MassScale = Annotated[float, Setting("Factor on the platform's mass.", at_least=1e-3, at_most=1e3)]
InertiaScale = Annotated[float, Setting("Factor on the legs' inertias.", at_least=1e-3, at_most=1e3)]
FrictionScale = Annotated[float, Setting("Factor on the motors' friction.", at_least=0.0, at_most=1e3)]


class PlantSettings(NamedTuple):
    """How the simulated robot differs from its parameter file, and the properties of its encoders and drives.

    With encoder counts, positions are rounded down to a count and velocities are differences of two samples. The seed
    is that of all random streams, one per sensor.
    """

    mass_scale: MassScale = 1.0
    inertia_scale: InertiaScale = 1.0
    friction_scale: FrictionScale = 1.0
    torque_limit: DriveTorqueLimit = DRIVE_TORQUE_LIMIT
    torque_quantum: Annotated[
        float, Setting("Resolution of the applied torque, 0 for continuous.", "Nm", at_least=0.0, at_most=10.0)
    ] = 0.0
    encoder_counts: EncoderCounts = None
    delay_samples: DelaySamples = 0
    seed: Annotated[int, Setting("Seed of the sensors' noise.", at_least=0, at_most=2**31 - 1)] = 0
