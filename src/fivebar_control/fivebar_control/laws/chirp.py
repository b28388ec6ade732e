# SPDX-License-Identifier: Apache-2.0
"""An excitation for `fivebar identify --resonance`: holds the motors softly and adds a chirp to their torques.

The first sweep turns both motors the same way, the next against each other, and so on, so that a recording tells what
each motor's torque does to either motor. With `fall` the second pair of sweeps has a smaller amplitude, which tells
play from elasticity. It is a law "from elsewhere", so that scenarios name it by its module:
`controller: fivebar_control.laws.chirp:LAW`.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_control.laws.gains import KD, KP
from fivebar_control.laws.law import Instant, Law
from fivebar_control.laws.torque import Torque
from fivebar_control.model.geometry import wrap
from fivebar_description.parameters import FiveBar
from fivebar_description.settings import Setting

HIGHEST = 0.4
"""Highest frequency as a share of the sampling rate: a held torque has little left of its sine beyond, and its
images come close."""


class ChirpSettings(NamedTuple):
    """Settings of the excitation."""

    amplitude: Annotated[
        float,
        Setting("Amplitude of the chirp; well above Coulomb friction, below the drives' limit.", "Nm", at_least=0.0),
    ] = 1.0
    from_hz: Annotated[float, Setting("Frequency at which a sweep begins.", "Hz", at_least=0.1, at_most=1e4)] = 5.0
    to_hz: Annotated[
        float,
        Setting("Frequency at which a sweep ends, at most 0.4 of the sampling rate.", "Hz", at_least=0.1, at_most=1e4),
    ] = 200.0
    sweep: Annotated[float, Setting("Duration of a sweep.", "s", at_least=0.1, at_most=1e3)] = 5.0
    fall: Annotated[
        float,
        Setting(
            "Amplitude of every second pair of sweeps over that of the others: play shows by it. 1 for none.",
            "1",
            at_least=0.1,
            at_most=1.0,
        ),
    ] = 1.0
    kp: Annotated[float, KP] = 100.0
    kd: Annotated[float, KD] = 20.0


class ChirpMemory(NamedTuple):
    """Samples since the start."""

    samples: int


def chirp(settings: ChirpSettings, time: float, highest: float) -> tuple[float, float]:
    """Return the torques (Nm) of the chirp at a time (s); `highest` is the highest frequency (Hz) that it reaches."""
    number = math.floor(time / settings.sweep)
    since = time - number * settings.sweep
    end = min(settings.to_hz, highest)
    slope = (end - settings.from_hz) / settings.sweep
    amplitude = settings.amplitude * (settings.fall if number // 2 % 2 else 1.0)
    wave = amplitude * math.sin(2.0 * math.pi * (settings.from_hz + 0.5 * slope * since) * since)
    return wave, (wave if number % 2 == 0 else -wave)


def chirp_step(
    robot: FiveBar, instant: Instant, memory: ChirpMemory, settings: ChirpSettings
) -> tuple[Torque, ChirpMemory]:
    """Return the torque for a sample: it needs the motors' angles only, on which it has little stiffness."""
    state, desired = instant.state, instant.reference.state
    wave1, wave2 = chirp(settings, memory.samples * instant.period, HIGHEST / instant.period)
    kp, kd = settings.kp, settings.kd
    hold1 = kp * wrap(desired.leg1.q1 - state.leg1.q1) + kd * (desired.leg1.dq1 - state.leg1.dq1)
    hold2 = kp * wrap(desired.leg2.q1 - state.leg2.q1) + kd * (desired.leg2.dq1 - state.leg2.dq1)
    torque = Torque(
        robot.leg1.inertia * hold1 + instant.reference.f1 + wave1,
        robot.leg2.inertia * hold2 + instant.reference.f2 + wave2,
    )
    return torque, ChirpMemory(memory.samples + 1)


LAW = Law(
    name="chirp",
    title="chirp for the resonance",
    settings=ChirpSettings,
    step=chirp_step,
    memory=ChirpMemory(0),
)
