# SPDX-License-Identifier: Apache-2.0
"""Faults that the estimator finds, as numbers for compiled code and by their names."""

from __future__ import annotations

from fivebar_control.safety.stages import NO_FAULT

ESTIMATE_LOST, ESTIMATE_AMBIGUOUS = 6, 7
ESTIMATE_INCONSISTENT, ENCODER_FROZEN = 9, 12
GYROSCOPE_MISSING, GYROSCOPE_LATE, GYROSCOPE_SATURATED, GYROSCOPE_FROZEN, GYROSCOPE_EARLY = 14, 15, 16, 17, 18

TRIP_NAMES = {
    NO_FAULT: "",
    ESTIMATE_LOST: "estimate_lost",
    ESTIMATE_AMBIGUOUS: "estimate_ambiguous",
    ESTIMATE_INCONSISTENT: "estimate_inconsistent",
    ENCODER_FROZEN: "encoder_frozen",
    GYROSCOPE_MISSING: "gyroscope_missing",
    GYROSCOPE_LATE: "gyroscope_late",
    GYROSCOPE_SATURATED: "gyroscope_saturated",
    GYROSCOPE_FROZEN: "gyroscope_frozen",
    GYROSCOPE_EARLY: "gyroscope_early",
}
"""Names by number, beside those of the guard's stages and of the closed loop."""

TRIP_NUMBERS = {name: number for number, name in TRIP_NAMES.items()}
