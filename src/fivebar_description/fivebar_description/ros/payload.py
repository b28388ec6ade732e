"""The payload, as received by the nodes that model the robot."""

from __future__ import annotations

from collections.abc import Callable

from std_msgs.msg import Float64

from fivebar_description.interface import PAYLOAD
from fivebar_description.parameters import MOST_PAYLOAD
from fivebar_description.ros.node import GraphNode


def listen_to_payload(node: GraphNode, carry: Callable[[float], None]) -> None:
    """Have `carry` called with each payload (kg) of the platform from then on; a run needs no publisher of it."""

    def on_message(message: Float64) -> None:
        if not 0.0 <= message.data <= MOST_PAYLOAD:
            node.drop(PAYLOAD, f"{message.data} kg, expected 0 to {MOST_PAYLOAD:g} kg")
            return
        carry(message.data)

    node.listen(PAYLOAD, on_message, awaited=False)
