"""The mechanical energy that a motion takes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fivebar_bringup.runs.bag.recording import FloatArray


class MotorWork(NamedTuple):
    """Work of both motors (J).

    Attributes:
        spent: integral of |tau_i dq_i1/dt| over time, summed over both motors: what drives have to give that recover
            nothing, and that pay for braking, too.
        net: integral of tau_i dq_i1/dt: what is left in the robot at the end, and what friction took.
    """

    spent: float
    net: float


def motor_work(angles: FloatArray, torques: FloatArray) -> MotorWork:
    """Return the work along a run.

    A torque is constant over a sampling period, so the net work of a period is exactly torque times angle turned; what
    is spent is only too small where a motor turns back within a period.

    Args:
        angles: [n, 2], q11 and q21 at the samples (rad).
        torques: [n, 2], applied over the period before each sample (Nm).
    """
    work = torques[1:] * np.diff(angles, axis=0)
    return MotorWork(float(np.sum(np.abs(work))), float(np.sum(work)))
