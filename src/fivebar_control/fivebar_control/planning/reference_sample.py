"""What counts of a reference at one instant: torque, speed, and how far it is from both singularities."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.laws.reference import Reference
from fivebar_control.machine_code import as_machine_code
from fivebar_control.model.singularity import inverse_condition, type1_margin
from fivebar_control.planning.reference_torque import full_torque
from fivebar_control.trajectory.desired import reference_of
from fivebar_description.parameters import FiveBar, with_floats

FloatArray = NDArray[np.float64]


class ReferenceSample(NamedTuple):
    """The reference at one sample: torque (Nm), speed (rad/s), |sin q_i2|, kappa, place (m)."""

    torque: float
    speed: float
    serial: float
    kappa: float
    x: float
    y: float


def sample_of(robot: FiveBar, reference: Reference) -> ReferenceSample:
    """Return the quantities of a desired instant, with the torque of its inverse dynamics."""
    state, torque = reference.state, full_torque(robot, reference)
    return ReferenceSample(
        torque=larger(torque.tau1, torque.tau2),
        speed=larger(state.leg1.dq1, state.leg2.dq1),
        # a motion that is planned in the motors' angles is meant to meet Type 1
        serial=math.inf if reference.by_motors else type1_margin(state),
        kappa=inverse_condition(state),
        x=state.x,
        y=state.y,
    )


def samples_of(robot: FiveBar, references: FloatArray) -> list[ReferenceSample]:
    """Return the quantities of desired instants, given as `write_reference` writes them."""
    samples = np.empty((len(references), len(ReferenceSample._fields)))
    as_machine_code(write_samples)(with_floats(robot), references, samples)
    return [ReferenceSample(*row) for row in samples.tolist()]


def write_samples(robot: FiveBar, references: FloatArray, samples: FloatArray) -> None:
    """Write the quantities of desired instants into rows, [N, 6] as in `ReferenceSample`."""
    for number in range(len(references)):
        for index, value in enumerate(sample_of(robot, reference_of(references[number]))):
            samples[number, index] = value


def larger(one: float, two: float) -> float:
    """Return the larger magnitude, NaN if one is NaN (`max` alone would lose it)."""
    one, two = abs(one), abs(two)
    return one if one >= two or math.isnan(one) else two
