# SPDX-License-Identifier: Apache-2.0
"""Settings of the scene."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting


class SceneSettings(NamedTuple):
    """The pictures of a run."""

    frame_id: Annotated[str, Setting("Frame of all markers; empty for base_link, in a namespace NAME/base_link.")] = ""
    pictures_per_second: Annotated[
        float, Setting("Most pictures per second, of the run and of the clock.", "Hz", at_least=0.1, at_most=200.0)
    ] = 30.0
    trail_points: Annotated[
        int, Setting("Points of the trail of the platform, the oldest of which go first.", at_least=2, at_most=100_000)
    ] = 500
    torque_turn: Annotated[
        float, Setting("Arc that a motor torque is drawn as.", "rad/Nm", at_least=0.0, at_most=100.0)
    ] = 1.5
    force_length: Annotated[
        float, Setting("Length of the arrow that a force is drawn as.", "m/N", at_least=0.0, at_most=10.0)
    ] = 0.01
