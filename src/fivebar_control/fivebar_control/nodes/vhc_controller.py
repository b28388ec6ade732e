"""Publishes the virtual holonomic constraint candidate u3 (3.35)."""

from __future__ import annotations

from typing import Any

from fivebar_control.controllers.laws import Law, VhcCartesianLaw
from fivebar_control.controllers.resolution import RESOLUTIONS
from fivebar_control.nodes.candidate import CandidateNode, gain_specs, gains_of
from fivebar_description.interface import VHC_TORQUE
from fivebar_description.ros.parameters import Spec
from fivebar_description.ros.run import run_node

RESOLUTION = Spec(
    "resolution", "full_friction", "How the two motors share the constraint's torque.", choices=tuple(RESOLUTIONS)
)


class VhcController(CandidateNode):
    """Virtual holonomic constraint control, the law on the locus."""

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("vhc_controller", VHC_TORQUE, (*gain_specs(2500.0, 100.0), RESOLUTION))

    def make_law(self, settings: dict[str, Any]) -> Law:
        """Return the law for its gains and resolution."""
        motion = self._motion
        return VhcCartesianLaw(motion.robot, motion.plan, motion.rate_hz, gains_of(settings), settings["resolution"])


def main() -> None:
    """Run the node."""
    run_node(VhcController)


if __name__ == "__main__":
    main()
