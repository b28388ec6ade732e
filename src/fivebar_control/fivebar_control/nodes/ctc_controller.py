"""Publishes the computed torque candidate u1 (1.24)."""

from __future__ import annotations

from typing import Any

from fivebar_control.laws.laws import CtcLaw, Law
from fivebar_control.ros.controller_node import CandidateNode, gain_specs, gains_of
from fivebar_description.interface import CTC_TORQUE
from fivebar_description.ros.run import run_node


class CtcController(CandidateNode):
    """Computed torque control, the law away from the locus."""

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("ctc_controller", CTC_TORQUE, gain_specs(2500.0, 100.0))

    def make_law(self, settings: dict[str, Any]) -> Law:
        """Return the law for its gains."""
        return CtcLaw(self._motion.robot, gains_of(settings))


def main() -> None:
    """Run the node."""
    run_node(CtcController)


if __name__ == "__main__":
    main()
