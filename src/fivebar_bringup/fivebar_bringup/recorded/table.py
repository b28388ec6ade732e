# SPDX-License-Identifier: Apache-2.0
"""A run as one table: a row per sample, a column per quantity, read from a bag or from a run in memory."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from fivebar_bringup.bag.recording import FloatArray, IntArray, Recording
from fivebar_bringup.errors import BagError
from fivebar_description.interface import JOINT_STATES, Topic
from fivebar_description.run_quantities import PASSIVE_ANGLE, Quantity, quantities


class RunTable:
    """The quantities of a run over its n recorded samples, joined by stamp; each is decoded when it is first asked for.

    A row is NaN where its topic has no message with the sample's stamp. Of several messages with one stamp the first
    counts: a plant repeats sample 0 until it is answered, and the zero torque that a stopping blender publishes last
    carries the stamp of its last answer.

    Attributes:
        sample: int64[n], number of the sample; gaps are samples that were not recorded.
        stamp_ns: int64[n], the stamp (ns).
        log_time_ns: int64[n], when the sample was recorded (ns), a repeated one for the last time.
        rate_hz: sampling rate (Hz).
    """

    def __init__(
        self, recording: Recording, rate_hz: int, nominal: Topic, rows: Topic = JOINT_STATES, passive: str = ""
    ) -> None:
        """Find the samples of a recording.

        Args:
            recording: the run.
            rate_hz: its sampling rate (Hz).
            nominal: topic of the controller's nominal law.
            rows: the topic whose messages are the samples.
            passive: the passive joint that has an encoder, "" for the first one that its topic names.

        Raises:
            BagError: there is no such topic, or none of its stamps is on the grid.
        """
        self.recording = recording
        self.rate_hz = rate_hz
        self._nominal = nominal
        self._passive = passive
        self._known: dict[str, FloatArray] = {}
        numbers = recording.samples(rows, rate_hz)
        if numbers.size and np.all(numbers < 0):
            raise BagError(recording.path, f"/{rows.name}: no stamp is on the grid of {rate_hz} Hz from the epoch on")
        last_first = numbers[::-1]
        self.sample, last = np.unique(last_first[last_first >= 0], return_index=True)
        self.log_time_ns: IntArray = recording.log_times(rows)[::-1][last_first >= 0][last]
        self.stamp_ns: IntArray = recording.stamps(rows)[::-1][last_first >= 0][last]

    @cached_property
    def quantities(self) -> tuple[Quantity, ...]:
        """The quantities, in the order of the columns."""
        return quantities(self._nominal)

    def values(self, quantity: Quantity) -> FloatArray:
        """Return [n, columns] of a quantity; NaN where it was not recorded.

        Raises:
            BagError: its topic lacks one of its names, or holds another number of values.
        """
        (own,) = (own for own in self.quantities if own.name == quantity.name)
        if own.name not in self._known:
            self._known[own.name] = self._joined(own)
        return self._known[own.name]

    def columns(self) -> dict[str, FloatArray]:
        """Return every column of which at least one value is known, [n] each, by its name."""
        by_name: dict[str, FloatArray] = {}
        for quantity in self.quantities:
            values = self.values(quantity)
            known = [
                name
                for name in quantity.columns
                if name and not np.all(np.isnan(values[:, quantity.columns.index(name)]))
            ]
            by_name |= {name: values[:, quantity.columns.index(name)] for name in known}
        return by_name

    def _joined(self, quantity: Quantity) -> FloatArray:
        recording, width = self.recording, len(quantity.columns)
        if recording.count(quantity.topic) == 0:
            return self._unknown(width)
        values = recording.field(quantity.topic, quantity.field)
        if values.shape[1] == 0:
            return self._unknown(width)
        names = (self._passive,) if quantity.name == PASSIVE_ANGLE.name and self._passive else quantity.names
        if names:
            values = recording.values(quantity.topic, quantity.field, names)
        numbers, first = np.unique(recording.samples(quantity.topic, self.rate_hz), return_index=True)
        joined = self._unknown(width)
        _, here, there = np.intersect1d(self.sample, numbers, assume_unique=True, return_indices=True)
        joined[here] = values[first[there], :width]
        return joined

    def _unknown(self, width: int) -> FloatArray:
        return np.full((self.sample.size, width), math.nan)
