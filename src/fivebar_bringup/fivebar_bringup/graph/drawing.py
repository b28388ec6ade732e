# SPDX-License-Identifier: Apache-2.0
"""The graph of a run as an SVG: a row for each node, a column for each topic, from its publishers to who hears it."""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import escape

from fivebar_bringup.graph.node_spec import NodeSpec
from fivebar_description.interface import Topic

ROW, COLUMN = 34, 26
"""Distances (px) of rows and of columns."""

CHARACTER = 6.6
"""Width (px) of a character of the labels."""

SLOPE = 0.87
"""Height of a label over its length: names of topics stand at 60 degrees."""

STYLE = """
svg { background: #fff; font: 11px ui-monospace, monospace; --ink: #1a1a1a; --line: #b8b8b8; --chain: #0b62a4; }
@media (prefers-color-scheme: dark) { svg { background: #161616; --ink: #eee; --line: #555; --chain: #6db3f2; } }
text { fill: var(--ink); } rect { fill: none; stroke: var(--line); } line { stroke: var(--line); }
.chain { --line: var(--chain); } circle, path { fill: var(--ink); } .chain circle, .chain path { fill: var(--chain); }
"""


def graph_svg(nodes: Sequence[NodeSpec], title: str) -> str:
    """Return a drawing of nodes and topics; the control chain has a colour of its own.

    A topic is a vertical line: a dot marks each publisher, a triangle each subscriber.
    """
    topics = _topics(nodes)
    left = round(max(len(node.executable) for node in nodes) * CHARACTER) + 32
    label = max(len(topic.name) for topic in topics) * CHARACTER
    top = round(label * SLOPE) + 50
    width, height = left + COLUMN * len(topics) + round(label / 2) + 20, top + ROW * len(nodes) + 34
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">',
        f"<title>{escape(title)}</title>",
        f"<style>{STYLE}</style>",
        f'<text x="10" y="20">{escape(title)}</text>',
        *(_row(node, top + ROW * at, left, left + COLUMN * len(topics)) for at, node in enumerate(nodes)),
        *(_column(topic, nodes, left + COLUMN * at + 16, top) for at, topic in enumerate(topics)),
        f'<g><circle cx="16" cy="{height - 14}" r="4"/><text x="26" y="{height - 10}">publishes</text>',
        f'<path d="M 112 {height - 18} l 8 4 l -8 4 z"/><text x="126" y="{height - 10}">subscribes</text></g>',
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def _topics(nodes: Sequence[NodeSpec]) -> list[Topic]:
    """Return all topics, those of the control chain first, each in the order in which nodes publish or hear them."""
    named = {topic.name: topic for node in nodes for topic in (*node.publishes, *node.subscribes)}
    return sorted(named.values(), key=lambda topic: not topic.one_publisher)


def _row(node: NodeSpec, y: int, left: int, right: int) -> str:
    kind = ' class="chain"' if node.in_chain else ""
    return (
        f"<g{kind}><title>{escape(f'{node.package} {node.executable}')}</title>"
        f'<line x1="{left}" y1="{y}" x2="{right}" y2="{y}" stroke-dasharray="1 4"/>'
        f'<rect x="8" y="{y - 12}" width="{left - 8}" height="24" rx="4"/>'
        f'<text x="18" y="{y + 4}">{escape(node.executable)}</text></g>'
    )


def _column(topic: Topic, nodes: Sequence[NodeSpec], x: int, top: int) -> str:
    publishers = [at for at, node in enumerate(nodes) if topic.name in {sent.name for sent in node.publishes}]
    subscribers = [at for at, node in enumerate(nodes) if topic.name in {heard.name for heard in node.subscribes}]
    rows = [top + ROW * at for at in (*publishers, *subscribers)]
    marks = [f'<circle cx="{x}" cy="{top + ROW * at}" r="4"/>' for at in publishers]
    # beside the line, where a node hears what it publishes itself
    marks += [f'<path d="M {x + 1} {top + ROW * at - 4} l 8 4 l -8 4 z"/>' for at in subscribers]
    kind = ' class="chain"' if topic.one_publisher else ""
    return (
        f"<g{kind}><title>{escape(f'{topic.name} {topic.type}')}</title>"
        f'<line x1="{x}" y1="{top - 22}" x2="{x}" y2="{max(rows)}"/>{"".join(marks)}'
        f'<text transform="translate({x + 3} {top - 26}) rotate(-60)">{escape(topic.name)}</text></g>'
    )
