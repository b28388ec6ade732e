"""Publishes the candidate of the law on the locus: u3 (3.35), u2 (3.19), or tau_B (1.29) of the multi-model method."""

from __future__ import annotations

from typing import Any

from fivebar_control.laws.adaptive_gain import AdaptiveGainSettings
from fivebar_control.laws.laws import ON_LOCUS_LAWS, Law, on_locus_law
from fivebar_control.laws.resolution import RESOLUTIONS
from fivebar_control.ros.controller_node import CandidateNode, gain_specs, gains_of
from fivebar_description.interface import VHC_TORQUE
from fivebar_description.ros.parameters import Spec
from fivebar_description.ros.run import run_node

DEFAULT_GAIN = AdaptiveGainSettings()

SPECS = (
    *gain_specs(2500.0, 100.0),
    Spec("law", "vhc_cartesian", "Which law.", choices=ON_LOCUS_LAWS),
    Spec(
        "resolution", "full_friction", "How the two motors share the constraint's torque.", choices=tuple(RESOLUTIONS)
    ),
    Spec("adaptive_gain", True, "Whether vhc_joint raises its gains when a switch disturbs the track."),
    Spec("alpha", DEFAULT_GAIN.alpha, "Factor of the adaptive gain.", "", 1.0, 100.0),
    Spec("error_limit", DEFAULT_GAIN.error_limit, "Jump of the tracked error that the gain answers.", "m", 0.0, 1.0),
    Spec("keep_damping", DEFAULT_GAIN.keep_damping, "Scale kp by alpha^2 and kd by alpha, instead of both by alpha."),
)


class VhcController(CandidateNode):
    """Control on the locus; by default the virtual holonomic constraint with the Cartesian variable."""

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("vhc_controller", VHC_TORQUE, SPECS)

    def make_law(self, settings: dict[str, Any]) -> Law:
        """Return the law for its parameters."""
        motion = self._motion
        gain = AdaptiveGainSettings(settings["alpha"], settings["error_limit"], settings["keep_damping"])
        return on_locus_law(
            settings["law"],
            motion.robot,
            motion.plan,
            motion.rate_hz,
            gains_of(settings),
            settings["resolution"],
            gain if settings["adaptive_gain"] else None,
        )


def main() -> None:
    """Run the node."""
    run_node(VhcController)


if __name__ == "__main__":
    main()
