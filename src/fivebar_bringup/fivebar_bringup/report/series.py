"""A run as time series: the topics of its bag joined by stamp, and quantities computed from them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fivebar_bringup.errors import BagError
from fivebar_bringup.report.vision import NOTHING_SEEN, NOWHERE, PlatformTrack, VisionSeries, vision_series
from fivebar_bringup.runs.bag.recording import FloatArray, IntArray, Recording
from fivebar_bringup.scenario import Scenario
from fivebar_control.estimation.imu_check import ImuCheck
from fivebar_control.laws.vhc_cartesian import line_constraint
from fivebar_control.model.geometry import inverse_geometry, wrap
from fivebar_control.model.kinematics import det_a, state_from_joints
from fivebar_control.model.state import Platform, State
from fivebar_control.trajectory.planner import Plan
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    GROUND_TRUTH,
    IMU_DATA,
    JOINT_STATES,
    JOINTS,
    REFERENCE,
    REFERENCE_NAMES,
    SUPERVISOR_NAMES,
    SUPERVISOR_STATE,
    TORQUE_COMMAND,
    TORQUE_REQUESTED,
    VHC_TORQUE,
    VISION_PLATFORM,
    Topic,
)
from fivebar_description.parameters import FiveBar


@dataclass(frozen=True)
class RunSeries:
    """A run as arrays over its n recorded samples of `joint_states`, in order of the samples.

    With an estimator or effects of the plant the samples, the joints and all that follows from them are those of
    `ground_truth`, the exact state, so that errors are errors of the robot. Commanded quantities (torques, sigma,
    kappa) stand in the row of the measurement that they answer, although they take effect `lead_samples` later; the
    reference stands in the row of its own time.

    A row is NaN where its topic has no message with the sample's stamp. Of several messages with one stamp the first
    counts: a plant repeats sample 0 until it is answered, and the zero torque that a stopping blender publishes last
    carries the stamp of its last answer.

    Attributes:
        robot: to whose geometry the joints belong: the actual one with ground truth, else the nominal one.
        sample: int64[n], number of the sample; gaps are samples that were not recorded.
        time: [n], nominal time since sample 0 (s).
        stamp_ns: int64[n], the stamp (ns).
        log_time_ns: int64[n], when the sample was recorded (ns), a repeated one for the last time.
        joint_position: [n, 4], q11, q12, q21, q22 (rad).
        joint_velocity: [n, 4], their rates (rad/s).
        torque_applied: [n, 2], torques applied over the period before the sample (Nm).
        torque_requested: [n, 2], torques requested in answer to the sample (Nm), before all limits; NaN after a fault.
        torque_nominal: [n, 2], candidate of the nominal law, or of the only law (Nm).
        torque_vhc: [n, 2], candidate of the constraint law (Nm).
        reference: [n, 6], x, y (m), vx, vy (m/s), ax, ay (m/s^2).
        platform: [n, 4], x, y (m), vx, vy (m/s) from the joints.
        sigma: [n], blending weight.
        kappa: [n], 1 / cond(A).
        det_a: [n], det A from the joints; its sign is the assembly mode.
        vhc_error: [n], signed distance h of the platform from the current path segment (m).
        vhc_error_joint: [n, 2], q_i1 minus q_i1 of the path point nearest to the platform (rad), in (-pi, pi].
        tracking_error: [n, 2], platform minus reference, x and y (m).
        acceleration_error: [n], magnitude measured by the IMU minus the desired one (m/s^2).
        estimate_error: [n], distance (m) of the estimated platform from the actual one at the time that the estimate is
            for, `lead_samples` after the row's measurement: prediction included. NaN
            without an estimator, and where the run ended before that time.
        vision: what the camera saw; its rows are exposures, not samples.
    """

    robot: FiveBar
    sample: IntArray
    time: FloatArray
    stamp_ns: IntArray
    log_time_ns: IntArray
    joint_position: FloatArray
    joint_velocity: FloatArray
    torque_applied: FloatArray
    torque_requested: FloatArray
    torque_nominal: FloatArray
    torque_vhc: FloatArray
    reference: FloatArray
    platform: FloatArray
    sigma: FloatArray
    kappa: FloatArray
    det_a: FloatArray
    vhc_error: FloatArray
    vhc_error_joint: FloatArray
    tracking_error: FloatArray
    acceleration_error: FloatArray
    estimate_error: FloatArray
    vision: VisionSeries

    @property
    def in_zone(self) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """bool[n]: where sigma > 0, false where it is not known."""
        return self.sigma > 0.0


def read_series(recording: Recording, scenario: Scenario, planned: Plan | None = None) -> RunSeries:
    """Join a recording of a scenario's run by stamp; `planned` is what it was to do, by default the scenario's motion.

    On real drives there is no ground truth: then the joints are those that the estimator, or else the drives, have
    published, each for the time of the reference in the same sample, and nothing is known of their error.

    Raises:
        BagError: there are no joint states on the scenario's grid of stamps, or a topic does not have its content.
        InputError: the scenario's motion is refused.
    """
    robot, plan = scenario.five_bar(), scenario.plan() if planned is None else planned
    truth = scenario.has_ground_truth and recording.count(GROUND_TRUTH) > 0
    exact = GROUND_TRUTH if truth else JOINT_STATES
    join = _Join(recording, scenario.rate_hz, exact)
    # a bag of a graph whose last node has no limits of its own has the command alone
    requested = TORQUE_REQUESTED if recording.count(TORQUE_REQUESTED) > 0 else TORQUE_COMMAND
    time = join.sample / scenario.rate_hz
    position = join.values(exact, JOINTS, "position")
    velocity = join.values(exact, JOINTS, "velocity")
    reference = np.hstack(
        [
            join.values(REFERENCE, REFERENCE_NAMES, "position"),
            join.values(REFERENCE, REFERENCE_NAMES, "velocity")[:, 2:],
        ]
    )
    if truth:
        reference = _at_their_own_time(reference, join.sample, scenario, plan)
    supervisor = join.values(SUPERVISOR_STATE, SUPERVISOR_NAMES, "position")
    there = scenario.actual_robot() if truth else robot
    states = [state_from_joints(there, *row) for row in np.hstack([position, velocity]).tolist()]
    platform = _rows([(state.x, state.y, state.vx, state.vy) for state in states], 4)
    constraint = _rows(
        [_constraint_errors(robot, plan, t, state) for t, state in zip(time.tolist(), states, strict=True)],
        3,
    )
    return RunSeries(
        robot=there,
        sample=join.sample,
        time=time,
        stamp_ns=join.stamp_ns,
        log_time_ns=join.log_time_ns,
        joint_position=position,
        joint_velocity=velocity,
        torque_applied=join.values(exact, JOINTS, "effort")[:, [JOINTS.index(name) for name in ACTIVE_JOINTS]],
        torque_requested=join.values(requested, ACTIVE_JOINTS, "effort"),
        torque_nominal=join.values(scenario.scheme().nominal.topic, ACTIVE_JOINTS, "effort"),
        torque_vhc=join.values(VHC_TORQUE, ACTIVE_JOINTS, "effort"),
        reference=reference,
        platform=platform,
        sigma=supervisor[:, 0],
        kappa=supervisor[:, 1],
        det_a=np.array([det_a(state) for state in states], dtype=np.float64),
        vhc_error=constraint[:, 0],
        vhc_error_joint=constraint[:, 1:],
        tracking_error=platform[:, :2] - reference[:, :2],
        acceleration_error=_acceleration_errors(
            ImuCheck(robot, plan.mode1, plan.mode2, scenario.rate_hz, scenario.imu),
            join.accelerations(),
            reference,
        ),
        estimate_error=_estimate_errors(robot, join, scenario, platform if truth else None),
        vision=_vision(robot, recording, join, scenario, platform if truth else None),
    )


class _Join:
    """The samples of the topic that holds the joints, and other topics on them."""

    def __init__(self, recording: Recording, rate_hz: int, joints: Topic) -> None:
        self._recording = recording
        self._rate_hz = rate_hz
        numbers = recording.samples(joints, rate_hz)
        if numbers.size and np.all(numbers < 0):
            raise BagError(recording.path, f"/{joints.name}: no stamp is on the grid of {rate_hz} Hz from the epoch on")
        last_first = numbers[::-1]
        self.sample, last = np.unique(last_first[last_first >= 0], return_index=True)
        self.log_time_ns = recording.log_times(joints)[::-1][last_first >= 0][last]
        self.stamp_ns = recording.stamps(joints)[::-1][last_first >= 0][last]

    def values(self, topic: Topic, names: Sequence[str], field: str) -> FloatArray:
        """Return [n, len(names)], one field of a topic of JointState in the order of the names."""
        recording = self._recording
        if recording.count(topic) == 0:
            return np.full((self.sample.size, len(names)), math.nan)
        recorded = recording.joint_names(topic)
        if missing := [name for name in names if name not in recorded]:
            raise BagError(recording.path, f"/{topic.name}: has no {', '.join(missing)}, only {', '.join(recorded)}")
        values = recording.field(topic, field)
        if values.shape[1] == 0:
            return np.full((self.sample.size, len(names)), math.nan)
        if values.shape[1] != len(recorded):
            raise BagError(
                recording.path, f"/{topic.name}: {field} holds {values.shape[1]} values for {len(recorded)} names"
            )
        return self._on_samples(topic, values[:, [recorded.index(name) for name in names]])

    def accelerations(self) -> FloatArray:
        """Return [n, 3], the acceleration in the IMU's own frame (m/s^2)."""
        if self._recording.count(IMU_DATA) == 0:
            return np.full((self.sample.size, 3), math.nan)
        return self._on_samples(IMU_DATA, self._recording.field(IMU_DATA, "linear_acceleration"))

    def _on_samples(self, topic: Topic, values: FloatArray) -> FloatArray:
        numbers, first = np.unique(self._recording.samples(topic, self._rate_hz), return_index=True)
        joined = np.full((self.sample.size, values.shape[1]), math.nan)
        _, here, there = np.intersect1d(self.sample, numbers, assume_unique=True, return_indices=True)
        joined[here] = values[first[there]]
        return joined


def _rows(rows: list[tuple[float, ...]], width: int) -> FloatArray:
    return np.array(rows, dtype=np.float64).reshape(len(rows), width)


def _at_their_own_time(recorded: FloatArray, sample: IntArray, scenario: Scenario, plan: Plan) -> FloatArray:
    """Return the references [n, 6] in the rows of the times that they are for.

    Each was recorded `lead_samples` earlier; those of the first samples were never sent and come from the plan.
    """
    lead = scenario.lead_samples
    if lead == 0:
        return recorded
    moved = np.full_like(recorded, math.nan)
    _, here, there = np.intersect1d(sample, sample + lead, assume_unique=True, return_indices=True)
    moved[here] = recorded[there]
    for row in np.flatnonzero(sample < lead):
        moved[row] = plan.path.at(int(sample[row]) / scenario.rate_hz)
    return moved


def _estimate_errors(robot: FiveBar, join: _Join, scenario: Scenario, platform: FloatArray | None) -> FloatArray:
    """Return [n], distance (m) of the platform by the published joints from the exact one [n, 4] at the same time."""
    errors = np.full(join.sample.size, math.nan)
    if not scenario.estimated or platform is None:
        return errors
    estimated = _platform_by_joints(robot, join)
    _, then, row = np.intersect1d(
        join.sample, join.sample + scenario.lead_samples, assume_unique=True, return_indices=True
    )
    errors[row] = np.hypot(*(estimated[row] - platform[then, :2]).T)
    return errors


def _vision(
    robot: FiveBar, recording: Recording, join: _Join, scenario: Scenario, platform: FloatArray | None
) -> VisionSeries:
    """Return what the camera saw, against the published joints and, where it is known, the exact platform [n, 4]."""
    if recording.count(VISION_PLATFORM) == 0:
        return NOTHING_SEEN
    by_joints = _platform_by_joints(robot, join)
    known = np.isfinite(by_joints[:, 0])
    return vision_series(
        recording,
        scenario.rate_hz,
        PlatformTrack(join.sample[known] + scenario.lead_samples, by_joints[known]),
        NOWHERE if platform is None else PlatformTrack(join.sample, platform[:, :2]),
    )


def _platform_by_joints(robot: FiveBar, join: _Join) -> FloatArray:
    """Return [n, 2], the platform (m) by the published joints of the samples."""
    position = join.values(JOINT_STATES, JOINTS, "position")
    velocity = join.values(JOINT_STATES, JOINTS, "velocity")
    states = [state_from_joints(robot, *row) for row in np.hstack([position, velocity]).tolist()]
    return _rows([(state.x, state.y) for state in states], 2)


def _constraint_errors(robot: FiveBar, plan: Plan, t: float, state: State) -> tuple[float, float, float]:
    """Return h (m) and, for both motors, q_i1 minus that of the path point nearest to the platform (rad).

    NaN on segments that are not straight.
    """
    h, _, n_x, n_y = line_constraint(plan.path.line_at(t), state.x, state.y, state.vx, state.vy)
    on_path = inverse_geometry(robot, *plan.modes_at(t), state.x - h * n_x, state.y - h * n_y)
    return h, _turn(state.leg1.q1 - on_path.q11), _turn(state.leg2.q1 - on_path.q21)


def _acceleration_errors(check: ImuCheck, measured: FloatArray, reference: FloatArray) -> FloatArray:
    """Return [n] from the accelerations [n, 3] and the reference [n, 6], sample by sample as in `imu_listener`.

    It is computed again because the recorded errors carry no stamp that would reveal a lost one.
    """
    errors = np.full(len(measured), math.nan)
    for row in np.flatnonzero(np.all(np.isfinite(measured), axis=1) & np.all(np.isfinite(reference), axis=1)):
        x, y, z = measured[row].tolist()
        errors[row] = check.error((x, y, z), Platform(*reference[row].tolist()))
    return errors


def _turn(angle: float) -> float:
    """Return the angle in (-pi, pi], NaN where it is unknown."""
    return wrap(angle) if math.isfinite(angle) else math.nan
