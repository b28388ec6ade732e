"""The quality of service of the graph's topics as rclpy profiles."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from fivebar_description.interface import Qos


def qos_profile(qos: Qos, depth: int | None = None) -> QoSProfile:
    """Return the rclpy profile; `depth` overrides the history depth, which each side chooses."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth if depth is not None else qos.depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if qos.transient_local else DurabilityPolicy.VOLATILE,
    )


def best_effort(depth: int) -> QoSProfile:
    """Return the profile of who only looks on: the publishers of a topic neither wait for it nor keep anything for it.

    What is lost is not asked for again, and the newest `depth` messages are kept.
    """
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.VOLATILE,
    )
