# SPDX-License-Identifier: Apache-2.0
"""The layouts for RViz, Foxglove and PlotJuggler name topics and fields that the graph has."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

import yaml

from fivebar_bringup.bag.definitions import TYPESTORE
from fivebar_description.files import share_file
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ESTIMATE_COVARIANCE,
    ESTIMATE_DISTURBANCE,
    ESTIMATE_NAMES,
    JOINT_STATES,
    JOINTS,
    PICTURES,
    REFERENCE,
    REFERENCE_NAMES,
    SUPERVISOR_NAMES,
    SUPERVISOR_STATE,
    TOPICS,
    TORQUE_COMMAND,
    TORQUE_REQUESTED,
)

TYPES = {f"/{topic.name}": topic.type for topic in (*TOPICS, *PICTURES)}
OF_OTHERS = {"/diagnostics", "/robot_description"}
"""Topics of every node, and of robot_state_publisher."""

NAMES = {
    f"/{topic.name}": names
    for topic, names in (
        (JOINT_STATES, JOINTS),
        (REFERENCE, REFERENCE_NAMES),
        (SUPERVISOR_STATE, SUPERVISOR_NAMES),
        (TORQUE_COMMAND, ACTIVE_JOINTS),
        (TORQUE_REQUESTED, ACTIVE_JOINTS),
        (ESTIMATE_COVARIANCE, ESTIMATE_NAMES),
        (ESTIMATE_DISTURBANCE, ACTIVE_JOINTS),
    )
}
"""What the fields of a JointState stand for, in order."""

FOXGLOVE = json.loads(share_file("fivebar_bringup", "foxglove", "fivebar.json").read_text(encoding="utf-8"))
PLOTJUGGLER = ElementTree.parse(share_file("fivebar_bringup", "plotjuggler", "fivebar.xml")).getroot()
PATHS = [path["value"] for panel in FOXGLOVE["configById"].values() for path in panel.get("paths", ())]
CURVES = [str(curve.get("name")) for curve in PLOTJUGGLER.iter("curve")]


def has_fields(message_type: str, fields: list[str]) -> bool:
    """Whether a message type has a field, of a field, and so on."""
    for field in fields:
        found = dict(TYPESTORE.fielddefs[message_type][1]).get(field)
        if found is None:
            return False
        message_type = str(found[1])
    return True


def panels(layout: Any) -> Iterator[str]:
    if isinstance(layout, str):
        yield layout
    else:
        yield from panels(layout["first"])
        yield from panels(layout["second"])


def is_a_path(path: str) -> bool:
    """Whether a path of Foxglove, TOPIC.FIELD, leads to a field; that of a JointState by number."""
    topic, _, rest = path.partition(".")
    if (indexed := re.fullmatch(r"(position|velocity|effort)\[(\d+)\]", rest)) is not None:
        return int(indexed[2]) < len(NAMES[topic])
    return has_fields(TYPES[topic], rest.split("."))


def test_foxglove_plots_what_there_is() -> None:
    assert len(PATHS) > 10
    assert not [path for path in PATHS if not is_a_path(path)]


def test_foxglove_shows_every_panel_and_known_topics() -> None:
    assert sorted(panels(FOXGLOVE["layout"])) == sorted(FOXGLOVE["configById"])
    named = {topic for panel in FOXGLOVE["configById"].values() for topic in panel.get("topics", ())}
    assert {f"/{topic.name}" for topic in PICTURES} <= named <= set(TYPES) | OF_OTHERS
    assert FOXGLOVE["configById"]["DiagnosticSummary!nodes"]["topicToRender"] in OF_OTHERS


def is_a_curve(curve: str) -> bool:
    """Whether a curve of PlotJuggler leads to a field; names in a JointState unfold it: TOPIC/NAME/FIELD."""
    topic = max((topic for topic in TYPES if curve.startswith(f"{topic}/")), key=len)
    words = curve.removeprefix(f"{topic}/").split("/")
    if topic in NAMES:
        name, field = words
        return name in NAMES[topic] and field in ("position", "velocity", "effort")
    return has_fields(TYPES[topic], words)


def test_plotjuggler_plots_what_there_is() -> None:
    assert len(CURVES) > 10
    assert not [curve for curve in CURVES if not is_a_curve(curve)]


def test_plotjuggler_subscribes_to_what_it_plots() -> None:
    for plugin in PLOTJUGGLER.iter("plugin"):
        topics = str(plugin.find("selected_topics").get("value")).split(";")
        assert set(topics) <= set(TYPES)
        assert all(any(curve.startswith(f"{topic}/") for topic in topics) for curve in CURVES)


def test_rviz_shows_the_robot_and_the_pictures() -> None:
    text = share_file("fivebar_bringup", "rviz", "fivebar.rviz").read_text(encoding="utf-8")
    content = yaml.safe_load(text)["Visualization Manager"]
    assert content["Global Options"]["Fixed Frame"] == "base_link"
    topics = [display["Topic"] for display in content["Displays"] if "Topic" in display]
    assert {topic["Value"] for topic in topics} == {topic.name for topic in PICTURES}
    assert all(topic["Durability Policy"] == "Transient Local" for topic in topics)
