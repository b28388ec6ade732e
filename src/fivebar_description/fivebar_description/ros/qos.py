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
