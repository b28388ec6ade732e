# SPDX-License-Identifier: Apache-2.0
"""A parameter that was set under a name that no node has."""

from __future__ import annotations

import pytest

from fivebar_description.parameter_names import meant_by

KNOWN = {"zone.rule", "zone.epsilon", "gains.kp", "gains.kp_vhc", "plant.delay_samples", "controller", "waypoints"}


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("zone_epsilon", ["zone.epsilon"]),
        ("zone.epsilom", ["zone.epsilon"]),
        ("kp", ["gains.kp"]),
        ("candidates", ["controller"]),
        ("homing", ["waypoints"]),
        ("delay_samples", ["plant.delay_samples"]),
        ("waypoint", ["waypoints"]),
        ("goal_law_kp", ["gains.kp"]),
        ("goal_estimator_delay_samples", ["plant.delay_samples"]),
        ("goal_load_push", []),
        ("contoler", ["controller"]),
        # those of other nodes
        ("ekf.gyro_noise", []),
        ("ekf.epsilon", []),
        ("zone.duration_ms", []),
        ("segment_duration", []),
        ("segment_durations", []),
        ("use_sim_time", []),
        ("speed_of_the_conveyor", []),
    ],
)
def test_a_slip_or_a_former_name_is_told_from_a_parameter_of_another_node(name: str, meant: list[str]) -> None:
    assert meant_by(name, KNOWN) == meant
