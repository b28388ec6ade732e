"""The simulated robot that emulated hardware moves."""

from __future__ import annotations

from fivebar_description.imu import ImuSettings
from fivebar_description.parameters import laden
from fivebar_description.robot_file import load_robot
from fivebar_sim.emulation_file import EmulatedRobotFile
from fivebar_sim.plant import Plant


class MovedRobot:
    """Base of emulated hardware: the robot of its file, which can be put home and carries a payload."""

    def __init__(self, file: EmulatedRobotFile, rate_hz: int, imu: ImuSettings | None = None) -> None:
        """Put the robot home, to be advanced at a rate (Hz); called once all is there that `go_home` needs.

        Without the settings of an IMU it has an ideal one.

        Raises:
            InputError: the robot or its posture cannot be.
        """
        self._robot_file, self._plant_rate_hz, self._imu_settings, self._payload = file, rate_hz, imu, 0.0
        self.go_home()

    def go_home(self) -> None:
        """Put the robot into its initial posture, at rest; it keeps its payload.

        Raises:
            InputError: the robot or its posture cannot be.
        """
        file = self._robot_file
        self._robot = load_robot(file.robot)
        self.plant = Plant(self._robot, file.initial_joints, self._plant_rate_hz, file.plant(), self._imu_settings)
        if self._payload:
            self.carry(self._payload)

    def carry(self, payload: float) -> None:
        """Go on with a payload (kg) on the platform."""
        self._payload = payload
        self.plant.carry(laden(self._robot, payload))
