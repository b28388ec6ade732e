# SPDX-License-Identifier: Apache-2.0
"""The quantities of a run: the columns of its table, their units, and the message fields that carry them.

One list serves all that writes or reads a run: the simulation without ROS writes its bag by it, a bag is read back by
it, and `Run.to_dataframe` has its columns. Nothing here needs ROS.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ESTIMATE_COVARIANCE,
    ESTIMATE_DISTURBANCE,
    ESTIMATE_NAMES,
    GROUND_TRUTH,
    IMU_DATA,
    JOINT_STATES,
    JOINTS,
    MOTOR_STATES,
    PASSIVE_STATES,
    REFERENCE,
    REFERENCE_NAMES,
    SUPERVISOR_NAMES,
    SUPERVISOR_STATE,
    TORQUE_COMMAND,
    TORQUE_REQUESTED,
    UNIFIED_TORQUE,
    VHC_TORQUE,
    Topic,
)

POSITION, VELOCITY, EFFORT = "position", "velocity", "effort"
"""The fields of a JointState."""


class Quantity(NamedTuple):
    """A quantity of a run, sampled: one field of a topic.

    Attributes:
        name: of the quantity.
        topic, field: the message field that carries it.
        names: what the message calls the values, in their order; empty for a vector, and for a joint that the robot
            determines.
        columns: the columns of the table, one per value; "" for a value that the table leaves out.
        units: one per column.
        meaning: what it is, for people.
    """

    name: str
    topic: Topic
    field: str
    names: tuple[str, ...]
    columns: tuple[str, ...]
    units: tuple[str, ...]
    meaning: str


def _joints(prefix: str, suffix: str) -> tuple[str, ...]:
    return tuple(f"{prefix}{joint}{suffix}" for joint in JOINTS)


RADIANS, RADIANS_PER_SECOND, TORQUES = ("rad",) * 4, ("rad/s",) * 4, ("Nm", "Nm")
PLANAR = ("m", "m", "m/s", "m/s")

FEEDBACK_POSITION = Quantity(
    "feedback_position",
    JOINT_STATES,
    POSITION,
    JOINTS,
    _joints("", "_feedback"),
    RADIANS,
    "joint angles that the controllers use: measured, or estimated where there is an estimator",
)
FEEDBACK_VELOCITY = Quantity(
    "feedback_velocity",
    JOINT_STATES,
    VELOCITY,
    JOINTS,
    _joints("d", "_feedback"),
    RADIANS_PER_SECOND,
    "their rates",
)
FEEDBACK_EFFORT = Quantity(
    "feedback_effort",
    JOINT_STATES,
    EFFORT,
    JOINTS,
    ("tau1_feedback", "", "tau2_feedback", ""),
    ("Nm", "", "Nm", ""),
    "motor torques over the period before the sample, as the drives report them",
)
TRUE_POSITION = Quantity(
    "true_position", GROUND_TRUTH, POSITION, JOINTS, _joints("", "_true"), RADIANS, "exact joint angles"
)
TRUE_VELOCITY = Quantity(
    "true_velocity", GROUND_TRUTH, VELOCITY, JOINTS, _joints("d", "_true"), RADIANS_PER_SECOND, "their rates"
)
TRUE_EFFORT = Quantity(
    "true_effort",
    GROUND_TRUTH,
    EFFORT,
    JOINTS,
    ("tau1_true", "", "tau2_true", ""),
    ("Nm", "", "Nm", ""),
    "motor torques that acted over the period before the sample",
)
REFERENCE_STATE = Quantity(
    "reference_state",
    REFERENCE,
    POSITION,
    REFERENCE_NAMES,
    ("xd_sent", "yd_sent", "vxd_sent", "vyd_sent"),
    PLANAR,
    "reference of the platform as published with the stamp of the sample",
)
REFERENCE_RATE = Quantity(
    "reference_rate",
    REFERENCE,
    VELOCITY,
    REFERENCE_NAMES,
    ("", "", "axd_sent", "ayd_sent"),
    ("", "", "m/s²", "m/s²"),
    "its acceleration",
)
SUPERVISION = Quantity(
    "supervision",
    SUPERVISOR_STATE,
    POSITION,
    SUPERVISOR_NAMES,
    ("sigma", "inverse_condition"),
    ("", ""),
    "blending weight of the constraint law, and 1/cond(A)",
)
TORQUE_OF_NOMINAL = Quantity(
    "torque_nominal",
    UNIFIED_TORQUE,
    EFFORT,
    ACTIVE_JOINTS,
    ("tau1_nominal", "tau2_nominal"),
    TORQUES,
    "candidate of the nominal law, or of the only law",
)
"""Its topic is that of the controller's law: see :func:`quantities`."""
TORQUE_OF_CONSTRAINT = Quantity(
    "torque_vhc",
    VHC_TORQUE,
    EFFORT,
    ACTIVE_JOINTS,
    ("tau1_constraint", "tau2_constraint"),
    TORQUES,
    "candidate of the constraint law",
)
REQUESTED_TORQUE = Quantity(
    "torque_requested",
    TORQUE_REQUESTED,
    EFFORT,
    ACTIVE_JOINTS,
    ("tau1_requested", "tau2_requested"),
    TORQUES,
    "blended torque before all limits; absent after a fault",
)
COMMANDED_TORQUE = Quantity(
    "torque_command",
    TORQUE_COMMAND,
    EFFORT,
    ACTIVE_JOINTS,
    ("tau1_command", "tau2_command"),
    TORQUES,
    "torque that answers the sample, within all limits",
)
MOTOR_ANGLE = Quantity(
    "motor_angle",
    MOTOR_STATES,
    POSITION,
    ACTIVE_JOINTS,
    ("q11_motor", "q21_motor"),
    ("rad", "rad"),
    "readings of the motors' encoders, from which the state is estimated",
)
MOTOR_EFFORT = Quantity(
    "motor_effort",
    MOTOR_STATES,
    EFFORT,
    ACTIVE_JOINTS,
    ("tau1_motor", "tau2_motor"),
    TORQUES,
    "motor torques over the period before, as the drives report them",
)
ESTIMATE_DEVIATION = Quantity(
    "estimate_deviation",
    ESTIMATE_COVARIANCE,
    POSITION,
    ESTIMATE_NAMES,
    tuple(f"deviation_{name}" for name in ESTIMATE_NAMES),
    (*PLANAR, "Nm", "Nm"),
    "standard deviations of the estimate",
)
DISTURBANCE = Quantity(
    "disturbance",
    ESTIMATE_DISTURBANCE,
    EFFORT,
    ACTIVE_JOINTS,
    ("d1", "d2"),
    TORQUES,
    "estimated disturbance torques of both motors",
)
TURN_RATE = Quantity(
    "turn_rate",
    IMU_DATA,
    "angular_velocity",
    (),
    ("imu_wx", "imu_wy", "imu_wz"),
    ("rad/s",) * 3,
    "the gyroscope's reading that was made at the sample, in the IMU's frame",
)
ACCELERATION = Quantity(
    "acceleration",
    IMU_DATA,
    "linear_acceleration",
    (),
    ("imu_ax", "imu_ay", "imu_az"),
    ("m/s²",) * 3,
    "the accelerometer's reading that was made at the sample, in the IMU's frame",
)
PASSIVE_ANGLE = Quantity(
    "passive_angle",
    PASSIVE_STATES,
    POSITION,
    (),
    ("passive_angle",),
    ("rad",),
    "the reading of the encoder on a passive joint that was made at the sample",
)

QUANTITIES = (
    FEEDBACK_POSITION,
    FEEDBACK_VELOCITY,
    FEEDBACK_EFFORT,
    TRUE_POSITION,
    TRUE_VELOCITY,
    TRUE_EFFORT,
    REFERENCE_STATE,
    REFERENCE_RATE,
    SUPERVISION,
    TORQUE_OF_NOMINAL,
    TORQUE_OF_CONSTRAINT,
    REQUESTED_TORQUE,
    COMMANDED_TORQUE,
    MOTOR_ANGLE,
    MOTOR_EFFORT,
    ESTIMATE_DEVIATION,
    DISTURBANCE,
    TURN_RATE,
    ACCELERATION,
    PASSIVE_ANGLE,
)


@cache
def quantities(nominal: Topic) -> tuple[Quantity, ...]:
    """Return the quantities of a run whose nominal law publishes on a topic, in the order of the table."""
    return tuple(
        quantity._replace(topic=nominal) if quantity is TORQUE_OF_NOMINAL else quantity for quantity in QUANTITIES
    )


@cache
def sampled_topics(nominal: Topic) -> dict[Topic, tuple[Quantity, ...]]:
    """Return the topics with a message for every sample, and the quantities that each carries."""
    sampled = [quantity for quantity in quantities(nominal) if quantity.names]
    return {
        topic: tuple(quantity for quantity in sampled if quantity.topic == topic)
        for topic in dict.fromkeys(quantity.topic for quantity in sampled)
    }
