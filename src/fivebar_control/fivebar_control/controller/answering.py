# SPDX-License-Identifier: Apache-2.0
"""The answers to samples as a generator of numbers, which is plain Python or machine code as it stands.

It keeps the loop's memory, so that nothing but a sample's numbers is handed over: to hand over the memory would take
longer than the answer.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fivebar_control.laws.law import no_step, unchanged
from fivebar_control.loop.closed_loop import Known, LoopSettings, answer, cleared, stopped, unanswered
from fivebar_control.loop.cycle import CycleMemory
from fivebar_control.loop.sampled_plan import planned_in
from fivebar_control.model.kinematics import state_from_joints

FloatArray = NDArray[np.float64]

NUMBER, MOMENT, EVENT, D1, D2, TRIP, FIRST_JOINT, FIRST_OF_PLAN = 0, 1, 2, 3, 4, 5, 6, 14
"""Numbers given: sample and moment of its reference, the event, disturbances (Nm), fault of the estimator, angles and
rates of the joints, and the row of the plan."""

SAMPLE, CLEARED, STOPPED = 0.0, 1.0, 2.0
"""Events: a sample to be answered, a fault that is cleared, samples that were lost for too long."""

GIVEN = FIRST_OF_PLAN + 10

RESULTS = 17
"""Numbers of an answer: x, y, vx, vy (m, m/s), sigma, kappa, torques of the laws, requested and commanded (Nm), numbers
of the fault detected at the sample and of the first one, and whether one was latched before."""

nominal_step = constraint_step = no_step
nominal_after_gap = constraint_after_gap = unchanged
"""The laws, to be bound before (`law_functions`)."""


def answering(
    settings: LoopSettings, first: CycleMemory, references: FloatArray, inputs: FloatArray, out: FloatArray
) -> Iterator[int]:
    """Answer a sample at each step of the iterator.

    Args:
        settings: constants.
        first: memory before the first sample.
        references: of the sampled plan (`Sampled`).
        inputs: float64[GIVEN], filled before each step.
        out: float64[RESULTS], filled by it.
    """
    loop = unanswered(first, 0)
    while True:
        number = int(inputs[NUMBER])
        if inputs[EVENT] == CLEARED:
            loop = cleared(loop)
        elif inputs[EVENT] == STOPPED:
            loop = stopped(loop, number)
        else:
            j = inputs[FIRST_JOINT:]
            state = state_from_joints(settings.control.robot, j[0], j[1], j[2], j[3], j[4], j[5], j[6], j[7])
            planned = planned_in(settings.control, inputs[FIRST_OF_PLAN:], references, int(inputs[MOMENT]))
            loop = answer(
                nominal_step,
                constraint_step,
                nominal_after_gap,
                constraint_after_gap,
                settings,
                loop,
                number,
                Known(True, state, inputs[D1], inputs[D2], int(inputs[TRIP])),
                planned,
            )
            out[0], out[1], out[2], out[3] = state.x, state.y, state.vx, state.vy
        cycle = loop.cycle
        out[4], out[5] = cycle.sigma, cycle.kappa
        out[6], out[7] = cycle.nominal.tau1, cycle.nominal.tau2
        out[8], out[9] = cycle.constraint.tau1, cycle.constraint.tau2
        out[10], out[11] = cycle.requested.tau1, cycle.requested.tau2
        out[12], out[13] = cycle.command.tau1, cycle.command.tau2
        out[14], out[15], out[16] = cycle.fault, loop.fault, 1.0 if loop.latched else 0.0
        yield number
