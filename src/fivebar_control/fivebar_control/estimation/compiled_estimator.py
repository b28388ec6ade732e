# SPDX-License-Identifier: Apache-2.0
"""The estimator whose memory stays with machine code, so that none of it is handed over at a sample.

To hand it over takes longer than to work out a sample.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba.core import types
from numba.experimental import structref
from numpy.typing import NDArray

from fivebar_control.compiling import bound_apart, compiled_and_kept, kept_by_itself
from fivebar_control.estimation.constants import EstimatorModel
from fivebar_control.estimation.ekf import Belief, Estimate
from fivebar_control.estimation.estimator import (
    NO_READINGS,
    Ahead,
    MotorReadings,
    StateEstimator,
    Torques,
)
from fivebar_control.estimation.frozen import FrozenMemory
from fivebar_control.estimation.late_reading import LateReading
from fivebar_control.estimation.late_sensors import with_readings
from fivebar_control.estimation.mirror import AmbiguityCheck
from fivebar_control.estimation.readings import EstimatorMemory, Misfit
from fivebar_control.estimation.step import EstimatorStep, FilterFunctions, Prediction, estimator_step, first_update
from fivebar_control.model.state import Joints
from fivebar_description.parameters import FiveBar

FloatArray = NDArray[np.float64]

# the compiled engine has them too
for part in (with_readings, estimator_step):
    kept_by_itself(part)


@structref.register
class _FilterType(types.StructRef):  # type: ignore[name-defined]
    """The type of a `FilterState` in machine code."""


class FilterState(structref.StructRefProxy):
    """Constants and memory of the filter in the hands of machine code.

    Attributes:
        model: constants.
        memory, frozen: as `estimator_step` has them.
        estimate, ambiguity: of its last prediction.
    """

    def __new__(
        cls,
        model: EstimatorModel,
        memory: EstimatorMemory,
        frozen: FrozenMemory,
        estimate: Estimate,
        ambiguity: AmbiguityCheck,
    ) -> FilterState:
        """Hand them over."""
        state: FilterState = structref.StructRefProxy.__new__(cls, model, memory, frozen, estimate, ambiguity)
        return state


structref.define_proxy(FilterState, _FilterType, ["model", "memory", "frozen", "estimate", "ambiguity"])

Details = tuple[EstimatorMemory, FrozenMemory, Estimate, AmbiguityCheck]

NO_LATE: FloatArray = np.empty((0, len(LateReading._fields)))

RESULTS = 22
"""Numbers of a sample's result: joints, variances, disturbance, misfit, trip and whether the estimate is lost."""


def _keep(state: FilterState, stepped: EstimatorStep, out: FloatArray) -> None:
    """Keep the memory after a sample, and write its result."""
    prediction = stepped.prediction
    state.memory, state.frozen = prediction.memory, stepped.frozen
    state.estimate, state.ambiguity = prediction.estimate, prediction.ambiguity
    for index, value in enumerate(prediction.joints):
        out[index] = value
    for index in range(6):
        out[8 + index] = prediction.memory.belief.covariance[index, index]
    out[14], out[15] = prediction.memory.belief.estimate.d1, prediction.memory.belief.estimate.d2
    squared = stepped.squared
    out[16], out[17], out[18], out[19] = squared.encoders, squared.gyro, squared.elbow, squared.extra
    out[20], out[21] = float(prediction.trip), 1.0 if prediction.lost else 0.0


def _begin(state: FilterState, commands: FloatArray, out: FloatArray) -> None:
    _keep(state, estimator_step(state.model, state.memory, state.frozen, 1, commands, 0, False), out)


def _go_on(
    state: FilterState,
    sample: int,
    periods: int,
    q11: float,
    q21: float,
    tau1: float,
    tau2: float,
    readings: FloatArray,
    commands: FloatArray,
    coasts: bool,
    out: FloatArray,
) -> None:
    placed = with_readings(state.model, state.memory, sample, periods, q11, q21, tau1, tau2, readings)
    _keep(
        state,
        estimator_step(state.model, placed.memory, state.frozen, placed.start, commands, 0, coasts),
        out,
    )


def _details(state: FilterState) -> Details:
    return state.memory, state.frozen, state.estimate, state.ambiguity


class _MachineCode(NamedTuple):
    begin: Callable[..., None]
    go_on: Callable[..., None]
    details: Callable[[FilterState | None], Details]


class CompiledEstimator(StateEstimator):
    """The state estimator with the filter as machine code, which keeps the memory."""

    _state: FilterState | None = None

    def warm_up(self) -> None:
        """Work out two samples that do not count, so that all machine code is loaded before the first one does."""
        q11, q21 = self._expected_motors()
        pending = [(0.0, 0.0)] * self._model.delay_samples
        self._first(first_update(self._model, self._homing.assembly, q11, q21), pending)
        self._next(MotorReadings(1, 1, q11, q21, 0.0, 0.0), (), pending, False)
        self._details()
        self._state, self.squared = None, NO_READINGS

    def _first(self, memory: EstimatorMemory, pending: Torques) -> Ahead:
        self._out = np.zeros(RESULTS)
        self._commands_of_sample = _pairs(pending)
        self._code = _machine_code(self._filter)
        self._hand_over(memory, self._frozen, memory.belief.estimate, AmbiguityCheck(0, math.inf, False))
        self._code.begin(self._state, _pairs(pending), self._out)
        return self._result()

    def _next(
        self,
        motors: MotorReadings,
        readings: Sequence[LateReading],
        pending: Torques,
        coasts: bool,
    ) -> Ahead:
        self._code.go_on(
            self._state,
            *motors,
            np.array(readings, dtype=np.float64) if readings else NO_LATE,
            self._torques(pending),
            coasts,
            self._out,
        )
        ahead = self._result()
        self.squared = Misfit(*self._values[16:20])
        return ahead

    def _torques(self, pending: Torques) -> FloatArray:
        """Return torques as an array, [n, 2], which is the same one at every sample, as their number is."""
        rows = self._commands_of_sample
        for number, (tau1, tau2) in enumerate(pending):
            rows[number, 0], rows[number, 1] = tau1, tau2
        return rows

    def _result(self) -> Ahead:
        self._values = values = self._out.tolist()
        d1, d2 = values[14:16]
        return Ahead(Joints(*values[:8]), tuple(values[8:14]), (d1, d2), int(values[20]), values[21] > 0.0)

    def _hand_over(self, memory: EstimatorMemory, *rest: Any) -> None:
        self._state = FilterState(self._model, memory, *rest)

    def _details(self) -> tuple[Prediction, FrozenMemory]:
        memory, frozen, estimate, ambiguity = self._code.details(self._state)
        ahead = self._result()
        return Prediction(memory, estimate, ahead.joints, ahead.lost, ambiguity, ahead.trip), frozen

    @property
    def belief(self) -> Belief | None:
        """Belief at the measurement of the last sample, not yet predicted over the delay; None before the first."""
        return None if not self._begun else self._details()[0].memory.belief

    def carry(self, robot: FiveBar) -> None:
        """Go on with another mass of the platform."""
        super().carry(robot)
        if self._state is not None:
            memory, frozen, estimate, ambiguity = self._code.details(self._state)
            self._hand_over(memory, frozen, estimate, ambiguity)


@cache
def _machine_code(functions: FilterFunctions) -> _MachineCode:
    whom, names = functions.estimator_step.__name__, functions._asdict()
    return _MachineCode(
        *(compiled_and_kept(bound_apart(whom, function, **names)) for function in (_begin, _go_on, _details))
    )


def _pairs(pending: Torques) -> FloatArray:
    """Return torques as an array, [n, 2]."""
    return np.array(pending, dtype=np.float64).reshape(len(pending), 2)
