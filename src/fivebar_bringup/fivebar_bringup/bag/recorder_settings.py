# SPDX-License-Identifier: Apache-2.0
"""Settings of the bag recorder."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_description.interface import RECORDED_BESIDES, TOPICS
from fivebar_description.settings import Setting
from fivebar_description.shared_settings import AwaitedNodes

ALL_TOPICS = tuple(topic.name for topic in (*TOPICS, *RECORDED_BESIDES))


class RecorderSettings(NamedTuple):
    """The bag recorder."""

    directory: Annotated[
        str, Setting("Directory of the bag; where it is a bag already, the next one with a number: bag-2.")
    ] = "bag"
    topics: Annotated[tuple[str, ...], Setting("Topics of the graph to record.")] = ALL_TOPICS
    wait_for_nodes: AwaitedNodes = ()
    simulated_time: Annotated[
        bool,
        Setting(
            "Log messages at the times of the run's samples, for lockstep, where time is simulated; else by the"
            " system's clock."
        ),
    ] = False
