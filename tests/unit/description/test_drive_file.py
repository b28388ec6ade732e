# SPDX-License-Identifier: Apache-2.0
"""The keys that the bridge's file and that of the emulated drives share are read alike."""

from __future__ import annotations

from typing import Any

import pytest

from fivebar_control.hardware.configuration import Drive
from fivebar_description.strict_yaml import InputError, StrictModel, validate
from fivebar_sim.drives.configuration import DriveFacts

MOTOR = {"node_id": 1, "counts_per_revolution": 8192, "rated_torque_nm": 1.0, "velocity_units_per_rev_s": 60.0}
FILES: list[tuple[type[StrictModel], dict[str, Any]]] = [
    (Drive, {"torque_limit_nm": 1.0}),
    (DriveFacts, {"vendor": 1, "product": 2}),
]


@pytest.mark.parametrize(("model", "own"), FILES)
@pytest.mark.parametrize(
    ("key", "good", "bad"),
    [
        ("node_id", 127, 128),
        ("counts_per_revolution", 1, 0),
        ("gear_ratio", 0.5, 0.0),
        ("sign", -1, 0),
        ("home_offset_rad", -100.0, 100.1),
        ("rated_torque_nm", 2.0, -1.0),
        ("velocity_units_per_rev_s", 1.0, 0.0),
    ],
)
def test_both_files_take_and_refuse_the_same(
    model: type[StrictModel], own: dict[str, Any], key: str, good: float, bad: float
) -> None:
    assert getattr(validate({**MOTOR, **own, key: good}, model, "file.yaml"), key) == good
    with pytest.raises(InputError, match=f"file.yaml: {key}: "):
        validate({**MOTOR, **own, key: bad}, model, "file.yaml")
