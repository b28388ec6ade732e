"""What is known of a robot's motors, encoders and drives: the section `drives` of a robot file."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting
from fivebar_description.shared_settings import DelaySamples, EncoderCounts

CROSSING_SHARE = 0.5
"""Torque of a nominal crossing over the drives' limit, where the former is not known; docs/unified.md says why."""

NO_INTERFACE, CANOPEN, MOTKIN = "none", "canopen", "motkin"
"""Interfaces of drives: none that is known, CANopen drives behind `dextar_bridge`, the motor board of MOTKIN."""


class KnownDrives(NamedTuple):
    """Motors, encoders and drives of the robot. What is left out has the default of the setting that it stands for."""

    interface: Annotated[str, Setting("How the drives are reached.", choices=(NO_INTERFACE, CANOPEN, MOTKIN))] = (
        NO_INTERFACE
    )
    torque_limit: Annotated[float | None, Setting("Largest torque of either motor.", "Nm", above=0.0, at_most=1e6)] = (
        None
    )
    joint_speed_limit: Annotated[
        float | None, Setting("Largest speed of either motor.", "rad/s", above=0.0, at_most=1e4)
    ] = None
    encoder_counts: EncoderCounts = None
    delay_samples: DelaySamples = 0
    crossing_torque: Annotated[
        float | None,
        Setting(
            "Largest torque, beyond friction, of a nominal crossing: what the torques of this robot compare with;"
            " half of `torque_limit` where it is not given.",
            "Nm",
            above=0.0,
            at_most=1e6,
        ),
    ] = None

    def typical_torque(self) -> float | None:
        """Return the torque of a nominal crossing (Nm), given or taken from the limit; None where neither is known."""
        if self.crossing_torque is not None or self.torque_limit is None:
            return self.crossing_torque
        return CROSSING_SHARE * self.torque_limit


NO_DRIVES = KnownDrives()
"""Nothing is known."""
