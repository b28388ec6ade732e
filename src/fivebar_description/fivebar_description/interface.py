# SPDX-License-Identifier: Apache-2.0
"""The ROS interface of the robot as constants: topic names, message types, quality of service, joint names, stamps.

Nodes, recorder, launch files, reports and the offline runner share these constants. Nothing in this module imports ROS;
:mod:`fivebar_description.ros` turns them into rclpy objects.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

ACTIVE_JOINTS = ("q11", "q21")
"""Motor joints, in the order of every torque message."""

PASSIVE_JOINTS = ("q12", "q22")
"""Joints between proximal and distal link of leg 1 and of leg 2."""

JOINTS = ("q11", "q12", "q21", "q22")
"""All joints of the two legs: active and passive angle of leg 1, then of leg 2 (thesis, figure 1.7)."""

REFERENCE_NAMES = ("x", "y", "vx", "vy")
"""Fields of `reference`: position holds (x, y, vx, vy), velocity their rates (vx, vy, ax, ay)."""


@cache
def ahead_names(count: int) -> tuple[str, ...]:
    """Return the names in `reference/ahead`: those of `reference` and how many samples after the stamp."""
    return tuple(f"{name}{number}" for number in range(1, count + 1) for name in REFERENCE_NAMES)


SUPERVISOR_NAMES = ("sigma", "inverse_condition")
"""Fields of `supervisor/state`: the blending weight and kappa = 1/cond(A)."""

ESTIMATE_NAMES = ("x", "y", "vx", "vy", "d1", "d2")
"""Fields of `estimate/covariance`: position holds standard deviations, at the moment of the measurement, of the
platform's position (m) and velocity (m/s) and of the two motors' disturbance torques (Nm)."""

VISION_NAMES = ("x", "y", "deviation_x", "deviation_y", "correlation")
"""Fields of `vision/platform`: position holds the platform's position (m), its standard deviations (m) and their
correlation."""

PLATFORM_NAMES = ("x", "y")
"""Fields of `vision/error`: position by the camera minus that by the joints at the time of the exposure (m)."""

BASE_FRAME = "base_link"
"""Frame of the robot's plane: origin midway between the motors, x from motor 1 to motor 2, z up; root of the URDF."""

IMU_FRAME = "imu"
"""Frame of `imu/data`, fixed to the distal link of leg 2 at the platform."""

CAMERA_FRAME = "camera"
"""Frame of the camera's body, and its name among the late readings."""

PICTURE_FRAME = "camera_optical"
"""Frame of the pictures: x to the right, y down, z along the optical axis, as REP-103 has it."""


def frame_prefix(namespace: str) -> str:
    """Return what stands before the frames of a robot in a namespace, "robot1/"; "" without one."""
    name = namespace.strip("/")
    return f"{name}/" if name else ""


START_STAMP_NS = 1_000_000_000
"""Stamp of sample 0 in lockstep, where time is simulated. Not zero, because a zero stamp means "not set" in ROS."""

NANOSECONDS = 1_000_000_000
"""Nanoseconds in a second."""

LATEST_STAMP_NS = (2**31 - 86_400) * NANOSECONDS
"""Latest stamp that is accepted: one day before the last one that a ROS stamp can name."""


HIGHEST_PRIORITY = 98
"""Highest real-time priority that a node takes: 99 is the kernel's own."""

DEFAULT_PRIORITY = 50
"""Default SCHED_FIFO priority of the control chain in real time, that of threaded interrupt handlers."""


class Qos(NamedTuple):
    """Quality of service of a topic: all publishers are reliable and keep the last `depth` messages."""

    depth: int
    transient_local: bool = False


CONTROL_QOS = Qos(depth=8)
"""Control path. At depth 1 the reference of sample k+1 could overwrite that of k and lockstep would stall."""

LATCHED_QOS = Qos(depth=32, transient_local=True)
"""Rare messages of which a late subscriber must still see all."""

STATE_QOS = Qos(depth=1, transient_local=True)
"""States, of which a late subscriber gets the present one."""


class Topic(NamedTuple):
    """One topic of the graph.

    Attributes:
        name: relative to the node's namespace.
        type: message type.
        qos: quality of service.
        from_outside: whether drivers and users publish it, who are heard whatever quality of service they offer.
        one_publisher: whether it belongs to the control chain, where a second publisher is a fault.
        of_joints: the robot's joints on a topic where others may publish other joints: a second publisher is one that
            names some of these.
        reader_reports: whether neither blender nor plant or bridge reads it, so that who does reports a second
            publisher.
    """

    name: str
    type: str
    qos: Qos = CONTROL_QOS
    from_outside: bool = False
    one_publisher: bool = False
    of_joints: tuple[str, ...] = ()
    reader_reports: bool = False


JOINT_STATE = "sensor_msgs/msg/JointState"


def _chain_topic(
    name: str,
    kind: str = JOINT_STATE,
    qos: Qos = CONTROL_QOS,
    of_joints: tuple[str, ...] = (),
    **kept: bool,
) -> Topic:
    """Return a topic of the control chain."""
    return Topic(name, kind, qos, of_joints=of_joints, one_publisher=True, **kept)


def _reading(name: str, kind: str = JOINT_STATE, qos: Qos = CONTROL_QOS, of_joints: tuple[str, ...] = ()) -> Topic:
    """Return a topic of a sensor whose driver may be another's."""
    return _chain_topic(name, kind, qos, of_joints, from_outside=True, reader_reports=True)


JOINT_STATES = _chain_topic("joint_states", of_joints=JOINTS)
REFERENCE = _chain_topic("reference")
REFERENCE_AHEAD = _chain_topic("reference/ahead", reader_reports=True)
"""The references of the samples that follow, for a law that looks ahead; names and fields from `ahead_names`. A bag
leaves it out, since it holds every reference itself."""
REFERENCE_MOTION = _chain_topic("reference/motion", reader_reports=True)
"""The whole motion that begins with the stamp, or is another one from there on, for a law that needs all of it: without
names, in `position` the six numbers of each of its samples; empty where none begins. A bag leaves it out, too."""

MOTION_FIELDS = 6
"""Numbers of a sample in `reference/motion`: place (m), velocity and acceleration of the platform."""


def torque_topic(name: str) -> Topic:
    """Return the topic of a law's candidate torque."""
    return Topic(f"{name}/torque", JOINT_STATE, one_publisher=True)


CTC_TORQUE = torque_topic("ctc")
VHC_TORQUE = torque_topic("vhc")
UNIFIED_TORQUE = torque_topic("unified")
SUPERVISOR_STATE = _chain_topic("supervisor/state")
SUPERVISOR_SIGMA = Topic("supervisor/sigma", "std_msgs/msg/Float64")
TORQUE_REQUESTED = Topic("torque_requested", "sensor_msgs/msg/JointState")
TORQUE_COMMAND = _chain_topic("torque_command")
MOTOR_STATES = _chain_topic("motor_states", of_joints=ACTIVE_JOINTS, reader_reports=True)
PASSIVE_STATES = _reading("passive_states", of_joints=PASSIVE_JOINTS)
"""Angle of the passive joint that has an encoder, stamped with the time of the reading. A topic of its own: it comes
from a driver of its own, at its own rate, and late, while `motor_states` is what the drives answer in one cycle."""
EXTRA_NAME = "extra_sensor"
"""Name by which messages call the sensor from another package."""
EXTRA_READINGS = _reading("extra_sensor")
"""Value of a sensor from another package, stamped with the time of the reading."""
ESTIMATE_COVARIANCE = Topic("estimate/covariance", "sensor_msgs/msg/JointState")
ESTIMATE_DISTURBANCE = _chain_topic("estimate/disturbance", reader_reports=True)
GROUND_TRUTH = Topic("ground_truth", "sensor_msgs/msg/JointState")
IMU_DATA = _reading("imu/data", "sensor_msgs/msg/Imu")
READINGS_RELEASED = _chain_topic("readings_released", reader_reports=True)
"""In lockstep, which late readings come with a sample: for each the name of its sensor and, as its position, the moment
of its stamp in samples. Topics have no order among each other; the estimator waits for exactly these. A bag leaves it
out."""
IMU_ERROR = Topic("imu/acceleration_error", "std_msgs/msg/Float64")
VISION_PLATFORM = _reading("vision/platform")
"""The platform by the camera, stamped with the time of the exposure; NaN where a picture does not show it."""
VISION_ERROR = Topic("vision/error", "sensor_msgs/msg/JointState")
CAMERA_IMAGE = _reading("camera/image_raw", "sensor_msgs/msg/Image", Qos(depth=16))
CAMERA_INFO = _reading("camera/camera_info", "sensor_msgs/msg/CameraInfo", Qos(depth=16))
FAULTS = Topic("faults", "std_msgs/msg/String", LATCHED_QOS)
SAFETY_STATE = _chain_topic("safety/state", "std_msgs/msg/String", STATE_QOS)
DRIVES_STATE = _chain_topic("drives/state", "std_msgs/msg/String", STATE_QOS)
ESTIMATE_STATE = _chain_topic("estimate/state", "std_msgs/msg/String", STATE_QOS)
"""With a camera, whether the estimator knows where the robot is: `ALL_WELL` or its fault. The blender follows it."""
RUN_STATUS = Topic("run/status", "std_msgs/msg/String", STATE_QOS)
RUN_READY = Topic("run/ready", "std_msgs/msg/String", LATCHED_QOS)
RUN_PLAN = _chain_topic("run/plan", "std_msgs/msg/String", STATE_QOS)
"""The facts on which the nodes of a run must agree, from the trajectory generator: JSON with a digest and the
values by name."""
RUN_EPOCH = _chain_topic("run/epoch", "std_msgs/msg/String", STATE_QOS)
"""The stamp of sample 0 (ns), from the node that keeps the time, plant or bridge: JSON {"epoch_ns": ...}; null while no
run is on. Nodes number samples from stamps, so they answer only once they know it."""
CLOCK = Topic("clock", "rosgraph_msgs/msg/Clock")
"""In lockstep, the stamp of the present sample, from the plant: /clock, for tools with use_sim_time, unless the robot
has a namespace. A bag leaves it out, since whoever plays a bag publishes the time."""

CELL_CLOCK = Topic("/clock", "rosgraph_msgs/msg/Clock")
"""The time of a cell with several robots in lockstep: that of the robot which has come least far."""

TOPICS = (
    JOINT_STATES,
    REFERENCE,
    CTC_TORQUE,
    VHC_TORQUE,
    UNIFIED_TORQUE,
    SUPERVISOR_STATE,
    SUPERVISOR_SIGMA,
    TORQUE_REQUESTED,
    TORQUE_COMMAND,
    MOTOR_STATES,
    PASSIVE_STATES,
    EXTRA_READINGS,
    ESTIMATE_COVARIANCE,
    ESTIMATE_DISTURBANCE,
    GROUND_TRUTH,
    IMU_DATA,
    IMU_ERROR,
    VISION_PLATFORM,
    VISION_ERROR,
    FAULTS,
    SAFETY_STATE,
    DRIVES_STATE,
    RUN_STATUS,
    RUN_READY,
    RUN_PLAN,
    RUN_EPOCH,
)
"""All topics of the graph, in the order in which pages and bags list them."""

ALL_WELL = "ok"
"""Content of `safety/state` (from the blender) and `drives/state` (from the plant or the bridge) while no fault is
latched; otherwise it is the text of the fault."""

GOAL = Topic("goal", "sensor_msgs/msg/JointState")
GOAL_STATUS = Topic("goal/status", "std_msgs/msg/String", STATE_QOS)
"""Requests for a motion and their outcome. They are not part of the control cycle: no node waits for them."""

RELEASE_STATUS = Topic("release/status", "std_msgs/msg/String", STATE_QOS)
"""How far a release from the Type 2 locus has come, from the blender: there only once one has been asked for."""

RELEASE_BEGINS, RELEASE_RESTS, RELEASE_PRESSES = "begins", "resting", "pressing"
"""Texts on `release/status` while the release goes on; any other tells how it has ended."""

GOAL_POSE = Topic("goal_pose", "geometry_msgs/msg/PoseStamped", from_outside=True)
"""A request by the place alone, as RViz publishes it: in a frame of the URDF that does not move."""

GOAL_TRAJECTORY = Topic("goal_trajectory", "trajectory_msgs/msg/JointTrajectory", from_outside=True)
"""A request for a motion through points at given times, of the platform (x, y) or the motors (q11, q21)."""

PAYLOAD = Topic("payload", "std_msgs/msg/Float64", STATE_QOS, from_outside=True)
"""Mass (kg) that the platform carries besides its own, from whoever makes the robot pick it up: all nodes that model
the robot add it to the platform's."""
PROGRAM = Topic("program", "std_msgs/msg/String")
PROGRAM_STATUS = Topic("program/status", "std_msgs/msg/String", STATE_QOS)
"""The text of a program to carry out, and how far it has come. No node of the control cycle waits for them."""

WORK_TOPICS = (PAYLOAD, PROGRAM, PROGRAM_STATUS)
"""Topics that a bag holds besides for a robot that takes programs."""

OUTPUTS = "outputs/"
"""Begin of the names of the topics of output pins."""


def output_topic(pin: str) -> Topic:
    """Return the topic of an output pin."""
    return Topic(f"{OUTPUTS}{pin}", "std_msgs/msg/Bool", STATE_QOS)


DIAGNOSTICS = Topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", Qos(depth=10))
"""Rates, counts and health of every node; one topic for all robots of a domain, as its tools expect."""

HARDWARE = "fivebar"
"""Hardware id on /diagnostics; in a namespace with its name in front, as of a frame."""

TORQUE_LATENCY = "torque_latency_ms"
"""Value on /diagnostics of a bridge: as JSON, how long after the reading of a sample its torque was with the drives."""

TASK = "health"
"""Name of a node's report on /diagnostics."""


def status_name(node: str) -> str:
    """Return the name of a node's status on /diagnostics, from the node's absolute name."""
    return f"{node}: {TASK}"


def node_of_status(name: str) -> str:
    """Return the node (absolute name) that a status on /diagnostics is of; that of another program is left as it is."""
    return name.removesuffix(f": {TASK}")


RUN_BEGIN = Topic("run/begin", "std_msgs/msg/Header", STATE_QOS)
"""The content of `run/epoch` in a standard message: the stamp of sample 0, zero while no run is on."""
RUN_PATH = Topic("run/path", "nav_msgs/msg/Path", STATE_QOS)
GOAL_PATH = Topic("goal/path", "nav_msgs/msg/Path", STATE_QOS)
GOAL_TARGET = Topic("goal/target", "geometry_msgs/msg/PoseStamped", STATE_QOS)
"""Where the run's plan goes, where a requested motion goes, and where that one ends."""

VALUES = {
    topic: Topic(f"{topic.name}/values", "diagnostic_msgs/msg/DiagnosticStatus", STATE_QOS)
    for topic in (RUN_STATUS, GOAL_STATUS, PROGRAM_STATUS, SAFETY_STATE, DRIVES_STATE)
}
"""Twins of statuses that are texts, with level, message and values, by the topic of the text."""

TWIN_OF_TEXT = {RUN_EPOCH: RUN_BEGIN, **VALUES}
"""Topics of the standard messages that say the same as a text, by the topic of the text; who publishes one
publishes both."""

TWINS = (*TWIN_OF_TEXT.values(), RUN_PATH, GOAL_PATH, GOAL_TARGET)
"""Standard messages that say what the graph says in texts, for tools that show and plot these. No node waits for
them."""

RECORDED_BESIDES = (GOAL, GOAL_POSE, GOAL_TRAJECTORY, GOAL_STATUS, DIAGNOSTICS, *TWINS)
"""Topics that a bag holds besides, without the recorder waiting for them."""

SCENE = Topic("scene", "visualization_msgs/msg/MarkerArray", Qos(depth=8, transient_local=True))
SCENE_TRAIL = Topic("scene/trail", "visualization_msgs/msg/MarkerArray", STATE_QOS)
SCENE_MAP = Topic("scene/map", "visualization_msgs/msg/MarkerArray", STATE_QOS)
PICTURES = (SCENE, SCENE_TRAIL, SCENE_MAP)
"""Pictures of a run for RViz and Foxglove: what moves, where it has been, and loci, path and zones. No node waits for
them; a bag has them where the run was asked for them."""

CONTROL_CHAIN = tuple(
    declared for declared in tuple(globals().values()) if isinstance(declared, Topic) and declared.one_publisher
)
"""The topics by which the robot moves, each with one publisher; that of a law from elsewhere belongs to them too."""

JOINT_SOURCES = tuple(declared for declared in CONTROL_CHAIN if declared.of_joints)
"""Topics of the robot's joints, on which others may publish other joints."""

READ_BESIDES = tuple(declared for declared in CONTROL_CHAIN if declared.reader_reports)
"""Topics that neither blender nor plant or bridge reads: who reads them reports their faults."""

CANDIDATES = (CTC_TORQUE, UNIFIED_TORQUE, VHC_TORQUE)
"""Topics of the torque candidates of this project's laws; a run has those of its controller."""

VISION_TOPICS = (VISION_PLATFORM, VISION_ERROR)
"""Topics that only a run with a camera has."""

CAMERA_TOPICS = (CAMERA_IMAGE, CAMERA_INFO)
"""Pictures and what they were taken with; a bag has them where the run was asked for them."""

ESTIMATION_TOPICS = (MOTOR_STATES, ESTIMATE_COVARIANCE, ESTIMATE_DISTURBANCE)
"""Topics that only a run with an estimator has: `joint_states` is then its estimate."""


def topic_named(name: str) -> Topic | None:
    """Return a topic of the graph by its name, also that of a law from elsewhere; None where there is none."""
    topics = (*TOPICS, *PICTURES, *CAMERA_TOPICS, *RECORDED_BESIDES, *WORK_TOPICS)
    known = next((topic for topic in topics if topic.name == name), None)
    if known is None and name.endswith("/torque"):
        return torque_topic(name.removesuffix("/torque"))
    if known is None and name.startswith(OUTPUTS):
        return output_topic(name.removeprefix(OUTPUTS))
    return known


def of_robot(topic: Topic, robot: str) -> Topic:
    """Return a topic of a robot in a namespace, such as "left", for who is outside of it; "" for one without."""
    return topic._replace(name=f"{robot}/{topic.name}") if robot and not topic.name.startswith("/") else topic


def robot_of_name(name: str, own: str) -> str:
    """Return the robot before a name, which ends in `own`: "left" of "left/torque_command"."""
    return name.removesuffix(own).rstrip("/")


def sample_stamp_ns(sample: int, rate_hz: int, epoch_ns: int = START_STAMP_NS) -> int:
    """Return the stamp of sample k in integer nanoseconds, the epoch for sample 0; `rate_hz` must divide 1e9."""
    return epoch_ns + sample * (NANOSECONDS // rate_hz)


def moment_of_stamp(stamp_ns: int, rate_hz: int, epoch_ns: int = START_STAMP_NS) -> float:
    """Return the moment that a stamp names, in samples since the epoch: a whole number on the grid of `rate_hz`."""
    return (stamp_ns - epoch_ns) / (NANOSECONDS // rate_hz)


def late_stamp_ns(sample: int, rate_hz: int, offset: float, epoch_ns: int = START_STAMP_NS) -> int:
    """Return the stamp (ns) of sample k by a clock whose stamps are late by an offset (s)."""
    return sample_stamp_ns(sample, rate_hz, epoch_ns) + round(offset * NANOSECONDS)


def sample_of_stamp(stamp_ns: int, rate_hz: int, epoch_ns: int = START_STAMP_NS) -> int | None:
    """Return the sample number that a stamp names; None where it is not on the grid of `rate_hz` from the epoch on."""
    sample, rest = divmod(stamp_ns - epoch_ns, NANOSECONDS // rate_hz)
    return sample if rest == 0 and sample >= 0 else None


def unexpected_sample(sample: int | None, expected: int) -> str:
    """Return in words that a message's stamp is that of another sample, or of none, than the one expected."""
    return f"stamp of {'no sample' if sample is None else f'sample {sample}'}, expected that of sample {expected}"
