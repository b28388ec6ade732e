"""One crossing as numbers: what the compiled loop is given."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_bringup.scenario import Scenario
from fivebar_control.estimation.ekf import FilterModel, filter_model
from fivebar_control.laws.adaptive_gain import AdaptiveGainSettings
from fivebar_control.laws.laws import SIGMOID
from fivebar_control.laws.multi_model import sigmoid_weight
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.resolution import RESOLUTIONS
from fivebar_control.laws.unified import UnifiedSettings
from fivebar_control.model.state import Leg
from fivebar_control.safety.stages import Area
from fivebar_control.trajectory.desired import desired_at
from fivebar_control.trajectory.joint_segment import JointSegment
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar, LegParameters, scaled
from fivebar_sim.plant import MAX_STEP

FloatArray = NDArray[np.float64]

CTC, UNIFIED = 0, 1
"""Laws away from the locus, or everywhere."""

NO_LAW, REDUCED_CTC, VHC_JOINT, VHC_CARTESIAN = 0, 1, 2, 3
"""Laws on the locus."""

AWAY = {"ctc": CTC, "unified": UNIFIED}
ON_LOCUS = {None: NO_LAW, "reduced_ctc": REDUCED_CTC, "vhc_joint": VHC_JOINT, "vhc_cartesian": VHC_CARTESIAN}
MIN_NORM, FULL_FRICTION, FULL_INVERSE = 0, 1, 2
"""Resolutions of the torque on the locus, in the order of `RESOLUTIONS`."""

X, Y, VX, VY, AX, AY, DIRECTION_X, DIRECTION_Y, EPSILON, WEIGHT = range(10)
"""Columns of a sampled plan: the reference (m, s), the direction of its straight segment (NaN where it is none), the
zone width, and the weight in time of the multi-model method."""

REFERENCE_FIELDS = 2 * len(Leg._fields) + 4 + len(Reference._fields) - 1
"""Figures of a `Reference`, one after the other."""


class Sampled(NamedTuple):
    """A plan at the moments of its samples.

    Attributes:
        rows: float64[N + 1 + lead, 10] in the columns above; the lead is the drives' delay where there is an estimator.
        references: float64[N + 1 + lead, REFERENCE_FIELDS] where the plan was made in the motors' angles in part; else
            [0, REFERENCE_FIELDS], and the loop works the references out.
    """

    rows: FloatArray
    references: FloatArray


class Safety(NamedTuple):
    """What the guard allows: `SafetySettings` in floats, infinite for none.

    Attributes:
        torque_limit: largest commanded torque (Nm).
        torque_step: largest change of it from sample to sample (Nm).
        joint_speed: largest motor speed (rad/s).
        workspace: where the platform may be (m).
        type1_margin: least |sin q_i2|, 0 for no such limit.
        tracking_error: largest distance from the reference (m).
    """

    torque_limit: float
    torque_step: float
    joint_speed: float
    workspace: Area
    type1_margin: float
    tracking_error: float


EVERYWHERE = Area(-math.inf, math.inf, -math.inf, math.inf)


class Laws(NamedTuple):
    """The controller: which laws, and their gains as in the sections `gains`, `unified`, `adaptive_gain`.

    Attributes:
        away: `CTC` or `UNIFIED`.
        on_locus: `NO_LAW`, `REDUCED_CTC`, `VHC_JOINT` or `VHC_CARTESIAN`.
        weighted_in_time: sigma from the plan's column `weight` instead of from cond(A).
        resolution: `MIN_NORM`, `FULL_FRICTION` or `FULL_INVERSE`.
        kp, kd, kp_vhc, kd_vhc: gains (1/s^2, 1/s).
        unified: of the law without switching.
        adaptive: whether the adaptive gain is on.
        adaptive_gain: its settings.
    """

    away: int
    on_locus: int
    weighted_in_time: bool
    resolution: int
    kp: float
    kd: float
    kp_vhc: float
    kd_vhc: float
    unified: UnifiedSettings
    adaptive: bool
    adaptive_gain: AdaptiveGainSettings


class Equipment(NamedTuple):
    """Drives and encoders.

    Attributes:
        torque_limit: of the drives (Nm), infinite for none.
        torque_quantum: step of the applied torque (Nm), 0 for continuous.
        delay_samples: periods between a command and its effect.
        encoder_counts: per revolution, 0 for exact sensors.
    """

    torque_limit: float
    torque_quantum: float
    delay_samples: int
    encoder_counts: int


class Estimation(NamedTuple):
    """The estimator: whether there is one, whether the laws take its disturbances, its filter, limits of ambiguity."""

    on: bool
    feed_forward: bool
    model: FilterModel
    mirror_deviations: float
    dwell_limit: float


class Case(NamedTuple):
    """One crossing.

    Attributes:
        believed: the robot that controllers and estimator believe in.
        actual: the robot that there is; its lengths may differ too.
        mode1, mode2: working mode.
        rate_hz: samples per second.
        steps, step: integration steps per sample, and their length (s).
        laws, equipment, estimation, safety: see there.
        stop_at_fault: end the run at its first fault, instead of letting the robot coast as the offline runner does.
    """

    believed: FiveBar
    actual: FiveBar
    mode1: int
    mode2: int
    rate_hz: int
    steps: int
    step: float
    laws: Laws
    equipment: Equipment
    estimation: Estimation
    safety: Safety
    stop_at_fault: bool


def case_of(scenario: Scenario, actual: FiveBar | None = None, stop_at_fault: bool = False) -> Case:
    """Return a scenario's case; `actual` takes the place of the robot that its section `plant` describes.

    The seed and the section `imu` have no part in it: no controller reads the IMU, and nothing else is random.
    """
    believed = _as_floats(scenario.five_bar())
    plant, gains, scheme = scenario.plant, scenario.gains, scenario.scheme()
    if actual is None:
        actual = scaled(believed, plant.mass_scale, plant.inertia_scale, plant.friction_scale)
    mode1, mode2 = scenario.working_mode
    period = 1.0 / scenario.rate_hz
    steps = math.ceil(period / MAX_STEP - 1e-9)
    adaptive = scenario.adaptive_gain.as_settings()
    alpha, error_limit, keep_damping = adaptive if adaptive is not None else AdaptiveGainSettings()
    unified = scenario.unified_settings()
    settings = scenario.ekf.as_settings()
    return Case(
        believed=believed,
        actual=_as_floats(actual),
        mode1=int(mode1),
        mode2=int(mode2),
        rate_hz=scenario.rate_hz,
        steps=steps,
        step=period / steps,
        laws=Laws(
            away=AWAY[scheme.away],
            on_locus=ON_LOCUS[scheme.on_locus],
            weighted_in_time=scheme.weighting == SIGMOID,
            resolution=list(RESOLUTIONS).index(scenario.vhc_resolution),
            kp=float(gains.kp),
            kd=float(gains.kd),
            kp_vhc=float(gains.kp_vhc),
            kd_vhc=float(gains.kd_vhc),
            unified=UnifiedSettings(*(float(value) for value in unified)),
            adaptive=adaptive is not None,
            adaptive_gain=AdaptiveGainSettings(float(alpha), float(error_limit), bool(keep_damping)),
        ),
        equipment=Equipment(
            torque_limit=math.inf if plant.torque_limit is None else float(plant.torque_limit),
            torque_quantum=float(plant.torque_quantum),
            delay_samples=plant.delay_samples,
            encoder_counts=plant.encoder_counts or 0,
        ),
        estimation=Estimation(
            scenario.estimated,
            scenario.makes_up,
            filter_model(believed, int(mode1), int(mode2), scenario.rate_hz, settings),
            float(settings.mirror_deviations),
            float(settings.dwell_limit),
        ),
        safety=_safety(scenario),
        stop_at_fault=stop_at_fault,
    )


def _as_floats(robot: FiveBar) -> FiveBar:
    """Return a robot whose figures are floats to the last: an integer among them is another type to the compiler."""
    leg1, leg2, mass = robot
    return FiveBar(LegParameters(*map(float, leg1)), LegParameters(*map(float, leg2)), float(mass))


def _safety(scenario: Scenario) -> Safety:
    settings = scenario.safety_settings()
    return Safety(
        torque_limit=float(settings.torque_limit),
        torque_step=settings.torque_rate_limit / scenario.rate_hz,
        joint_speed=float(settings.joint_speed_limit),
        workspace=Area(*map(float, settings.workspace if settings.workspace is not None else EVERYWHERE)),
        type1_margin=float(settings.type1_margin),
        tracking_error=float(settings.tracking_error_limit),
    )


def sampled(robot: FiveBar, plan: Plan, rate_hz: int, lead_samples: int = 0) -> Sampled:
    """Return the plan of a robot at the moments of its samples 0 to N and of the lead.

    It serves every case that follows the plan at that rate, believes in that robot and has that lead.
    """
    times = [crossing.time for crossing in plan.crossings]
    moments = [number / rate_hz for number in range(plan.path.samples(rate_hz) + 1 + lead_samples)]
    platforms = [plan.path.at(t) for t in moments]
    rows = [
        (*platform, *plan.path.line_at(t)[2:], plan.epsilon_at(t), sigmoid_weight(t, times, plan.zone_time))
        for t, platform in zip(moments, platforms, strict=True)
    ]
    references: list[list[float]] = []
    if any(isinstance(segment, JointSegment) for segment in plan.path.segments):
        desired = [desired_at(robot, plan, t, platform) for t, platform in zip(moments, platforms, strict=True)]
        references = [[*one.state.leg1, *one.state.leg2, *one.state[2:], *one[1:]] for one in desired]
    return Sampled(
        np.array(rows, dtype=np.float64),
        np.array(references, dtype=np.float64).reshape(len(references), REFERENCE_FIELDS),
    )
