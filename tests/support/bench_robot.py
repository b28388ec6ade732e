# SPDX-License-Identifier: Apache-2.0
"""A small five-bar like the bench's, and files of its emulated board."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.robot_file import load_robot

ROBOT = {
    "name": "bench",
    "lengths_m": {"a": 0.1, "l_11": 0.06, "l_12": 0.1, "l_21": 0.06, "l_22": 0.1},
    "inertias_kg_m2": {"zz_11R": 2.95e-5, "zz_21R": 2.85e-5},
    "mass_kg": {"m": 0.0095},
    "friction": {"f_s11": 0.004, "f_s21": 0.004, "f_off11": 0.0, "f_off21": 0.0, "width_rad_s": 0.2},
}


def robot_file(folder: Path) -> Path:
    path = folder / "bench.yaml"
    path.write_text(yaml.safe_dump(ROBOT))
    return path


def posture(folder: Path, x: float = 0.0, y: float = 0.12) -> tuple[float, float, float, float]:
    """The joints q11, q12, q21, q22 with the elbows outwards."""
    robot = load_robot(str(robot_file(folder)))
    return tuple(inverse_geometry(robot, (1, -1), x, y))


def emulation_content(folder: Path, **changes: Any) -> dict[str, Any]:
    return {
        "name": "emulated bench",
        "port": str(folder / "board"),
        "robot": str(robot_file(folder)),
        "initial_joints": list(posture(folder)),
        **changes,
    }


def board_content(folder: Path, **changes: Any) -> dict[str, Any]:
    """The bridge's file; slow enough for a machine that has other work to do."""
    q11, _, q21, _ = posture(folder)
    return {
        "name": "bench",
        "port": str(folder / "board"),
        "period_us": 10_000,
        "watchdog_ms": 1_000,
        "gather_deadline_us": 9_000,
        "missing_limit": 50,
        "posture": {"q11": q11, "q21": q21},
        "motors": {"q11": {"torque_limit_nm": 0.12}, "q21": {"torque_limit_nm": 0.12}},
        **changes,
    }
