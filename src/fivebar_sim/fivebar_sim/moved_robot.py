# SPDX-License-Identifier: Apache-2.0
"""The simulated robot that emulated hardware moves."""

from __future__ import annotations

from fivebar_description.imu import ImuSettings
from fivebar_description.parameters import FiveBar, laden
from fivebar_description.robot_file import load_robot
from fivebar_sim.effects.mechanism import mechanism_of
from fivebar_sim.effects.settings import PlantSettings
from fivebar_sim.emulation_file import EmulatedRobotFile
from fivebar_sim.plant import Plant

MOST_PARTS = 8
"""Parts of a sample, beyond which they cost more than they show: moving on by one takes some 30 us of machine code."""


def parts_of_sample(robot: FiveBar, settings: PlantSettings, rate_hz: int) -> int:
    """Return in how many parts a sample is simulated by the clock.

    Springs swing within a sample: what moves them has to act, and their angles be read, when it happens. Effects that
    are late by a part of a sample, or lose the command of a whole one, allow no parts.
    """
    springs = settings.transmission.frequency > 0.0 or settings.platform_joint.stiffness > 0.0
    if not springs or any(settings.timing) or settings.bus != PlantSettings().bus:
        return 1
    return min(MOST_PARTS, round(1.0 / (rate_hz * mechanism_of(robot, settings, rate_hz).step)))


class MovedRobot:
    """Base of emulated hardware: the robot of its file, which can be put home and carries a payload."""

    def __init__(
        self,
        file: EmulatedRobotFile,
        rate_hz: int,
        imu: ImuSettings | None = None,
        in_parts: bool = False,
        least_parts: int = 1,
    ) -> None:
        """Put the robot home, to be advanced at a rate (Hz); called once all is there that `go_home` needs.

        Without the settings of an IMU it has an ideal one. With `in_parts` it is advanced by a part of a sample, one of
        `parts`, where it has springs that swing within a sample, and of at least so many.

        Raises:
            InputError: the robot or its posture cannot be.
        """
        self._robot_file, self._plant_rate_hz, self._imu_settings, self._payload = file, rate_hz, imu, 0.0
        needed = parts_of_sample(load_robot(file.robot), file.plant(), rate_hz) if in_parts else 1
        self.parts = max(needed, least_parts)
        """Parts of a sample by each of which the robot is advanced."""
        self.go_home()

    def go_home(self) -> None:
        """Put the robot into its initial posture, at rest; it keeps its payload.

        Raises:
            InputError: the robot or its posture cannot be.
        """
        file = self._robot_file
        self._robot = load_robot(file.robot)
        self.plant = Plant(
            self._robot,
            file.initial_joints,
            self._plant_rate_hz,
            file.plant(),
            self._imu_settings,
            parts=self.parts,
        )
        if self._payload:
            self.carry(self._payload)
        # friction, or on an upright robot a hand; simulated friction alone lets it creep
        self._held = True

    def move(self, torques: tuple[float, float]) -> None:
        """Move the robot on by a part under joint torques (Nm); at home it is held until there is one.

        Raises:
            PlantDiverged: its state is no longer finite.
        """
        self._held = self._held and not any(torques)
        if not self._held:
            self.plant.advance(torques)

    def carry(self, payload: float) -> None:
        """Go on with a payload (kg) on the platform."""
        self._payload = payload
        self.plant.carry(laden(self._robot, payload))
