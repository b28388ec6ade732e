"""Times a case of a sweep so that its robots are likely to make it, and says how likely that is."""

from __future__ import annotations

import numpy as np

from fivebar_bringup.studies.sweep.drawing import Draw

ODDS = 4
"""Random stream of a case besides those of its motion and its robot."""

SLOWEST, QUICKEST, STEP = 1.4, 0.2, 0.8
"""Longest and shortest duration that is tried, and the step between two, relative to the one drawn."""


def odds_seed(case: Draw) -> int:
    """Return the seed of the robots on which a case is tried, none of which is its own."""
    return int(np.random.default_rng((case.seed, case.number, ODDS)).integers(2**62))
