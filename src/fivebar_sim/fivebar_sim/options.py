"""How the simulated robot differs from its parameter file, and what its sensors and drives are like."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_description.imu import ImuDescription


class PlantOptions(NamedTuple):
    """The `plant:` block of a scenario.

    Attributes:
        mass_scale, inertia_scale, friction_scale: factors on the parameters of the robot file.
        torque_limit: largest torque that the drives apply (Nm), None for no limit.
        torque_quantum: step of the applied torque (Nm), 0 for continuous.
        encoder_counts: counts per revolution of each joint's encoder, None for exact sensors. With counts, positions
            are rounded down to a count and velocities are differences of two samples.
        delay_samples: sampling periods between a command and its effect.
        seed: of the random streams, one per sensor.
    """

    mass_scale: float = 1.0
    inertia_scale: float = 1.0
    friction_scale: float = 1.0
    torque_limit: float | None = 10.0
    torque_quantum: float = 0.0
    encoder_counts: int | None = None
    delay_samples: int = 0
    seed: int = 0


class ImuOptions(NamedTuple):
    """The simulated IMU: what is known of it, and the standard deviation of its white noise per axis (m/s^2)."""

    description: ImuDescription = ImuDescription()
    noise: float = 0.0
