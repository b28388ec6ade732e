# SPDX-License-Identifier: Apache-2.0
"""Calibration of the geometry from the motors' encoders alone, by their turning points on the Type 2 locus."""

from __future__ import annotations

import math

import numpy as np

from fivebar_control.calibration.alternative_mountings import explanations
from fivebar_control.calibration.closure import GEOMETRY, closure, distal_angles
from fivebar_control.calibration.parameters import PARAMETERS, deviations_before, values_before
from fivebar_control.calibration.record import CONTRADICTS, CalibrationRecord, ContradictsRobot, NotCalibratable
from fivebar_control.calibration.result import Calibration, LocusPassage, covariance_of
from fivebar_control.calibration.turning_points import turning_points
from fivebar_control.identification.cutoff import encoder_resolution
from fivebar_description.parameters import FiveBar
from fivebar_description.tolerances import Tolerances
from fivebar_description.transmission import Transmission


def dragged_lag(robot: FiveBar, transmission: Transmission) -> float:
    """Return by how much a motor of a robot without power may lag behind its link (rad).

    The link drags the motor against its Coulomb friction through the spring and one flank of the backlash.
    """
    if transmission.frequency == 0.0:
        return 0.0
    speed = 2.0 * math.pi * transmission.frequency
    bending = (leg.coulomb / (leg.inertia * speed * speed) for leg in (robot.leg1, robot.leg2))
    return max(bending) + 0.5 * transmission.backlash


def calibrate_by_turning_points(
    robot: FiveBar, tolerances: Tolerances, record: CalibrationRecord, lag: float = 0.0
) -> Calibration:
    """Return the geometry that explains the motors' turning points on the Type 2 locus; the IMU is not used.

    Only the elbow gap at the places of the crossings is seen; the platform and theta_2 are those of the locus.

    Args:
        robot: the geometry before.
        tolerances: how exactly it is known.
        record: readings of a motion through the locus.
        lag: by how much a motor that is dragged may lag behind its link (rad): the intervals include it.

    Raises:
        NotCalibratable: it does not cross the locus, or is that of another robot; where it would be that of the robot
            with encoders that are mounted, signed or scaled otherwise, the text names them.
    """
    try:
        points = turning_points(robot, record, lag)
    except NotCalibratable as error:
        words = " or ".join(explanations(record, lambda other: turning_points(robot, other), of_motors=True))
        if not words:
            raise
        raise ContradictsRobot(f"{CONTRADICTS}: {words}") from error
    count = len(GEOMETRY)
    start = values_before(robot)
    before = deviations_before(robot, tolerances)
    deviation = np.array([point.deviation for point in points])
    rows = np.zeros((len(points), len(PARAMETERS)))
    rows[:, :count] = np.array([point.row for point in points]) / deviation[:, None]
    gaps = np.array([point.gap for point in points]) / deviation
    prior = np.diag(1.0 / before**2)
    information = rows.T @ rows
    covariance = covariance_of(information + prior, before)
    change = -covariance @ (rows.T @ gaps)
    left = gaps + rows @ change
    misfit = float(left @ left) / len(left)
    samples = np.array([point.sample for point in points])
    theta = distal_angles(start[:count], record.motors[samples]).mean(axis=1)
    closed = closure((start + change)[:count], record.motors[samples], theta)
    return Calibration(
        start=start,
        values=start + change,
        covariance=covariance,
        before=before,
        information=information,
        times=record.times[samples],
        theta=theta,
        platform=closed.platform,
        residuals=left * deviation,
        across=np.zeros(len(points)),
        yielding=0.0,
        crossings=[LocusPassage(number, point.row) for number, point in enumerate(points)],
        misfit=misfit,
        colour=1.0,
        turning=None,
        resolution=encoder_resolution(record.motors),
    )
