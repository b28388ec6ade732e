"""Publishes the torque of the law that needs no switching."""

from __future__ import annotations

import math
from typing import Any

from fivebar_control.laws.laws import Law, UnifiedLaw
from fivebar_control.laws.unified import UnifiedSettings
from fivebar_control.ros.controller_node import CandidateNode, gain_specs
from fivebar_description.interface import UNIFIED_TORQUE
from fivebar_description.ros.parameters import Spec
from fivebar_description.ros.run import run_node

SPECS = (
    *gain_specs(UnifiedSettings().kp, UnifiedSettings().kd),
    Spec(
        "weight",
        UnifiedSettings().weight,
        "Price of torque beyond friction: what lets go of the direction in which nothing can be asked.",
        "(m/s^2 / Nm)^2",
        1e-6,
        1e6,
        tunable=True,
    ),
    Spec(
        "observer_rate",
        UnifiedSettings().observer_rate,
        "How fast the estimate of the disturbance torques follows, 0 for none.",
        "1/s",
        0.0,
        1e4,
    ),
    Spec(
        "disturbance_limit",
        UnifiedSettings().disturbance_limit,
        "Largest disturbance torque that is believed of either motor.",
        "Nm",
        0.0,
        1e3,
    ),
    Spec("torque_limit", 0.0, "Largest torque of either motor that the law may choose, 0 for none.", "Nm", 0.0, 1e3),
)


class UnifiedController(CandidateNode):
    """One law on the locus and away from it."""

    meets_type_1 = True

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("unified_controller", UNIFIED_TORQUE, SPECS)

    def make_law(self, settings: dict[str, Any]) -> Law:
        """Return the law for its settings."""
        limit = settings["torque_limit"] or math.inf
        return UnifiedLaw(
            self._motion.robot, UnifiedSettings(**{**settings, "torque_limit": limit}), self._motion.rate_hz
        )


def main() -> None:
    """Run the node."""
    run_node(UnifiedController)


if __name__ == "__main__":
    main()
