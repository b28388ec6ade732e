"""Settings of the bag recorder."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_description.interface import TOPICS
from fivebar_description.settings import Setting
from fivebar_description.shared_settings import AwaitedNodes

ALL_TOPICS = tuple(topic.name for topic in TOPICS)


class RecorderSettings(NamedTuple):
    """The bag recorder."""

    directory: Annotated[str, Setting("Directory of the bag; it must not exist yet.")] = "bag"
    topics: Annotated[tuple[str, ...], Setting("Topics of the graph to record.")] = ALL_TOPICS
    wait_for_nodes: AwaitedNodes = ()
