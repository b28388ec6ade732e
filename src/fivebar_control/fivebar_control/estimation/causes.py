# SPDX-License-Identifier: Apache-2.0
"""Causes of an inconsistent estimate, in words, the most likely one first.

The watch sees innovations and no causes. How they have come tells some apart: an encoder that slips makes one large
innovation in a single sample; wrong geometry, zeros or a gyroscope's bias make innovations of one sign; elastic
transmissions and play swing, so that their innovations change sign.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.estimation.constants import EstimatorModel
from fivebar_control.estimation.readings import Misfit, Pattern, Trend, largest_offset, strain

NAMED = 0.25
"""Share of the limit beyond which a sensor is named besides the one that is furthest off: one that is wrong takes the
estimate away from what the others read, so that the furthest need not be the cause."""

ENCODERS_DIFFER = "the motor encoders differ"

UNDECLARED = 2.0
"""How much likelier elasticity and play are where `ekf.play` declares none."""


class Cause(NamedTuple):
    """A cause, what tells whether it is it, and how well it fits, for comparison."""

    words: str
    weight: float


def _one_sided(trend: Trend) -> float:
    """Return how much of a sensor's innovations has one sign, from 0 to 1."""
    return (trend.offset / trend.size) ** 2 if trend.size > 0.0 else 0.0


def causes_of(model: EstimatorModel, misfit: Misfit, pattern: Pattern) -> list[Cause]:
    """Return the causes that an inconsistent estimate may have, the most likely one first."""
    encoders, gyro = max(misfit.encoders, 1e-9), max(misfit.gyro, 1e-9)
    elbow = misfit.elbow if model.elbow else 0.0
    extra = misfit.extra if model.extra is not None else 0.0
    total = encoders + (gyro if model.gyro else 0.0) + elbow + extra
    part, part_gyro = encoders / total, gyro / total if model.gyro else 0.0
    # of the mean of both encoders' squares, the share of one sample
    sudden = min(1.0, 0.5 * model.misfit_share * pattern.jump**2 / encoders)
    encoder1, encoder2 = pattern.encoder1, pattern.encoder2
    one_sided = _one_sided(encoder1 if encoder1.size > encoder2.size else encoder2)
    one_sided_gyro = _one_sided(pattern.gyro) if model.gyro else 0.0
    swinging = part * (1.0 - one_sided) * (1.0 - sudden) + part_gyro * (1.0 - one_sided_gyro)
    # of what goes one way, a sensor's own fault shows in it, wrong geometry in all
    causes = [
        Cause(
            "elasticity or play of the transmissions beyond `ekf.play`"
            + (", which declares none" if model.play == 0.0 else "")
            + " (`fivebar identify --resonance` tells)",
            (UNDECLARED if model.play == 0.0 else 1.0) * swinging,
        ),
        Cause(
            "lengths or zeros beyond `tolerances` (`fivebar calibrate` tells)",
            # an error that is estimated beyond its limit says more than any innovation
            (1.0 - sudden) * one_sided * part + UNDECLARED * min(1.0, pattern.error / model.error_limit),
        ),
        Cause(f"the encoder of q{max(1, pattern.jumped)}1, which slips or lost counts", sudden * part),
    ]
    if model.gyro:
        weight = one_sided_gyro * part_gyro + UNDECLARED * min(1.0, pattern.bias / model.bias_limit)
        causes.append(Cause("the gyroscope's bias, sensitivity or mounting, or its clock", weight))
    if model.elbow:
        causes.append(Cause("the passive joint's encoder or its zero", elbow / total))
    if model.extra is not None:
        causes.append(Cause("the sensor of `extra_sensor`, or what is expected of it", extra / total))
    return sorted(causes, key=lambda cause: -cause.weight)


def inconsistency_reason(model: EstimatorModel, misfit: Misfit, pattern: Pattern) -> str:
    """Return in words why an estimate is inconsistent: what is beyond its limit, the furthest first, and causes."""
    causes = "; ".join(cause.words for cause in causes_of(model, misfit, pattern))
    return f"{_beyond(model, misfit, pattern)}; most likely first: {causes}"


def _beyond(model: EstimatorModel, misfit: Misfit, pattern: Pattern) -> str:
    far = sorted(
        (
            (misfit.encoders, ENCODERS_DIFFER),
            (misfit.gyro, "the gyroscope differs"),
            (misfit.elbow, "the passive joint's encoder differs"),
            (misfit.extra, "the sensor of `extra_sensor` differs"),
        ),
        reverse=True,
    )
    (mean, sensor), *others = far
    if mean <= model.misfit_limit and pattern.jump > model.jump_limit:
        also = _also([deviation for deviation in far if deviation[1] != ENCODERS_DIFFER], model.misfit_limit)
        return (
            f"the encoder of q{pattern.jumped}1 jumped by {pattern.jump:.1f} standard deviations from its prediction"
            f"{also}, limit {model.jump_limit:.1f}"
        )
    if mean <= model.misfit_limit and strain(model, pattern) > 1.0:
        parts = []
        if largest_offset(pattern) > NAMED * model.offset_limit:
            parts.append(_one_side(model, pattern))
        if pattern.error > NAMED * model.error_limit:
            parts.append(
                "a length, a zero or the gyroscope's sensitivity comes out at"
                f" {pattern.error:.1f} times its tolerance, limit {model.error_limit:.1f}"
            )
        if pattern.bias > NAMED * model.bias_limit:
            parts.append(
                f"the gyroscope's bias comes out at {pattern.bias:.1f} standard deviations of `gyro_bias`, as far as it"
                f" has been learned, limit {model.bias_limit:.1f}"
            )
        return " and ".join(parts)
    also = _also(others, model.misfit_limit)
    return (
        f"{sensor} from the predictions by {math.sqrt(mean):.1f} standard deviations{also}, limit"
        f" {math.sqrt(model.misfit_limit):.1f}"
    )


def _one_side(model: EstimatorModel, pattern: Pattern) -> str:
    """Return in words which sensor differs most from its predictions to one side."""
    (offset, name), *others = sorted(
        (
            (abs(pattern.encoder1.offset), "the encoder of q11 differs"),
            (abs(pattern.encoder2.offset), "the encoder of q21 differs"),
            (abs(pattern.gyro.offset), "the gyroscope differs"),
        ),
        reverse=True,
    )
    also = "".join(
        f", {other} by {other_offset:.1f}"
        for other_offset, other in others
        if other_offset > NAMED * model.offset_limit
    )
    return (
        f"{name} from its predictions to one side by {offset:.1f} standard deviations on average{also}, limit"
        f" {model.offset_limit:.1f}"
    )


def _also(others: list[tuple[float, str]], limit: float) -> str:
    """Return the other sensors whose mean squares are near the limit, with their deviations."""
    return "".join(
        f", {other} by {math.sqrt(mean_square):.1f}" for mean_square, other in others if mean_square > NAMED * limit
    )
