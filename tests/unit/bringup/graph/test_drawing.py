# SPDX-License-Identifier: Apache-2.0
"""The drawing of a graph: every node and topic once, a mark for each publisher and each subscriber."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from fivebar_bringup.graph.crossing_graph import crossing_graph
from fivebar_bringup.graph.drawing import graph_svg
from fivebar_bringup.graph.node_spec import Mode
from fivebar_bringup.scenarios.scenario_files import load_scenario

SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.parametrize("name", ["middle", "middle_encoders"])
def test_the_drawing_has_every_node_topic_publisher_and_subscriber(name: str) -> None:
    nodes = crossing_graph(load_scenario(name), Mode.LOCKSTEP, Path("bag"))
    drawing = ElementTree.fromstring(graph_svg(nodes, f"<{name}>"))
    groups = {group.findtext(f"{SVG}title"): group for group in drawing.findall(f"{SVG}g")}
    assert drawing.findtext(f"{SVG}title") == f"<{name}>"
    assert {f"{node.package} {node.executable}" for node in nodes} <= set(groups)
    topics = {topic.name: topic for node in nodes for topic in (*node.publishes, *node.subscribes)}
    right, bottom = (float(drawing.attrib[side]) for side in ("width", "height"))
    for topic in topics.values():
        group = groups[f"{topic.name} {topic.type}"]
        assert len(group.findall(f"{SVG}circle")) == sum(topic in node.publishes for node in nodes), topic.name
        assert len(group.findall(f"{SVG}path")) == sum(topic in node.subscribes for node in nodes), topic.name
        for mark in group.findall(f"{SVG}circle"):
            assert 0.0 < float(mark.attrib["cx"]) < right and 0.0 < float(mark.attrib["cy"]) < bottom
