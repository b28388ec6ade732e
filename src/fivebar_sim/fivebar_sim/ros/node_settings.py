"""The settings of the nodes that simulate; those of the simulation itself stand beside its code.

Nothing here needs ROS, so that the description of the graph can be made without it.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting
from fivebar_description.shared_settings import (
    AwaitedNodes,
    BrakeLimit,
    ByTheClock,
    LastSample,
    RateHz,
    ReadyTimeout,
    Robot,
)

LOCKSTEP, REALTIME = "lockstep", "realtime"
ALL_JOINTS, MOTORS = "joint_states", "motor_states"

START_JOINTS = (1.6573402912344397, -0.9225800732005386, 1.4842523623553534, 0.9225800732005386)
"""At rest at (0, 0.15) m with the elbows outwards, where the middle crossing starts."""


class CameraNodeSettings(NamedTuple):
    """The camera's node, besides camera and simulated robot."""

    robot: Robot = "dextar"
    rate_hz: RateHz = 500
    by_the_clock: ByTheClock = False
    wait_for_nodes: AwaitedNodes = ()


class PlantNodeSettings(NamedTuple):
    """The plant's node: the run, besides the simulated robot and its IMU."""

    robot: Robot = "dextar"
    rate_hz: RateHz = 500
    samples: Annotated[int, Setting("Number of the last sample.", "samples", at_least=1, at_most=100_000_000)] = 1000
    mode: Annotated[
        str,
        Setting(
            "Lockstep waits for the torque of each sample; realtime follows the steady clock.",
            choices=(LOCKSTEP, REALTIME),
        ),
    ] = LOCKSTEP
    publishes: Annotated[
        str,
        Setting(
            "The four joints for the controllers, or the two motors for an estimator; in the"
            " latter case, and with effects, the exact state besides.",
            choices=(ALL_JOINTS, MOTORS),
        ),
    ] = ALL_JOINTS
    initial_joints: Annotated[
        tuple[float, float, float, float],
        Setting("Posture at the start: q11, q12, q21, q22 of a closed loop.", "rad"),
    ] = START_JOINTS
    announces_readings: Annotated[
        bool, Setting("Lockstep: whether each sample announces which late readings come with it.")
    ] = False
    wait_for_nodes: AwaitedNodes = ()
    ready_timeout_s: ReadyTimeout = 30.0
    command_timeout_s: Annotated[
        float,
        Setting("Lockstep: longest wait for a torque, on the steady clock.", "s", at_least=0.1, at_most=3600.0),
    ] = 5.0
    freshness_samples: Annotated[
        int,
        Setting(
            "Real time: age of the latest torque beyond which it is a fault.", "samples", at_least=1, at_most=10_000
        ),
    ] = 10
    brake_limit_s: BrakeLimit = 1.1


class EmulatedRobotSettings(NamedTuple):
    """The emulated drives with the robot that they move, in addition to its gyroscope."""

    emulation: Annotated[
        str, Setting("Bus, drives and robot: a shipped emulation's name or a path to a YAML file.")
    ] = "dextar_emulated"
    rate_hz: RateHz = 500
    samples: LastSample = 0
    inject: Annotated[
        tuple[str, ...], Setting("Faults: seconds since sample 0 and an order, such as '1.2 fault 1'.")
    ] = ()
    seed: Annotated[
        int, Setting("Seed of the noise of gyroscope and passive encoder.", at_least=0, at_most=2**31 - 1)
    ] = 0
    wait_for_nodes: AwaitedNodes = ()
    ready_timeout_s: ReadyTimeout = 30.0
