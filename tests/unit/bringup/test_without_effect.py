# SPDX-License-Identifier: Apache-2.0
"""What a scenario says without any effect is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.scenarios.without_effect import SWITCHED
from fivebar_control.laws.registry import CONTROLLERS
from fivebar_control.scenario.law_settings import SECTIONS, keys_of_laws
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.errors import InputError
from fivebar_description.scenario_file import shipped_scenarios
from fivebar_description.settings import with_keys
from fivebar_description.strict_yaml import yaml_text

WAYPOINTS = [[0.0, 0.15], [0.0, 0.02], [0.0, 0.15]]

VALUES = {"vhc_resolution": "min_norm", "adaptive_gain": {"alpha": 1.5}, "unified": {"kp": 2500.0}}


def written(folder: Path, **keys: Any) -> str:
    path = folder / "mine.yaml"
    path.write_text(yaml_text({"name": "mine", "waypoints": WAYPOINTS, **keys}), encoding="utf-8")
    return str(path)


def refusal(folder: Path, **keys: Any) -> str:
    path = written(folder, **keys)
    with pytest.raises(InputError) as refused:
        load_scenario(path)
    return str(refused.value).removeprefix(f"{path}: ")


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_a_setting_of_another_law_is_refused_with_those_of_its_own(tmp_path: Path, controller: str) -> None:
    own = keys_of_laws(CONTROLLERS[controller])
    for key in {key for keys in SECTIONS.values() for key in keys}:
        given = with_keys({"controller": controller}, {key: VALUES.get(key, 2500.0)})
        if key in own:
            continue
        words = refusal(tmp_path, **given)
        # a default, too, that the file says
        assert words.startswith(key) and f"does not apply to `{controller}`; use `{own[0]}" in words


def test_the_section_law_is_refused_with_the_section_to_use(tmp_path: Path) -> None:
    words = refusal(tmp_path, controller="unified", law={"kp": 1.0})
    assert words == "`law:` does not apply to `unified`; use `unified:`"


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"ekf": {"play": 0.01}}, "ekf.play: has no effect without an estimator; use it with `estimator: ekf`"),
        ({"zone": {"epsilon": 0.1}}, "use it with `zone.rule: fixed`"),
        ({"zone": {"rule": "fixed", "duration_ms": 30.0}}, "use `zone.epsilon`"),
        (
            {"controller": "unified", "zone": {"supervision": "sigmoid"}},
            "zone.supervision: does not apply to `unified`",
        ),
        ({"safety": {"stop_cycles": 4, "stop_time_ms": 8.0}}, "beside `safety.stop_cycles`"),
        ({"waypoints": WAYPOINTS[:2], "blend_radius": 0.01}, "add one to `waypoints`"),
        ({"camera": {"z": 0.7}}, "camera.z: has no effect while `camera.on` is off"),
        ({"safety": {"brake": False, "brake_duration": 0.5}}, "while `safety.brake` is off"),
        ({"plant": {"friction": {"stribeck_speed": 0.2}}}, "while `plant.friction.stribeck` is off"),
        (
            {"plant": {"encoders": {"slip_time": 1.0}}},
            "while `plant.encoders.slip_1` or `plant.encoders.slip_2` is off",
        ),
        ({"plant": {"transmission": {"rotor_share": 0.5}}}, "while `plant.transmission.frequency` is off"),
    ],
)
def test_a_key_that_a_choice_leaves_without_effect_is_refused(tmp_path: Path, keys: dict[str, Any], words: str) -> None:
    assert words in refusal(tmp_path, **keys)


def test_a_key_of_what_is_on_is_read(tmp_path: Path) -> None:
    path = written(tmp_path, plant={"friction": {"stribeck": 1.2, "stribeck_speed": 0.2}}, zone={"duration_ms": 30.0})
    assert load_scenario(path).plant.friction[:2] == (1.2, 0.2)


def test_the_switches_are_keys_of_their_sections() -> None:
    scenario: Any = load_scenario("middle")
    for name, switched in SWITCHED.items():
        section = scenario
        for part in name.split("."):
            section = getattr(section, part)
        starts = switched if isinstance(switched, dict) else {"": switched}
        for start, switches in starts.items():
            assert any(field.startswith(start) for field in section._fields)
            assert set(switches) <= set(section._fields)
            assert not any(
                getattr(type(section)(), one) for one in switches if one not in ("stribeck", "brake", "request_ratio")
            )


@pytest.mark.parametrize("name", shipped_scenarios())
def test_what_a_run_writes_is_read_again(tmp_path: Path, name: str) -> None:
    scenario = load_scenario(name)
    path = tmp_path / "scenario.yaml"
    path.write_text(scenario.to_yaml(), encoding="utf-8")
    assert load_scenario(str(path)).model_dump() == scenario.model_dump()


def test_the_keys_of_laws_are_those_of_a_scenario() -> None:
    for key in (key for keys in SECTIONS.values() for key in keys):
        assert key.partition(".")[0] in ControlScenario.model_fields
