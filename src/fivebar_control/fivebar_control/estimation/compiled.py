"""The steps of the estimator compiled for real time: the same functions, six times as fast."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from fivebar_control.compiling import compiled_and_kept, kept_by_itself
from fivebar_control.estimation.constants import EstimatorModel
from fivebar_control.estimation.estimator import EstimatorSteps
from fivebar_control.estimation.readings import EstimatorMemory
from fivebar_control.estimation.step import Prediction, Update, next_update, prediction

# the compiled engine has them too
kept_by_itself(next_update)
kept_by_itself(prediction)


@cache
def compiled_steps() -> EstimatorSteps:
    """Return the steps as machine code.

    The first call of each compiles for some seconds where no process has done so before; then it loads the code from
    disk.
    """
    update, predict = compiled_and_kept(_next_update), compiled_and_kept(_prediction)

    def predicted(
        model: EstimatorModel, memory: EstimatorMemory, commands: Sequence[tuple[float, float]], first: int
    ) -> Prediction:
        torques = np.array(commands, dtype=np.float64).reshape(len(commands), 2)
        result: Prediction = predict(model, memory, torques, first)
        return result

    return EstimatorSteps(update, predicted)


def _next_update(model: EstimatorModel, memory: EstimatorMemory, start: int) -> Update:
    return next_update(model, memory, start)


def _prediction(
    model: EstimatorModel, memory: EstimatorMemory, commands: NDArray[np.float64], first: int
) -> Prediction:
    return prediction(model, memory, commands, first)
