# SPDX-License-Identifier: Apache-2.0
"""A camera's positions in the least squares of a calibration: they fix the scale, which angles and rates leave open.

A position z that was stamped with tau belongs to the sample k that is nearest,

    z = P_k + v_k (tau - t_k - delay) + shift + turn (-P_y, P_x) + n,

with the platform's velocity v_k from its positions at the neighbouring samples. Unknown are shift, turn and delay.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fivebar_control.calibration.arrowhead import Rows
from fivebar_control.calibration.closure import BASE_2, L_21, L_22, ZERO_2, Closure
from fivebar_control.calibration.parameters import COMPLIANCE, PLAY, SHIFT_X, SHIFT_Y, STAMPED, TURN
from fivebar_control.calibration.record import SeenPositions

FloatArray = NDArray[np.float64]

INTERVAL = 0.1
"""Time (s) of which one position is used: what lens and marks leave is the same in neighbouring ones."""

LEAST_DEVIATION = 3e-5
"""Standard deviation (m) that lens, marks and the height of the tag leave, whatever a position says of itself."""


class SeenRows:
    """The positions that are used, and their rows."""

    def __init__(self, seen: SeenPositions, times: FloatArray) -> None:
        """Choose among positions those that go with samples at some times (s)."""
        inside = (seen.times >= times[0]) & (seen.times <= times[-1]) & np.all(np.isfinite(seen.positions), axis=1)
        kept = np.flatnonzero(inside)
        _, first = np.unique(np.floor((seen.times[kept] - times[0]) / INTERVAL), return_index=True)
        kept = kept[first]
        self._times, self._measured = times, seen.positions[kept]
        self._weight = 1.0 / np.maximum(seen.deviations[kept], LEAST_DEVIATION)
        after = np.clip(np.searchsorted(times, seen.times[kept]), 1, len(times) - 1)
        earlier = seen.times[kept] - times[after - 1] < times[after] - seen.times[kept]
        self._sample = after - earlier
        self._since = seen.times[kept] - times[self._sample]

    def __len__(self) -> int:
        """Return the number of positions."""
        return len(self._sample)

    def rows(
        self, values: FloatArray, states: FloatArray, motors: FloatArray, directions: FloatArray, torques: FloatArray,
        closed: Closure,
    ) -> list[Rows]:  # fmt: skip
        """Return the rows of x and of y.

        Args:
            values: [19], of the parameters.
            states: angles theta_2 of all samples (rad).
            motors: [n, 2], the links' angles by the encoders, zeros not yet taken off (rad).
            directions: [n, 2], in which the motors turn.
            torques: [n, 2], of the motors (Nm).
            closed: the closure at these.
        """
        k = self._sample
        platform = closed.platform[: len(self._times)]
        velocity = np.gradient(platform, self._times, axis=0)[k]
        x, y = platform[k].T
        q_21, theta = motors[k, 1] - values[ZERO_2], states[k]
        lag = self._since - values[STAMPED]
        of_sensors = []
        for axis, (r_2, across, u_2, turned, circling) in enumerate(
            (
                (np.cos(q_21), -np.sin(q_21), np.cos(theta), -np.sin(theta), -y),
                (np.sin(q_21), np.cos(q_21), np.sin(theta), np.cos(theta), x),
            )
        ):
            model = platform[k, axis] + velocity[:, axis] * lag + values[SHIFT_X + axis] + values[TURN] * circling
            by_motor = values[L_21] * across
            by = np.zeros((len(k), len(values)))
            by[:, L_21], by[:, L_22] = r_2, u_2
            by[:, BASE_2] = 1.0 if axis == 0 else 0.0
            by[:, ZERO_2] = -by_motor
            by[:, PLAY.start + 1] = -by_motor * directions[k, 1]
            by[:, COMPLIANCE.start + 1] = -by_motor * torques[k, 1]
            by[:, SHIFT_X if axis == 0 else SHIFT_Y] = 1.0
            by[:, TURN] = circling
            by[:, STAMPED] = -velocity[:, axis]
            weight = self._weight
            of_sensors.append(
                Rows(
                    (model - self._measured[:, axis]) * weight,
                    by * weight[:, None],
                    values[L_22] * turned * weight,
                    np.zeros(len(k)),
                    k,
                )
            )
        return of_sensors
