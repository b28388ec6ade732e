# SPDX-License-Identifier: Apache-2.0
"""Calibration of the geometry by least squares over encoders, gyroscope, touched points and a camera's positions.

With two motors and two degrees of freedom the motors' encoders alone fit any geometry, but on the Type 2 locus. The
gyroscope of the distal link adds its angle theta_2, up to where it starts: between two samples it turns by the integral
of the readings, so that neither angles nor rates are differentiated. At every sample k the closure (see `closure`) must
hold within the encoders' noise, and between samples the angles theta_2,k follow the gyroscope within its own:

    F(q_11,k, q_21,k, theta_2,k) = n_q
    (1 + kappa) (theta_2,k+1 - theta_2,k) + b T_k - G_k = n_g,    G_k = integral of the readings.

Unknown are the geometry, the gyroscope's bias b, error kappa of its sensitivity and delay of its stamps, and all
theta_2,k. The geometry's tolerances before the calibration are part of the least squares, as what is known from
elsewhere: what cannot be seen stays as it was.
"""

from __future__ import annotations

from fivebar_control.calibration.alternative_mountings import explanations
from fivebar_control.calibration.least_squares import ClosureProblem
from fivebar_control.calibration.record import (
    CONTRADICTS,
    NOT_SEEN,
    CalibrationRecord,
    ContradictsRobot,
    SeenPositions,
    TouchedPoint,
    turning,
)
from fivebar_control.calibration.result import Calibration
from fivebar_description.imu import ImuSettings
from fivebar_description.parameters import FiveBar
from fivebar_description.tolerances import Tolerances


def calibrate(
    robot: FiveBar,
    tolerances: Tolerances,
    record: CalibrationRecord,
    imu: ImuSettings | None = None,
    touched: tuple[TouchedPoint, ...] = (),
    seen: SeenPositions = NOT_SEEN,
    known: Calibration | None = None,
) -> Calibration:
    """Return the geometry that explains a recording.

    Args:
        robot: the geometry before.
        tolerances: how exactly it is known; parameters whose tolerance is 0 are held.
        record: readings of a motion through the Type 2 locus.
        imu: rough mounting of the IMU.
        touched: measured places of the platform.
        seen: the platform by a camera during the motion.
        known: the calibration from earlier recordings of the same robot, whose geometry takes the place of what was
            known before; sensors and drives are found anew.

    Raises:
        NotCalibratable: the recording is too short, does not cross the locus, or is that of another robot; where it
            would be that of the robot with sensors that are mounted, signed or scaled otherwise, the text names them.
    """
    try:
        return _calibrated(robot, tolerances, record, imu, touched, seen, known)
    except ContradictsRobot as error:
        words = next(explanations(record, lambda other: _calibrated(robot, tolerances, other, imu)), None)
        raise error if words is None else ContradictsRobot(f"{CONTRADICTS}: {words}") from error


def _calibrated(
    robot: FiveBar,
    tolerances: Tolerances,
    record: CalibrationRecord,
    imu: ImuSettings | None,
    touched: tuple[TouchedPoint, ...] = (),
    seen: SeenPositions = NOT_SEEN,
    known: Calibration | None = None,
) -> Calibration:
    turned = turning(record, (imu or ImuSettings()).rotation()[2])
    problem = ClosureProblem(robot, tolerances, record, turned, touched, seen, known)
    fit = min((problem.fitted(*start) for start in problem.starts()), key=lambda candidate: candidate.cost)
    # weighed against what was known before by what the residuals turn out to be
    problem.colour = problem.found_colour(fit)
    return problem.result(problem.fitted(fit.values, fit.states))
