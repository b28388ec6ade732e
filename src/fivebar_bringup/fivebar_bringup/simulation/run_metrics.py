# SPDX-License-Identifier: Apache-2.0
"""The metrics of a run, made of its columns: those of a compiled run, of an offline one and of a bag alike."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fivebar_bringup.simulation.column_metrics import FloatArray, largest, saturated, sign_changes
from fivebar_control.safety.stages import NO_FAULT

LEFT = 5e-3
"""Distance (m) from its reference at which a robot has left it."""

Pair = Sequence[FloatArray] | FloatArray
"""Two columns, of x and y or of both motors."""

UNRECORDED: FloatArray = np.empty(0)
"""A column of which a recorded run tells nothing."""


class RunColumns(NamedTuple):
    """The columns of n samples of which metrics are made; errors are those of the actual robot, if that is known.

    Attributes:
        tracking_error: [2][n], platform minus reference, x and y (m).
        from_reference: [n], its distance from the reference (m).
        from_path: [n], its distance from the path, whatever the time (m).
        from_segment: [n], signed distance from the current path segment (m).
        det_a: [n]; its sign is the assembly mode.
        sigma: [n], blending weight.
        requested: [2][n], torques requested before all limits (Nm).
        applied: [2][n], torques applied over the period before the sample (Nm).
        motor_angle: [2][n], exact as far as they are known (rad).
        estimate_error: [n], distance of the estimated platform from the actual one at the time of the estimate (m).
        type1_distance: [n], distance of the platform from the nearer leg's Type 1 boundary (m).
        mirror_deviations: [n], standard deviations between the estimate and the other assembly mode, else infinite.
        misfit, misfit_offset, misfit_jump, misfit_error, misfit_strain: [n] each, of the estimator's watch.
        loop_gap: [n], gap (m) that the period before opened, before it was closed.
    """

    tracking_error: Pair
    from_reference: FloatArray
    from_path: FloatArray
    from_segment: FloatArray
    det_a: FloatArray
    sigma: FloatArray
    requested: Pair
    applied: Pair
    motor_angle: Pair
    estimate_error: FloatArray
    type1_distance: FloatArray = UNRECORDED
    mirror_deviations: FloatArray = UNRECORDED
    misfit: FloatArray = UNRECORDED
    misfit_offset: FloatArray = UNRECORDED
    misfit_jump: FloatArray = UNRECORDED
    misfit_error: FloatArray = UNRECORDED
    misfit_strain: FloatArray = UNRECORDED
    loop_gap: FloatArray = UNRECORDED


class RunMetrics(NamedTuple):
    """Metrics of a run; NaN where nothing is known.

    Attributes:
        samples: samples made.
        mode_changes: changes of the sign of det A.
        error_x, error_y, error_peak: largest tracking error along x, along y, and distance (m).
        error_final: distance (m) from the reference at the last sample.
        left_sample: the first one with more than `LEFT` (m) to the reference, -1 without one.
        path_error: largest distance (m) from the path, whatever the time.
        constraint_error: largest distance (m) from the current path segment while sigma > 0.
        requested1, requested2: largest torque requested of each motor, before all limits (Nm).
        applied1, applied2: largest torque applied (Nm).
        saturated: samples whose requested torque exceeded the torque limit.
        work: sum over motors and periods of |torque times angle turned| (J): the mechanical energy that driving and
            braking take with drives that recover none.
        sigma_max: largest blending weight.
        type1_distance: least distance (m) of the platform from a leg's Type 1 boundary.
        estimate_error: largest distance (m) between the estimated platform and the actual one at the time for which
            it was estimated; 0 for a compiled run without an estimator.
        mirror_deviations: fewest standard deviations between the estimate and the other assembly mode, else infinite.
        misfit: largest recent mean of the squared innovations in units of their variance, 0 without an estimator.
        misfit_offset: largest recent mean of the innovations of one sensor, with their signs, in standard deviations.
        misfit_jump: largest innovation of a motor encoder in a single sample, in standard deviations.
        misfit_error: largest constant error as it was estimated, in units of its declared tolerance.
        misfit_strain: largest of the signed mean, the constant error and the gyroscope's bias together, in units of
            their limits.
        loop_gap: largest gap (m) that a step opened, before it was closed.
        fault, fault_sample: of a compiled run the number of the first fault (see `closed_loop.FAULT_NAMES`) and of its
            sample, -1 without one; a recorded run names its faults.
    """

    samples: int
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
    fault: int = NO_FAULT
    fault_sample: int = -1

    def is_as_planned(self, crossings: int) -> bool:
        """Return whether no fault came, and the assembly mode changed as often as planned."""
        return self.fault == NO_FAULT and self.mode_changes == crossings


def metrics_of(run: RunColumns, torque_limit: float) -> RunMetrics:
    """Return the metrics of a run whose motors have a torque limit (Nm), infinite for none."""
    samples = len(run.from_reference)
    left = np.flatnonzero(~(run.from_reference <= LEFT))
    # angles of a robot that diverged may be infinite
    with np.errstate(invalid="ignore", over="ignore"):
        works = [
            np.abs(torque[1:samples] * np.diff(angle))
            for torque, angle in zip(run.applied, run.motor_angle, strict=True)
        ]
        # one after the other: a sum by pairs rounds otherwise
        work = np.cumsum(works[0] + works[1])
    return RunMetrics(
        samples=samples,
        mode_changes=sign_changes(run.det_a),
        error_x=largest(run.tracking_error[0]),
        error_y=largest(run.tracking_error[1]),
        error_peak=largest(run.from_reference),
        error_final=float(run.from_reference[-1]) if samples else math.nan,
        left_sample=int(left[0]) if left.size else -1,
        path_error=largest(run.from_path),
        constraint_error=largest(run.from_segment[run.sigma > 0.0]),
        requested1=largest(run.requested[0]),
        requested2=largest(run.requested[1]),
        applied1=largest(run.applied[0]),
        applied2=largest(run.applied[1]),
        saturated=saturated(run.requested, torque_limit),
        work=float(work[-1]) if work.size else 0.0,
        sigma_max=largest(run.sigma),
        type1_distance=float(np.fmin.reduce(run.type1_distance, initial=math.inf)),
        estimate_error=largest(run.estimate_error),
        mirror_deviations=float(np.fmin.reduce(run.mirror_deviations, initial=math.inf)),
        misfit=largest(run.misfit),
        misfit_offset=largest(run.misfit_offset),
        misfit_jump=largest(run.misfit_jump),
        misfit_error=largest(run.misfit_error),
        misfit_strain=largest(run.misfit_strain),
        loop_gap=largest(run.loop_gap),
    )
