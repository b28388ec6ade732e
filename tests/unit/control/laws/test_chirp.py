# SPDX-License-Identifier: Apache-2.0
"""The excitation for the transmissions' resonance: its frequency, its sweeps, and the soft hold beside it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import trapezoid

from fivebar_control.laws.chirp import HIGHEST, LAW, ChirpMemory, ChirpSettings, chirp, chirp_step
from fivebar_control.laws.law import Instant
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.line import Line
from fivebar_control.model.state import Platform
from fivebar_description.robot_file import load_robot

SETTINGS = ChirpSettings(amplitude=1.5, from_hz=4.0, to_hz=20.0, sweep=0.5)
ROBOT, MODES, PERIOD = load_robot(), (1, -1), 0.002
NO_LINE = Line(*(math.nan,) * len(Line._fields))


@pytest.mark.parametrize("highest", [math.inf, 12.0])
def test_each_sweep_rises_linearly_from_the_first_frequency_to_the_last_or_the_highest(highest: float) -> None:
    """A sine of the integral of the frequency; both motors turn the same way in every other sweep."""
    assert LAW.memory == ChirpMemory(0)
    last = min(20.0, highest)
    for since in np.linspace(0.0, 0.499, 40).tolist():
        course = np.linspace(0.0, since, 200)
        turns = trapezoid(4.0 + (last - 4.0) * course / 0.5, course)
        wave = 1.5 * math.sin(2.0 * math.pi * float(turns))
        assert chirp(SETTINGS, since, highest) == pytest.approx((wave, wave), abs=1e-12)
        assert chirp(SETTINGS, 0.5 + since, highest) == pytest.approx((wave, -wave), abs=1e-9)
        assert chirp(SETTINGS, 1.0 + since, highest) == pytest.approx((wave, wave), abs=1e-9)


def test_every_second_pair_of_sweeps_has_a_smaller_amplitude() -> None:
    falling = SETTINGS._replace(fall=0.6)
    for pair, factor in enumerate((1.0, 0.6, 1.0)):
        for sweep in range(2):
            time = 0.5 * (2 * pair + sweep) + 0.31
            wave = factor * np.array(chirp(SETTINGS, time, math.inf))
            assert chirp(falling, time, math.inf) == pytest.approx(tuple(wave), abs=1e-12)
            assert abs(wave[0]) > 0.1


def test_the_motors_are_held_softly_and_friction_is_compensated_beside_the_chirp() -> None:
    """In units of the motors' own inertias, by the shortest way round; each call is a sample later."""
    reference = reference_from_platform(ROBOT, MODES, Platform(0.01, 0.14, 0.1, -0.2, 0.0, 0.0))
    state = state_from_platform(ROBOT, MODES, 0.02, 0.13, -0.1, 0.3)
    turned = state._replace(leg1=state.leg1._replace(q1=state.leg1.q1 + 2.0 * math.pi))
    torque, memory = chirp_step(
        ROBOT,
        Instant(turned, reference, NO_LINE, MODES, 0.0, PERIOD, None),
        ChirpMemory(130),
        SETTINGS._replace(to_hz=1e3, kp=90.0, kd=15.0),
    )
    assert memory == ChirpMemory(131)
    # 200 Hz at most at 500 samples per second
    waves = chirp(SETTINGS._replace(to_hz=HIGHEST * 500.0), 0.26, math.inf)
    for leg, wanted, now, friction, wave, found in zip(
        ROBOT[:2], reference.state[:2], state[:2], (reference.f1, reference.f2), waves, torque, strict=True
    ):
        back = 90.0 * (wanted.q1 - now.q1) + 15.0 * (wanted.dq1 - now.dq1)
        assert found == pytest.approx(leg.inertia * back + friction + wave, rel=1e-9)
