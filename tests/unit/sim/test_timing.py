# SPDX-License-Identifier: Apache-2.0
"""Commands that are late and readings that are old by a part of a sample."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.parameters import FiveBar
from fivebar_description.strict_yaml import InputError
from fivebar_sim.effects.settings import MUJOCO, PINOCCHIO, PlantSettings, has_effects
from fivebar_sim.effects.timing import Timing, delays_of, drawn, moments_after
from fivebar_sim.plant import Plant

RATE = 500
PERIOD = 1.0 / RATE
TORQUES = [(0.6, -0.5), (-0.4, 0.5), (0.8, 0.2), (0.3, -0.7), (0.3, -0.7)]


def plant(robot: FiveBar, rate_hz: int = RATE, **settings: Any) -> Plant:
    home = tuple(inverse_geometry(robot, (1, -1), 0.0, 0.13))
    # with a wide tanh, whose steps are long in either grid
    smooth = FiveBar(robot.leg1._replace(width=0.5), robot.leg2._replace(width=0.5), robot.mass)
    return Plant(smooth, home, rate_hz, PlantSettings(**settings))


@pytest.mark.parametrize("engine", [PINOCCHIO, MUJOCO])
@pytest.mark.parametrize("extra", [{}, {"motors": {"current_loop_hz": 100.0}}], ids=["", "current loop"])
def test_a_delay_is_that_of_a_robot_sampled_more_often(engine: str, extra: Any, dextar: FiveBar) -> None:
    """A quarter late, and read half a sample early: the same robot at four times the rate, told so sample by sample."""
    effects = {name: PlantSettings._field_defaults[name]._replace(**values) for name, values in extra.items()}
    late = plant(dextar, engine=engine, timing=Timing(command_delay=0.25 * PERIOD, reading_age=0.5 * PERIOD), **effects)
    often = plant(dextar, 4 * RATE, engine=engine, timing=Timing(command_delay=1e-12), **effects)
    held = (0.0, 0.0)
    for torque in TORQUES:
        late.advance(torque)
        for quarter in range(4):
            often.advance(held if quarter == 0 else torque)
            if quarter == 1:
                read = often.truth()
        held = torque
        np.testing.assert_allclose(late.measure().position, read.position, rtol=0.0, atol=1e-7)
        np.testing.assert_allclose(late.measure().velocity, read.velocity, rtol=0.0, atol=1e-5)
        np.testing.assert_allclose(late.truth().position, often.truth().position, rtol=0.0, atol=1e-7)
    assert np.abs(np.subtract(late.truth().position, late.measure().position)).max() > 1e-4


def test_a_whole_sample_late_is_one_of_delay(dextar: FiveBar) -> None:
    late = plant(dextar, timing=Timing(command_delay=PERIOD, reading_age=PERIOD))
    delayed = plant(dextar, timing=Timing(command_delay=1e-12), delay_samples=1)
    for torque in TORQUES:
        before = delayed.truth()
        late.advance(torque)
        delayed.advance(torque)
        np.testing.assert_allclose(late.truth().position, delayed.truth().position, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(late.measure().position, before.position, rtol=0.0, atol=1e-12)


def test_jitter_is_uniform_without_memory_and_follows_the_seed() -> None:
    timing = Timing(2e-4, 1e-3, 1e-4, 8e-4)
    delays = delays_of(timing, 3, PERIOD)
    moments = np.array([moments_after(delays, number, PERIOD) for number in range(20_000)])
    shares = (moments - (2e-4, PERIOD - 1e-4)) / (1e-3, -8e-4)
    assert shares.min() >= 0.0 and shares.max() < 1.0
    for share in shares.T:
        np.testing.assert_allclose(np.histogram(share, 10, (0.0, 1.0))[0], 2000.0, rtol=0.1)
    for lag in (1, 2, 7):
        assert abs(np.corrcoef(shares[lag:, 0], shares[:-lag, 0])[0, 1]) < 0.03
    assert abs(np.corrcoef(shares.T)[0, 1]) < 0.03
    assert drawn(5, 3) != drawn(6, 3)
    assert delays_of(timing, 3, PERIOD) == delays != delays_of(timing, 4, PERIOD)


def test_nothing_is_late_by_default() -> None:
    assert not has_effects(PlantSettings(timing=Timing()))
    assert moments_after(delays_of(Timing(), 0, PERIOD), 7, PERIOD) == (0.0, PERIOD)


@pytest.mark.parametrize(
    ("timing", "words"),
    [
        (
            Timing(command_delay=1e-3, command_jitter=1.1e-3),
            "plant.timing.command_delay: 0.0021 s with its jitter: exp",
        ),
        (Timing(reading_age=3e-3), "plant.timing.reading_age: 0.003 s with its jitter: expected at most a sample, 0.0"),
    ],
)
def test_more_than_a_sample_is_refused(timing: Timing, words: str, dextar: FiveBar) -> None:
    with pytest.raises(InputError, match=words):
        plant(dextar, timing=timing)
