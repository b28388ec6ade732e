# SPDX-License-Identifier: Apache-2.0
"""Cogging that a robot file knows: in the torque of the laws and in the estimator's motion, and nowhere by default."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import yaml

from fivebar_control.estimation.platform_motion import Applied, platform_acceleration
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.state import Platform
from fivebar_description.files import share_file
from fivebar_description.parameters import FiveBar, friction_torque, lost_torque, without_cogging
from fivebar_description.robot_file import load_robot
from fivebar_description.strict_yaml import InputError

PLACE = (0.01, 0.11)
HARMONICS = [{"periods": 12, "cosine": 1e-3, "sine": -2e-3}, {"periods": 84, "cosine": 0.0, "sine": 5e-4}]


def robot_with(folder: Path, harmonics: list[dict[str, float]]) -> FiveBar:
    content = yaml.safe_load(share_file("fivebar_description", "config", "motkin.yaml").read_text(encoding="utf-8"))
    file = folder / "cogging.yaml"
    file.write_text(yaml.safe_dump(content | {"cogging": {"q11": harmonics}}), encoding="utf-8")
    return load_robot(str(file))


def test_the_laws_compensate_what_the_file_says(tmp_path: Path) -> None:
    robot, plain = robot_with(tmp_path, HARMONICS), load_robot("motkin")
    q11, _, q21, _ = inverse_geometry(robot, (1, -1), *PLACE)
    cogging = 1e-3 * math.cos(12 * q11) - 2e-3 * math.sin(12 * q11) + 5e-4 * math.sin(84 * q11)
    platform = Platform(*PLACE, 0.1, -0.2, 0.3, 0.4)
    found, without = (reference_from_platform(one, (1, -1), platform) for one in (robot, plain))
    assert found.f1 - without.f1 == pytest.approx(cogging, abs=1e-12)
    assert found.f2 == without.f2
    # the estimator expects the motion that the torque less its cogging makes
    expected = platform_acceleration(plain, (1, -1), *PLACE, 0.1, -0.2, Applied(0.01, 0.0, 0.0, 0.0))
    applied = Applied(0.01 + cogging, 0.0, 0.0, 0.0)
    assert platform_acceleration(robot, (1, -1), *PLACE, 0.1, -0.2, applied) == pytest.approx(expected)
    assert lost_torque(robot, robot.leg2, q21, 0.3) == friction_torque(robot.leg2, 0.3)
    assert without_cogging(robot) == plain


def test_more_harmonics_than_are_compensated_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"cogging\.q11"):
        robot_with(tmp_path, [*HARMONICS, {"periods": 1, "cosine": 0.0, "sine": 0.0}])
