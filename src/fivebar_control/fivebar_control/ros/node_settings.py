"""Settings of the nodes of the control chain; components that also run without ROS keep theirs beside their code.

This module does not import ROS, so that the graph can be described without it.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_control.laws.law import MIN_AUTHORITY, MOST_AHEAD
from fivebar_control.laws.registry import (
    CONDITION,
    GOAL_CONTROLLERS,
    SIGMOID,
    controller_problem,
    find_controller,
    find_law,
    law_problem,
)
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.trajectory.planner import QUINTIC, TimeLaw
from fivebar_control.trajectory.rounded import BLEND_RADIUS, RESTS
from fivebar_description.interface import Topic
from fivebar_description.settings import Setting
from fivebar_description.shared_settings import (
    LONGEST_DELAY,
    WORKING_MODE,
    AwaitedNodes,
    BrakeLimit,
    ByTheClock,
    LastSample,
    RateHz,
    Robot,
    WorkingMode,
)

ZONE_PREFIX = "zone_"
"""Prefix of the parameters that hold `ZoneSettings`."""

GOAL_PREFIX, GOAL_TOLERANCE_PREFIX, GOAL_RISK_PREFIX = "goal_estimator_", "goal_tolerance_", "goal_risk_"
GOAL_LOAD_PREFIX, GOAL_PASSIVE_PREFIX = "goal_load_", "goal_passive_"
GOAL_SAFETY_PREFIX, GOAL_LAW_PREFIX = "goal_safety_", "goal_law_"
"""Prefixes of the parameters by which requests are judged: `Drives` and `EkfSettings`, `Tolerances`, `Risk`, `Loads`,
`PassiveEncoder`, `SafetySettings` and those of the law that follows them."""

OF_REQUESTS = ("workspace", "forbidden", "tracking_error_limit")
"""The settings of `SafetySettings` that a request keeps to; torque and speed have parameters of their own."""

NOT_OF_THE_FILTER = ("feed_forward",)
"""The setting of `EkfSettings` that the graph uses, not the state estimator."""

NOT_OF_THE_GUARD = ("stop_time_ms", "stop_cycles")
"""The settings of `SafetySettings` from which the graph derives the deadlines of several nodes."""

HOLD, CONTINUE = "hold", "continue"
BLENDED = "blended"

LeadSamples = Annotated[
    int,
    Setting(
        "Samples from a measurement to the time at which its torque acts: the drives' delay where an estimator"
        " predicts the state.",
        "samples",
        at_least=0,
        at_most=LONGEST_DELAY,
    ),
]


def _sign(assembly: int) -> str | None:
    return None if assembly in (-1, 1) else "expected +1 or -1"


def torque_of(candidates: str) -> Topic:
    """Return the topic of an unblended law, or of the nominal law of a blended controller.

    Raises:
        InputError: there is no such law.
    """
    return find_law("ctc" if candidates == BLENDED else candidates).topic


def _no_such_law(candidates: str) -> str | None:
    return None if candidates == BLENDED else law_problem(candidates)


def _follows_no_requests(controller: str) -> str | None:
    problem = controller_problem(controller)
    if problem is None and not find_controller(controller).takes_goals:
        return f"expected a controller that follows requests, {' or '.join(GOAL_CONTROLLERS)}"
    return problem


class MotionSettings(NamedTuple):
    """The motion: every node that needs the plan computes it from these, so that all have the same plan."""

    robot: Robot = "dextar"
    rate_hz: RateHz = 500
    working_mode: Annotated[
        tuple[int, ...],
        Setting(f"{WORKING_MODE.description} Two signs, or two for every waypoint of a motion that may meet Type 1."),
    ] = (1, -1)
    waypoints: Annotated[tuple[float, ...], Setting("Waypoints of the path: x1, y1, x2, y2, ...", "m")] = (
        *(0.0, 0.15),
        *(0.0, 0.02),
        *(0.0, 0.15),
    )
    segment_durations: Annotated[tuple[float, ...], Setting("Duration of each segment.", "s")] = (1.0, 1.0)
    time_law: TimeLaw = QUINTIC
    min_authority: Annotated[
        float,
        Setting(
            "Least |n.v1| at a crossing of the Type 2 locus; 0 for a law that needs no control along the path normal.",
            at_least=0.0,
            at_most=1.0,
        ),
    ] = MIN_AUTHORITY
    lead_samples: LeadSamples = 0
    blend_radius: Annotated[tuple[float, ...], BLEND_RADIUS] = RESTS


class TrajectorySettings(NamedTuple):
    """The trajectory generator, in addition to the motion."""

    after_fault: Annotated[
        str,
        Setting(
            "While safety/state reports a fault and after its reset: hold the robot's current position, or continue"
            " with the plan (for lockstep, where runs must be repeatable).",
            choices=(HOLD, CONTINUE),
        ),
    ] = HOLD
    samples_ahead: Annotated[
        int,
        Setting(
            "Of how many samples that follow the reference is published besides, for a law that looks ahead.",
            "samples",
            at_least=0,
            at_most=MOST_AHEAD,
        ),
    ] = 0


class GoalSettings(NamedTuple):
    """Requested motions."""

    takes_goals: Annotated[
        bool,
        Setting("Accept requests on the topic goal; only a controller without blending zones follows such motions."),
    ] = False
    goal_controller: Annotated[
        str,
        Setting("The controller that follows requested motions, or MODULE:NAME.", check=_follows_no_requests),
    ] = "unified"
    goal_torque_limit: Annotated[
        float, Setting("Torque limit of both motors, for planning.", "Nm", at_least=1e-3, at_most=1e6)
    ] = MotionLimits().torque
    goal_speed_limit: Annotated[
        float, Setting("Speed limit of both motors, for planning.", "rad/s", at_least=1e-3, at_most=1e4)
    ] = MotionLimits().motor_speed
    goal_error_tolerance: Annotated[
        float,
        Setting(
            "Largest distance from the reference that a robot within its tolerances may have.",
            "m",
            at_least=1e-6,
            at_most=10.0,
        ),
    ] = MotionLimits().error_tolerance
    goal_estimated: Annotated[
        bool,
        Setting("Whether the state is estimated, so that the robot's tolerances decide which motions are planned."),
    ] = False
    goal_gyro_every: Annotated[
        int, Setting("Samples from one reading of the gyroscope to the next, for planning.", "samples", at_least=1)
    ] = 1
    goal_camera_every: Annotated[
        int,
        Setting(
            "Samples from one position by the camera to the next, for planning; 0 for none.", "samples", at_least=0
        ),
    ] = 0
    goal_held_ms: Annotated[
        float,
        Setting(
            "How long the last torque may be held, which a motion has to bear; 0 where none is held, as in lockstep.",
            "ms",
            at_least=0.0,
            at_most=1e4,
        ),
    ] = 0.0
    goal_wait_ms: Annotated[
        float,
        Setting(
            "How long each sample waits for a plan that is under way; 0 but in lockstep, where time waits too.",
            "ms",
            at_least=0.0,
            at_most=200.0,
        ),
    ] = 0.0


class ProgramSettings(NamedTuple):
    """The program runner."""

    rate_hz: RateHz = 500
    program: Annotated[
        str, Setting("Path of the program that is carried out after the plan; none where it is empty.")
    ] = ""
    begin: Annotated[
        int,
        Setting(
            "Number of instructions of that program that the plan of the run carries out.", at_least=0, at_most=10_000
        ),
    ] = 0
    begin_sample: Annotated[
        int, Setting("Sample from which on the plan of the run is over.", "samples", at_least=0)
    ] = 0


class SupervisorSettings(NamedTuple):
    """The supervisor, in addition to the motion."""

    weighting: Annotated[
        str,
        Setting(
            "What determines sigma: 1/cond(A), or a sigmoid in time around each planned crossing (multi_model_ctc).",
            choices=(CONDITION, SIGMOID),
        ),
    ] = CONDITION


SHORTEST_DEADLINE_MS = 1.0
"""The least that the blender takes for the deadline of the candidates (ms)."""


class BlenderSettings(NamedTuple):
    """The blender, in addition to the limits of `SafetySettings`."""

    robot: Robot = "dextar"
    rate_hz: RateHz = 500
    working_mode: WorkingMode = (1, -1)
    candidates: Annotated[
        str,
        Setting(
            "Blend ctc/torque and vhc/torque by sigma, or use only the candidate of the named law.",
            check=_no_such_law,
        ),
    ] = BLENDED
    candidate_deadline_ms: Annotated[
        float,
        Setting(
            "Timeout for the candidates of a sample, on the steady clock; then zero torque and a fault.",
            "ms",
            at_least=SHORTEST_DEADLINE_MS,
            at_most=60_000.0,
        ),
    ] = 2000.0
    state_deadline_ms: Annotated[
        float,
        Setting(
            "Timeout from one sample to the next, on the steady clock; then zero torque and a fault. 0 for none, in"
            " lockstep.",
            "ms",
            at_least=0.0,
            at_most=60_000.0,
        ),
    ] = 0.0
    last_sample: LastSample = 0
    estimate_recovers: Annotated[
        bool,
        Setting(
            "Whether the estimator, which says so on estimate/state, can begin again where a camera sees the robot."
        ),
    ] = False


class EstimatorSettings(NamedTuple):
    """The state estimator, in addition to the drives, the filter, the tolerances and the IMU's mounting."""

    robot: Robot = "dextar"
    rate_hz: RateHz = 500
    working_mode: WorkingMode = (1, -1)
    homing: Annotated[tuple[float, float], Setting("Platform position at sample 0: x, y.", "m")] = (0.0, 0.15)
    assembly_mode: Annotated[int, Setting("Sign of det A in that posture.", at_least=-1, at_most=1, check=_sign)] = 1
    awaits_readings: Annotated[
        bool, Setting("Whether each sample announces which late readings come with it, as in lockstep.")
    ] = False
    compiled: Annotated[
        bool, Setting("Whether the filter runs as machine code, which is compiled before the first sample.")
    ] = False


class ImuListenerSettings(NamedTuple):
    """The IMU listener, in addition to the IMU."""

    robot: Robot = "dextar"
    rate_hz: RateHz = 500
    working_mode: WorkingMode = (1, -1)
    lead_samples: LeadSamples = 0
    wait_for_nodes: AwaitedNodes = ()


class VisionListenerSettings(NamedTuple):
    """The vision listener, in addition to the camera."""

    robot: Robot = "dextar"
    rate_hz: RateHz = 500
    lead_samples: LeadSamples = 0
    by_the_clock: ByTheClock = False
    wait_for_nodes: AwaitedNodes = ()


class BridgeSettings(NamedTuple):
    """The bridge to the drives."""

    rate_hz: RateHz = 500
    drives: Annotated[
        str, Setting("Configuration of bus and drives: name of a shipped one, or path to a YAML file.")
    ] = "dextar_emulated"
    command_timeout_ms: Annotated[
        float,
        Setting(
            "Timeout from one torque command to the next, on the steady clock; then zero torque and a fault.",
            "ms",
            at_least=1.0,
            at_most=10_000.0,
        ),
    ] = 20.0
    enable_timeout_s: Annotated[
        float,
        Setting("Timeout for enabling, disabling or resetting the drives.", "s", at_least=0.1, at_most=60.0),
    ] = 2.0
    brake_limit_s: BrakeLimit = 0.0
    autostart: Annotated[bool, Setting("Configure and activate automatically, once the awaited nodes are ready.")] = (
        False
    )
    wait_for_nodes: AwaitedNodes = ()
    samples: LastSample = 0
