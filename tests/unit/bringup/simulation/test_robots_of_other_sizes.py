# SPDX-License-Identifier: Apache-2.0
"""A robot's own settings follow from its file: one that is heavier and stronger by a factor moves in the same way."""

from __future__ import annotations

from pathlib import Path

import pytest

import fivebar

ROBOT = """
name: scaled
lengths_m: {{a: 0.10, l_11: 0.10, l_12: 0.12, l_21: 0.10, l_22: 0.12}}
inertias_kg_m2: {{zz_11R: {inertia}, zz_21R: {inertia}}}
mass_kg: {{m: {mass}}}
friction: {{f_s11: {friction}, f_s21: {friction}, f_off11: 0.0, f_off21: 0.0, width_rad_s: 0.02}}
drives: {{torque_limit: {torque}, joint_speed_limit: 30.0, encoder_counts: 20000}}
home_m: [0.0, 0.19]
"""


def crossed(path: Path, controller: str, factor: float) -> tuple[float, float, float]:
    """Return duration (s), largest error (m) and largest torque (Nm, over the factor) of a crossing."""
    scaled = {"inertia": 0.004, "mass": 0.15, "friction": 0.05, "torque": 0.8}
    path.write_text(ROBOT.format(**{name: factor * value for name, value in scaled.items()}))
    robot = fivebar.load_robot(path)
    motion = fivebar.plan(robot, goal=(0.0, 0.05), assembly_mode="-", controller=controller, rate_hz=250)
    assert motion.crossings == 1
    summary = fivebar.simulate(motion).summary
    assert summary.outcome == "succeeded"
    return motion.duration, summary.tracking_error_peak_m, max(summary.torque_peak_nm) / factor


@pytest.mark.parametrize(
    "controller", ["unified", *(pytest.param(name, marks=pytest.mark.extra) for name in ("mpc", "lqr"))]
)
def test_a_heavier_and_stronger_robot_crosses_in_the_same_way(controller: str, tmp_path: Path) -> None:
    """By a power of two, which floating-point numbers carry exactly, so that the two runs hardly differ."""
    usual = crossed(tmp_path / "scaled.yaml", controller, 1.0)
    assert usual[1] < 1e-3
    assert crossed(tmp_path / "scaled.yaml", controller, 2.0**8) == pytest.approx(usual, rel=1e-6)
