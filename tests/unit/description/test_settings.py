# SPDX-License-Identifier: Apache-2.0
"""Settings declared once: section, node parameters and numbers for compiled code all follow the declaration."""

from __future__ import annotations

import math
from operator import attrgetter
from typing import Annotated, Any, NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_description.settings import (
    Section,
    Setting,
    as_numbers,
    from_parameters,
    keys_of,
    to_parameters,
    with_keys,
)
from fivebar_description.strict_yaml import InputError, StrictModel, validate


def ordered(bounds: tuple[float, float]) -> str | None:
    return None if bounds[0] < bounds[1] else "expected the smaller bound first"


class Settings(NamedTuple):
    """Of a component that exists in this test only."""

    gain: Annotated[float, Setting("Gain.", "1/s", at_least=0.0, at_most=100.0, tunable=True)] = 5.0
    limit: Annotated[float | None, Setting("Limit.", "Nm", above=0.0)] = None
    law: Annotated[str, Setting("Law.", choices=("first", "second"))] = "first"
    samples: Annotated[int, Setting("Delay.", "samples", at_least=0, below=10)] = 2
    enabled: Annotated[bool, Setting("Whether it works.")] = True
    bounds: Annotated[tuple[float, float] | None, Setting("Where.", "m", check=ordered)] = None


class Inner(NamedTuple):
    """A section within another."""

    share: Annotated[float, Setting("Share.", at_least=0.0, at_most=1.0)] = 0.5
    law: Annotated[str, Setting("Law.", choices=("first", "second"))] = "first"


class Outer(NamedTuple):
    """A section with another in it."""

    gain: Annotated[float, Setting("Gain.")] = 5.0
    part: Section[Inner] = Inner()


class File(StrictModel):
    """A file with two sections."""

    component: Section[Settings] = Settings()
    nested: Section[Outer] = Outer()


def read(**content: Any) -> Settings:
    return validate({"component": content}, File, "file.yaml").component


def test_a_section_fills_in_defaults_and_reads_integers_and_lists() -> None:
    assert read() == Settings()
    settings = read(gain=3, bounds=[1, 2], limit=0.5)
    assert settings == Settings(gain=3.0, bounds=(1.0, 2.0), limit=0.5)
    assert isinstance(settings.gain, float)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"gain": -1.0}, "component.gain: -1.0: expected at least 0"),
        ({"gain": 100.5}, "component.gain: 100.5: expected at most 100"),
        ({"limit": 0.0}, "component.limit: 0.0: expected above 0"),
        ({"samples": 10}, "component.samples: 10: expected below 10"),
        ({"law": "third"}, "component.law: 'third': expected one of first, second"),
        ({"bounds": [2.0, 1.0]}, r"component.bounds: \[2.0, 1.0\]: expected the smaller bound first"),
        ({"gain": math.nan}, "component.gain: nan: expected a finite number"),
        ({"gian": 1.0}, "component.gian: unknown key"),
        ({"enabled": 1}, "component.enabled: 1: expected true or false"),
    ],
)
def test_a_section_refuses_what_the_declaration_excludes(content: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=f"file.yaml: {words}"):
        read(**content)


def test_a_section_is_no_list() -> None:
    with pytest.raises(InputError, match=r"component: .* expected keys with values, found list"):
        validate({"component": [5.0]}, File, "file.yaml")


def test_a_file_is_written_with_names() -> None:
    written = File(component=Settings(bounds=(1.0, 2.0))).model_dump(mode="json")
    assert written["component"]["bounds"] == [1.0, 2.0]
    assert validate(written, File, "again") == File(component=Settings(bounds=(1.0, 2.0)))


@given(
    st.builds(
        Settings,
        gain=st.floats(0.0, 100.0),
        limit=st.none() | st.floats(1e-6, 1e6),
        law=st.sampled_from(["first", "second"]),
        samples=st.integers(0, 9),
        enabled=st.booleans(),
        bounds=st.none() | st.just((-1.0, 1.0)),
    )
)
def test_parameters_of_a_node_hold_the_same_settings(settings: Settings) -> None:
    parameters = to_parameters(settings)
    assert None not in parameters.values()
    # arrays come back from ROS as tuples
    came = {name: tuple(value) if isinstance(value, list) else value for name, value in parameters.items()}
    assert from_parameters(Settings, {**came, "of_another": 1}) == settings


def test_a_section_within_a_section_is_read_and_written_by_its_name() -> None:
    nested = validate({"nested": {"part": {"share": 0.25}}}, File, "file.yaml").nested
    assert nested == Outer(part=Inner(0.25))
    assert File(nested=nested).model_dump(mode="json")["nested"] == {
        "gain": 5.0,
        "part": {"share": 0.25, "law": "first"},
    }
    assert validate({"nested": nested._asdict()}, File, "again").nested == nested
    with pytest.raises(InputError, match=r"file.yaml: nested.part.share: 2.0: expected at most 1"):
        validate({"nested": {"part": {"share": 2.0}}}, File, "file.yaml")
    with pytest.raises(InputError, match=r"file.yaml: nested.part.shore: unknown key"):
        validate({"nested": {"part": {"shore": 0.5}}}, File, "file.yaml")


def test_keys_of_a_section_within_a_section_have_its_name_before_them() -> None:
    keys = {key.name: key for key in keys_of(File, ("nested",))}
    assert list(keys) == ["nested.gain", "nested.part.share", "nested.part.law"]
    file = File(nested=Outer(2.0, Inner(0.25, "second")))
    values = {name: key.to_parameter(attrgetter(name)(file)) for name, key in keys.items()}
    assert values == {"nested.gain": 2.0, "nested.part.share": 0.25, "nested.part.law": "second"}
    assert validate(with_keys({}, values), File, "again") == file
    assert as_numbers(file.nested) == (2.0, (0.25, 1))
