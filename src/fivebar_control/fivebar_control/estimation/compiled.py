# SPDX-License-Identifier: Apache-2.0
"""The step of the estimator compiled for real time: the same functions, ten times as fast."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from fivebar_control.compiling import compiled_and_kept, kept_by_itself
from fivebar_control.estimation.constants import EstimatorModel
from fivebar_control.estimation.frozen import FrozenMemory
from fivebar_control.estimation.readings import EstimatorMemory
from fivebar_control.estimation.step import EstimatorStep, estimator_step, estimator_step_with
from fivebar_description.extra_sensor import ExtraSensor

# the compiled engine has it too
kept_by_itself(estimator_step)


@cache
def compiled_step(extra: ExtraSensor | None = None) -> Callable[..., EstimatorStep]:
    """Return `estimator_step` as machine code, with a sensor from another package or without.

    The first call compiles for some seconds where no process has done so before; then it loads the code from disk.
    """
    names = {} if extra is None else {"estimator_step": estimator_step_with(extra.expected)}
    step = compiled_and_kept(_step, **names)

    def stepped(
        model: EstimatorModel,
        memory: EstimatorMemory,
        frozen: FrozenMemory,
        start: int,
        commands: Sequence[tuple[float, float]],
        first: int,
        coasts: bool,
    ) -> EstimatorStep:
        torques = np.array(commands, dtype=np.float64).reshape(len(commands), 2)
        result: EstimatorStep = step(model, memory, frozen, start, torques, first, coasts)
        return result

    return stepped


def _step(
    model: EstimatorModel,
    memory: EstimatorMemory,
    frozen: FrozenMemory,
    start: int,
    commands: NDArray[np.float64],
    first: int,
    coasts: bool,
) -> EstimatorStep:
    return estimator_step(model, memory, frozen, start, commands, first, coasts)
