# SPDX-License-Identifier: Apache-2.0
"""Encoders and drives one by one."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_sim.effects.settings import PlantSettings
from fivebar_sim.sensors import Encoder, TorqueOutput

FREE = PlantSettings(torque_limit=None)
TORQUE = st.floats(-50.0, 50.0)


@given(angle=st.floats(-10.0, 10.0), counts=st.sampled_from([100, 4096, 40_000, 1_000_000]))
def test_an_encoder_rounds_down_to_a_count(angle: float, counts: int) -> None:
    resolution = 2.0 * math.pi / counts
    measured, velocity = Encoder(counts, 0.002).read(angle)
    assert -1e-14 <= angle - measured < resolution + 1e-14
    assert measured / resolution == pytest.approx(round(measured / resolution), abs=1e-6)
    assert velocity == 0.0


def test_negative_angles_are_rounded_down_too() -> None:
    """Towards minus infinity, not towards zero: the counts stay evenly spaced through zero."""
    encoder = Encoder(360, 0.002)
    degree = math.pi / 180.0
    readings = [encoder.read(angle * degree)[0] / degree for angle in (-1.5, -0.5, 0.5, 1.5)]
    assert readings == pytest.approx([-2.0, -1.0, 0.0, 1.0], abs=1e-12)


def test_encoder_velocity_is_a_difference_of_counts() -> None:
    encoder = Encoder(360, 0.01)
    degree = math.pi / 180.0
    velocities = [encoder.read(angle * degree)[1] / degree for angle in (0.5, 0.9, 1.1, 4.5, 3.5)]
    assert velocities == pytest.approx([0.0, 0.0, 100.0, 300.0, -100.0], abs=1e-9)


def test_drives_delay_by_whole_samples() -> None:
    commands = [(1.0, -1.0), (2.0, -2.0), (3.0, -3.0), (4.0, -4.0)]
    for delay in range(4):
        drives = TorqueOutput(FREE._replace(delay_samples=delay))
        applied = [drives.apply(command) for command in commands]
        assert applied == [(0.0, 0.0)] * delay + commands[: 4 - delay]


@given(torque=TORQUE, quantum=st.floats(1e-3, 1.0))
def test_drives_round_to_the_nearest_step(torque: float, quantum: float) -> None:
    applied, other = TorqueOutput(FREE._replace(torque_quantum=quantum)).apply((torque, -torque))
    assert abs(applied - torque) <= 0.5 * quantum * (1.0 + 1e-9) + 1e-14
    assert applied / quantum == pytest.approx(round(applied / quantum), abs=1e-6)
    assert other == -applied


@given(torque1=TORQUE, torque2=TORQUE)
def test_drives_limit_each_motor_by_itself(torque1: float, torque2: float) -> None:
    applied = TorqueOutput(PlantSettings(torque_limit=5.0)).apply((torque1, torque2))
    assert applied == tuple(math.copysign(min(abs(torque), 5.0), torque) for torque in (torque1, torque2))


def test_the_limit_holds_after_rounding() -> None:
    drives = TorqueOutput(PlantSettings(torque_limit=1.0, torque_quantum=0.3))
    assert drives.apply((1.1, -1.1)) == (1.0, -1.0)


def test_an_infinite_torque_is_limited() -> None:
    assert TorqueOutput(PlantSettings()).apply((math.inf, -math.inf)) == (10.0, -10.0)


@pytest.mark.parametrize("command", [(math.nan, 0.0), (0.0, math.nan)])
@pytest.mark.parametrize("delay", [0, 2])
def test_a_torque_that_is_not_a_number_does_not_become_the_limit(command: tuple[float, float], delay: int) -> None:
    with pytest.raises(ValueError, match="is not a number"):
        TorqueOutput(PlantSettings(delay_samples=delay)).apply(command)
