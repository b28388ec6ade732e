# SPDX-License-Identifier: Apache-2.0
"""Settings of the laws that follow from a robot: the torque of its crossings and its bandwidth scale the defaults."""

from __future__ import annotations

import pytest

from fivebar_control.laws.gains import UnifiedSettings
from fivebar_control.laws.lqr import LqrSettings
from fivebar_control.laws.mpc import MpcSettings
from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.laws.robot_sizes import DEXTAR_CROSSING, law_sizes, torque_ratio, tuning_for
from fivebar_description.known_drives import KnownDrives
from fivebar_description.robot_file import RobotFile, read_robot
from fivebar_description.tuning import Tuning

USUAL = UnifiedSettings()


def robot(crossing_torque: float | None = None, bandwidth: float | None = None) -> RobotFile:
    drives, tuning = KnownDrives(crossing_torque=crossing_torque), Tuning(bandwidth=bandwidth)
    return read_robot("dextar").model_copy(update={"drives": drives, "tuning": tuning})


def test_a_robot_that_says_nothing_has_the_defaults() -> None:
    assert law_sizes(robot()) == {"unified": {}, "path": {}, "mpc": {}, "lqr": {}}
    assert default_tuning(CONTROLLERS["unified"], robot()).nominal.settings == USUAL


def test_a_tenth_of_the_torque_is_saved_for_the_same_error_of_acceleration() -> None:
    """The weight times the torque squared stays, and a disturbance counts as much in parts of the torque."""
    sizes = law_sizes(robot(crossing_torque=0.1 * DEXTAR_CROSSING))
    weight, limit = 100.0 * USUAL.weight, 0.1 * USUAL.disturbance_limit
    mpc, lqr = MpcSettings(), LqrSettings()
    assert sizes["unified"] == pytest.approx({"weight": weight, "disturbance_limit": limit}, rel=1e-12)
    weights = {"weight": 100.0 * mpc.weight, "step_weight": 100.0 * mpc.step_weight}
    expected = {"fallback_weight": weight, "disturbance_limit": limit, **weights}
    assert sizes["mpc"] == pytest.approx(expected, rel=1e-12)
    assert sizes["lqr"] == pytest.approx({"fallback_weight": weight, "weight": 100.0 * lqr.weight}, rel=1e-12)


@pytest.mark.parametrize(
    ("drives", "expected"),
    [
        (KnownDrives(torque_limit=4.0), 2.0 / DEXTAR_CROSSING),
        # the crossing of DexTAR takes as much, however weak its drives are
        (KnownDrives(torque_limit=0.1), 1.0),
        (KnownDrives(torque_limit=4.0, crossing_torque=0.1), 0.1 / DEXTAR_CROSSING),
    ],
)
def test_limit_and_inertia_stand_for_the_torque_of_a_crossing_that_the_file_does_not_give(
    drives: KnownDrives, expected: float
) -> None:
    file = read_robot("dextar").model_copy(update={"drives": drives})
    assert torque_ratio(file) == pytest.approx(expected, rel=1e-3)


def test_the_gains_are_those_of_a_double_pole_at_the_bandwidth_and_the_observer_goes_with_them() -> None:
    sizes = law_sizes(robot(bandwidth=120.0))
    rate = USUAL.observer_rate * 14_400.0 / USUAL.kp
    assert sizes["unified"] == pytest.approx({"kp": 14_400.0, "kd": 240.0, "observer_rate": rate}, rel=1e-12)
    assert sizes["mpc"] == sizes["lqr"] == {"fallback_kp": 14_400.0, "fallback_kd": 240.0}
    for name in ("unified", "mpc", "lqr"):
        tuned = default_tuning(CONTROLLERS[name], robot(0.035, 120.0)).nominal.settings
        assert law_sizes(robot(0.035, 120.0))[name].items() <= tuned._asdict().items()  # type: ignore[attr-defined]


def test_the_tuning_is_lowered_and_never_raised() -> None:
    dextar, motkin = read_robot("dextar"), read_robot("motkin")
    assert tuning_for(dextar, 60.0) == Tuning(bandwidth=37.7, disturbance_rate=0.1)
    assert tuning_for(dextar, 128.0) == dextar.tuning
    lowered = tuning_for(motkin, 100.0)
    assert lowered.bandwidth == 62.8
    assert lowered.disturbance_rate == pytest.approx(0.1 * 0.035 / 0.55)
    assert lowered.acceleration_noise == motkin.tuning.acceleration_noise
    assert tuning_for(motkin, 200.0) == motkin.tuning
