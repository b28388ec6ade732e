"""The error-based adaptive gain (4.1.3)."""

from __future__ import annotations

from fivebar_control.laws.adaptive_gain import AdaptiveGain, AdaptiveGainSettings

SETTINGS = AdaptiveGainSettings(alpha=2.0, error_limit=1e-4)
NOMINAL = (1.0, 1.0)


def test_outside_a_zone_the_gains_are_nominal_whatever_the_error() -> None:
    gain = AdaptiveGain(SETTINGS)
    assert [gain.factors(False, error, -error) for error in (0.0, 0.01, 0.05)] == [NOMINAL] * 3


def test_a_jump_of_the_error_since_the_zone_began_raises_the_gains_and_keeps_the_damping() -> None:
    gain = AdaptiveGain(SETTINGS)
    gain.factors(False, 0.003, -0.002)
    assert gain.factors(True, 0.00305, -0.00195) == NOMINAL
    assert gain.factors(True, 0.0032, -0.002) == (4.0, 2.0)
    assert gain.factors(True, 0.00305, -0.002) == NOMINAL


def test_one_coordinate_is_enough() -> None:
    """Nominal gains need both within the limit ("and"), where the thesis prints "or"."""
    gain = AdaptiveGain(SETTINGS)
    gain.factors(False, 0.0, 0.0)
    assert gain.factors(True, 0.0, -2e-4) == (4.0, 2.0)
    assert gain.factors(True, 2e-4, 0.0) == (4.0, 2.0)
    assert gain.factors(True, 1e-4, -1e-4) == NOMINAL


def test_the_printed_scaling_multiplies_both_gains_alike() -> None:
    gain = AdaptiveGain(SETTINGS._replace(keep_damping=False))
    gain.factors(False, 0.0, 0.0)
    assert gain.factors(True, 1e-3, 0.0) == (2.0, 2.0)


def test_the_last_sample_before_each_zone_is_the_measure() -> None:
    gain = AdaptiveGain(SETTINGS)
    gain.factors(False, 0.0, 0.0)
    assert gain.factors(True, 1e-3, 0.0) == (4.0, 2.0)
    gain.factors(False, 1e-3, 0.0)
    assert gain.factors(True, 1e-3, 0.0) == NOMINAL


def test_a_run_that_begins_inside_a_zone_is_measured_from_its_first_sample() -> None:
    gain = AdaptiveGain(SETTINGS)
    assert gain.factors(True, 0.01, 0.0) == NOMINAL
    assert gain.factors(True, 0.01, 0.0) == NOMINAL
    assert gain.factors(True, 0.011, 0.0) == (4.0, 2.0)
