"""The settings of the control chain's nodes; those of a component that works without ROS too stand beside its code.

Nothing here needs ROS, so that the description of the graph can be made without it.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_control.laws.law import MIN_AUTHORITY
from fivebar_control.laws.registry import CONDITION, SIGMOID, find_law, law_problem
from fivebar_control.trajectory.limits import MotionLimits
from fivebar_control.trajectory.planner import QUINTIC, TimeLaw
from fivebar_description.interface import Topic
from fivebar_description.settings import Setting
from fivebar_description.shared_settings import (
    LONGEST_DELAY,
    WORKING_MODE,
    AwaitedNodes,
    LastSample,
    RateHz,
    Robot,
    WorkingMode,
)

ZONE_PREFIX = "zone_"
"""Of the parameters that hold `ZoneSettings`."""

NOT_OF_THE_FILTER = ("feed_forward",)
"""The setting of `EkfSettings` that is the graph's, not the state estimator's."""

NOT_OF_THE_GUARD = ("stop_cycles",)
"""The setting of `SafetySettings` that becomes the deadlines of several nodes."""

HOLD, CONTINUE = "hold", "continue"
BLENDED = "blended"

LeadSamples = Annotated[
    int,
    Setting(
        "Samples from a measurement to the moment that its answer is for: the drives' delay where an estimator"
        " predicts.",
        "samples",
        at_least=0,
        at_most=LONGEST_DELAY,
    ),
]


def _sign(assembly: int) -> str | None:
    return None if assembly in (-1, 1) else "expected +1 or -1"


def torque_of(candidates: str) -> Topic:
    """Return the topic of the law that works alone, or of the nominal law of a blended controller.

    Raises:
        InputError: there is no such law.
    """
    return find_law("ctc" if candidates == BLENDED else candidates).topic


def _no_such_law(candidates: str) -> str | None:
    return None if candidates == BLENDED else law_problem(candidates)


class MotionSettings(NamedTuple):
    """The motion: every node that needs the plan makes it from these, so there is one plan."""

    robot: Robot = "dextar"
    rate_hz: RateHz = 500
    working_mode: Annotated[
        tuple[int, ...],
        Setting(f"{WORKING_MODE.description} Two signs, or two for every waypoint of a motion that may meet Type 1."),
    ] = (1, -1)
    waypoints: Annotated[tuple[float, ...], Setting("Rest points of the path: x1, y1, x2, y2, ...", "m")] = (
        *(0.0, 0.15),
        *(0.0, 0.02),
        *(0.0, 0.15),
    )
    segment_durations: Annotated[tuple[float, ...], Setting("Duration of each segment.", "s")] = (1.0, 1.0)
    time_law: TimeLaw = QUINTIC
    min_authority: Annotated[
        float,
        Setting(
            "Least |n.v1| at a crossing of the Type 2 locus; 0 for a law that does not hold the path by its normal.",
            at_least=0.0,
            at_most=1.0,
        ),
    ] = MIN_AUTHORITY
    lead_samples: LeadSamples = 0


class TrajectorySettings(NamedTuple):
    """The trajectory generator, besides the motion."""

    after_fault: Annotated[
        str,
        Setting(
            "While safety/state reports a fault and after its reset: hold the position where the robot stands, or"
            " continue with the plan (for lockstep, where a run is to be the same each time).",
            choices=(HOLD, CONTINUE),
        ),
    ] = HOLD


class GoalSettings(NamedTuple):
    """Motions on request."""

    takes_goals: Annotated[
        bool, Setting("Accept requests on the topic goal: only where the unified controller follows.")
    ] = False
    goal_torque_limit: Annotated[
        float, Setting("Torque that both motors can give, for planning.", "Nm", at_least=1e-3, at_most=1e6)
    ] = MotionLimits().torque
    goal_speed_limit: Annotated[
        float, Setting("Largest speed of both motors, for planning.", "rad/s", at_least=1e-3, at_most=1e4)
    ] = MotionLimits().motor_speed


class SupervisorSettings(NamedTuple):
    """The supervisor, besides the motion."""

    weighting: Annotated[
        str,
        Setting(
            "What sigma follows: 1/cond(A), or a sigmoid in time around each planned crossing (for multi_model_ctc).",
            choices=(CONDITION, SIGMOID),
        ),
    ] = CONDITION


class BlenderSettings(NamedTuple):
    """The blender, besides the limits of `SafetySettings`."""

    robot: Robot = "dextar"
    rate_hz: RateHz = 500
    working_mode: WorkingMode = (1, -1)
    candidates: Annotated[
        str,
        Setting(
            "Blend ctc/torque and vhc/torque by sigma, or take the candidate of the named law alone.",
            check=_no_such_law,
        ),
    ] = BLENDED
    candidate_deadline_ms: Annotated[
        float,
        Setting(
            "Longest wait for the candidates of a sample, on the steady clock; then zero torque and a fault.",
            "ms",
            at_least=1.0,
            at_most=60_000.0,
        ),
    ] = 2000.0
    state_deadline_ms: Annotated[
        float,
        Setting(
            "Longest time from one sample to the next, on the steady clock; then zero torque and a fault. 0 for no"
            " limit, where time waits for the torques.",
            "ms",
            at_least=0.0,
            at_most=60_000.0,
        ),
    ] = 0.0
    last_sample: LastSample = 0


class EstimatorSettings(NamedTuple):
    """The state estimator, besides the drives and what the filter assumes."""

    robot: Robot = "dextar"
    rate_hz: RateHz = 500
    working_mode: WorkingMode = (1, -1)
    homing: Annotated[tuple[float, float], Setting("Where the platform stands at sample 0: x, y.", "m")] = (0.0, 0.15)
    assembly_mode: Annotated[int, Setting("Sign of det A in that posture.", at_least=-1, at_most=1, check=_sign)] = 1


class ImuListenerSettings(NamedTuple):
    """The IMU's listener, besides the IMU."""

    robot: Robot = "dextar"
    rate_hz: RateHz = 500
    working_mode: WorkingMode = (1, -1)
    lead_samples: LeadSamples = 0
    wait_for_nodes: AwaitedNodes = ()


class BridgeSettings(NamedTuple):
    """The bridge to the drives."""

    rate_hz: RateHz = 500
    drives: Annotated[str, Setting("Bus and drives: a shipped configuration's name or a path to a YAML file.")] = (
        "dextar_emulated"
    )
    command_timeout_ms: Annotated[
        float,
        Setting(
            "Longest time for which a torque holds, on the steady clock; then zero torque and a fault.",
            "ms",
            at_least=1.0,
            at_most=10_000.0,
        ),
    ] = 20.0
    enable_timeout_s: Annotated[
        float,
        Setting("Longest time for enabling, disabling or resetting the drives.", "s", at_least=0.1, at_most=60.0),
    ] = 2.0
    autostart: Annotated[
        bool, Setting("Configure and activate without a request, once the nodes to wait for are ready.")
    ] = False
    wait_for_nodes: AwaitedNodes = ()
