# SPDX-License-Identifier: Apache-2.0
"""A compiled run: the table that it fills, with a row for every sample, and the metrics that are made of it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.estimation.fault_numbers import TRIP_NAMES
from fivebar_control.loop.closed_loop import PLANT_DIVERGED
from fivebar_control.safety.stages import STAGE_NAMES

FAULT_NAMES = STAGE_NAMES | TRIP_NAMES | {PLANT_DIVERGED: "plant_diverged"}
"""Names of faults by number; they are those of the node graph."""


LEFT = 5e-3
"""Distance (m) from its reference at which a robot has left it."""


class Outcome(NamedTuple):
    """Metrics of a run; errors are those of the actual robot, independent of its sensors.

    Attributes:
        samples: samples made.
        fault, fault_sample: number of the first fault (see `FAULT_NAMES`), and of its sample, -1 without one.
        mode_changes: changes of the sign of det A.
        error_x, error_y, error_peak: largest tracking error along x, along y, and distance (m).
        error_final: distance (m) from the reference at the last sample.
        left_sample: the first one with more than `LEFT` (m) to the reference, -1 without one.
        path_error: largest distance (m) from the path, whatever the time.
        constraint_error: largest distance (m) from the current path segment while sigma > 0, 0 where that never was.
        requested1, requested2: largest torque requested of each motor, before all limits (Nm).
        applied1, applied2: largest torque applied (Nm).
        saturated: samples whose requested torque exceeded the torque limit.
        work: sum over motors and periods of |torque times angle turned| (J): the mechanical energy that driving and
            braking take with drives that recover none.
        sigma_max: largest blending weight.
        type1_distance: least distance (m) of the platform from a leg's Type 1 boundary.
        estimate_error: largest distance (m) between the estimated platform and the actual one at the time for which
            it was estimated; 0 without an estimator.
        mirror_deviations: fewest standard deviations between the estimate and the other assembly mode, else infinite.
        misfit: largest recent mean of the squared innovations in units of their variance, 0 without an estimator.
        misfit_offset: largest recent mean of the innovations of one sensor, with their signs, in standard deviations.
        misfit_jump: largest innovation of a motor encoder in a single sample, in standard deviations.
        misfit_error: largest constant error as it was estimated, in units of its declared tolerance.
        misfit_strain: largest of the signed mean, the constant error and the gyroscope's bias together, in units of
            their limits.
        loop_gap: largest gap (m) that a step opened, before it was closed.
    """

    samples: int
    fault: int
    fault_sample: int
    mode_changes: int
    error_x: float
    error_y: float
    error_peak: float
    error_final: float
    left_sample: int
    path_error: float
    constraint_error: float
    requested1: float
    requested2: float
    applied1: float
    applied2: float
    saturated: int
    work: float
    sigma_max: float
    type1_distance: float
    estimate_error: float
    mirror_deviations: float
    misfit: float
    misfit_offset: float
    misfit_jump: float
    misfit_error: float
    misfit_strain: float
    loop_gap: float


class TraceRow(NamedTuple):
    """Columns of a trace, which has a row for each sample.

    Attributes:
        q11, q12, q21, q22, dq11, dq12, dq21, dq22: exact joints (rad, rad/s).
        estimated_x, estimated_y, estimated_vx, estimated_vy: platform motion that the controllers use, measured or
            estimated (m, m/s).
        sigma, kappa: the supervisor's state.
        requested1, requested2: torques requested for the sample (Nm), NaN once a fault is latched.
        command1, command2: torques commanded (Nm).
        applied1, applied2: torques applied over the period before the sample (Nm).
        read1, read2: what the motors' encoders read (rad).
        x, y: of the actual platform (m).
        det_a: of the actual robot.
        type1_distance: of its platform from the nearer leg's Type 1 boundary (m).
        from_path: of its platform from the path, whatever the time (m).
        mirror_deviations: standard deviations between the estimate and the other assembly mode, else infinite.
        misfit, misfit_offset, misfit_jump, misfit_error, misfit_strain: of the estimator, see `Outcome`; 0 without one.
        loop_gap: gap (m) that the period before opened, before it was closed.
    """

    q11: float
    q12: float
    q21: float
    q22: float
    dq11: float
    dq12: float
    dq21: float
    dq22: float
    estimated_x: float
    estimated_y: float
    estimated_vx: float
    estimated_vy: float
    sigma: float
    kappa: float
    requested1: float
    requested2: float
    command1: float
    command2: float
    applied1: float
    applied2: float
    read1: float
    read2: float
    x: float
    y: float
    det_a: float
    type1_distance: float
    from_path: float
    mirror_deviations: float
    misfit: float
    misfit_offset: float
    misfit_jump: float
    misfit_error: float
    misfit_strain: float
    loop_gap: float


def columns_of(table: NDArray[np.float64]) -> Any:
    """Return the columns of a table, float64[samples, columns of `TraceRow`], by their names, float64[samples] each."""
    return TraceRow(*table.T)


class RunEnd(NamedTuple):
    """The end of a run.

    Attributes:
        samples: samples made.
        fault, fault_sample: as in `Outcome`.
        applied1, applied2: torques (Nm) applied last, also where the robot did not get through its last period.
    """

    samples: int
    fault: int
    fault_sample: int
    applied1: float
    applied2: float
