# SPDX-License-Identifier: Apache-2.0
"""A run as time series: the topics of its bag joined by stamp, and quantities computed from them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple

import numpy as np

from fivebar_bringup.bag.recording import FloatArray, IntArray, Recording
from fivebar_bringup.recorded.table import RunTable
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
    JOINT_STATES,
    JOINTS,
    TORQUE_REQUESTED,
    VISION_PLATFORM,
    Topic,
)
from fivebar_description.optional import CAMERA_ON, CAMERA_SERIES, optional_part
from fivebar_description.parameters import FiveBar
from fivebar_description.run_quantities import (
    ACCELERATION,
    COMMANDED_TORQUE,
    FEEDBACK_EFFORT,
    FEEDBACK_POSITION,
    FEEDBACK_VELOCITY,
    QUANTITIES,
    REFERENCE_RATE,
    REFERENCE_STATE,
    REQUESTED_TORQUE,
    SUPERVISION,
    TORQUE_OF_CONSTRAINT,
    TORQUE_OF_NOMINAL,
    TRUE_EFFORT,
    TRUE_POSITION,
    TRUE_VELOCITY,
)


class VisionSeries(NamedTuple):
    """Observations of the camera, in order of the exposures.

    Attributes:
        time: [n], of the exposures (s).
        position: [n, 2], x and y by the camera (m), NaN where it saw nothing.
        error: [n, 2], that minus the platform by the joints at the same time (m).
        true_error: [n, 2], that minus the exact platform (m).
    """

    time: FloatArray
    position: FloatArray
    error: FloatArray
    true_error: FloatArray


NOTHING_SEEN = VisionSeries(np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2)), np.zeros((0, 2)))


@dataclass(frozen=True)
class RunSeries:
    """A run as arrays over its n recorded samples of `joint_states`, in order of the samples.

    With an estimator or effects of the plant the samples, the joints and all that follows from them are those of
    `ground_truth`, the exact state, so that errors are errors of the robot. Commanded quantities (torques, sigma,
    kappa) stand in the row of the measurement that they answer, although they take effect `lead_samples` later; the
    reference stands in the row of its own time.

    A row is NaN where its topic has no message with the sample's stamp.

    Attributes:
        table: all recorded quantities, from which these follow.
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

    table: RunTable
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

    def __repr__(self) -> str:
        """Return how much there is in a line; `columns()` has the names."""
        columns = self.columns()
        samples = columns["t"].size
        return f"<RunSeries: {samples} samples of {len(columns)} quantities: {', '.join(list(columns)[:6])}, ...>"

    def columns(self) -> dict[str, FloatArray]:
        """Return the whole run as columns by name, [n] each: what follows from the run first, then what was recorded.

        Columns of which no value is known are left out; `UNITS` has the units.
        """
        by_name: dict[str, FloatArray] = {}
        for field, derived in DERIVED.items():
            values: FloatArray = np.asarray(getattr(self, field), dtype=np.float64).reshape(self.time.size, -1)
            if field in ALWAYS or not np.all(np.isnan(values)):
                by_name |= zip(derived.columns, values.T, strict=True)
        return by_name | {name: values for name, values in self.table.columns().items() if name not in by_name}

    @property
    def in_zone(self) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """bool[n]: where sigma > 0, false where it is not known."""
        return self.sigma > 0.0


class DerivedQuantity(NamedTuple):
    """A quantity that follows from the recorded ones: its columns with their units, and its meaning."""

    columns: tuple[str, ...]
    units: tuple[str, ...]
    meaning: str


DERIVED = {
    "time": DerivedQuantity(("t",), ("s",), "nominal time since sample 0"),
    "joint_position": DerivedQuantity(
        ("q11", "q12", "q21", "q22"), ("rad",) * 4, "joint angles, exact where these are recorded"
    ),
    "joint_velocity": DerivedQuantity(("dq11", "dq12", "dq21", "dq22"), ("rad/s",) * 4, "their rates"),
    "torque_applied": DerivedQuantity(
        ("tau1", "tau2"), ("Nm", "Nm"), "motor torques that acted over the period before the sample"
    ),
    "reference": DerivedQuantity(
        ("xd", "yd", "vxd", "vyd", "axd", "ayd"),
        ("m", "m", "m/s", "m/s", "m/s²", "m/s²"),
        "reference of the platform at the time of the sample",
    ),
    "platform": DerivedQuantity(
        ("x", "y", "vx", "vy"), ("m", "m", "m/s", "m/s"), "the platform by `q11` to `q22` and their rates"
    ),
    "sigma": DerivedQuantity(("sigma",), ("",), "blending weight of the constraint law"),
    "kappa": DerivedQuantity(("inverse_condition",), ("",), "1/cond(A)"),
    "tracking_error": DerivedQuantity(("error_x", "error_y"), ("m", "m"), "platform minus reference"),
    "det_a": DerivedQuantity(("det_a",), ("",), "det A; its sign is the assembly mode"),
    "vhc_error": DerivedQuantity(("h",), ("m",), "signed distance of the platform from the path segment"),
    "acceleration_error": DerivedQuantity(
        ("acceleration_error",), ("m/s²",), "magnitude of the acceleration by the IMU minus that of the reference"
    ),
    "estimate_error": DerivedQuantity(
        ("estimate_error",), ("m",), "distance of the estimated platform from the exact one, prediction included"
    ),
}
"""Quantities that follow from the recorded ones, by the field of :class:`RunSeries`, in the order of the columns."""

ALWAYS = frozenset(
    (
        "time",
        "joint_position",
        "joint_velocity",
        "torque_applied",
        "reference",
        "platform",
        "sigma",
        "kappa",
        "tracking_error",
    )
)
"""The fields whose columns a table always has, also where nothing is known of them."""


UNITS = {
    name: unit
    for columns, units in chain(
        ((quantity.columns, quantity.units) for quantity in QUANTITIES),
        ((quantity.columns, quantity.units) for quantity in DERIVED.values()),
    )
    for name, unit in zip(columns, units, strict=True)
    if name
}
"""The unit of every column by its name; "" for none."""


def nominal_topic(recording: Recording, scenario: Scenario) -> Topic:
    """Return the topic of the controller's nominal law.

    A law whose module is not imported is the only one of its run: its topic is the only candidate that was recorded.
    """
    known = scenario.scheme().nominal.topic
    candidates = recording.torque_candidates() if scenario.law_unopened else ()
    return candidates[0] if len(candidates) == 1 else known


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
    table = RunTable(
        recording,
        scenario.rate_hz,
        nominal_topic(recording, scenario),
        GROUND_TRUTH if truth else JOINT_STATES,
        scenario.passive.joint if scenario.passive.leg else "",
    )
    # a bag of a graph whose last node has no limits of its own has the command alone
    requested = REQUESTED_TORQUE if recording.count(TORQUE_REQUESTED) > 0 else COMMANDED_TORQUE
    time = table.sample / scenario.rate_hz
    position = table.values(TRUE_POSITION if truth else FEEDBACK_POSITION)
    velocity = table.values(TRUE_VELOCITY if truth else FEEDBACK_VELOCITY)
    effort = table.values(TRUE_EFFORT if truth else FEEDBACK_EFFORT)
    reference = np.hstack([table.values(REFERENCE_STATE), table.values(REFERENCE_RATE)[:, 2:]])
    if truth:
        reference = _at_their_own_time(reference, table.sample, scenario, plan)
    supervisor = table.values(SUPERVISION)
    there = scenario.actual_robot() if truth else robot
    states = [state_from_joints(there, *row) for row in np.hstack([position, velocity]).tolist()]
    platform = _rows([(state.x, state.y, state.vx, state.vy) for state in states], 4)
    constraint = _rows(
        [_constraint_errors(robot, plan, t, state) for t, state in zip(time.tolist(), states, strict=True)],
        3,
    )
    return RunSeries(
        table=table,
        robot=there,
        sample=table.sample,
        time=time,
        stamp_ns=table.stamp_ns,
        log_time_ns=table.log_time_ns,
        joint_position=position,
        joint_velocity=velocity,
        torque_applied=effort[:, [JOINTS.index(name) for name in ACTIVE_JOINTS]],
        torque_requested=table.values(requested),
        torque_nominal=table.values(TORQUE_OF_NOMINAL),
        torque_vhc=table.values(TORQUE_OF_CONSTRAINT),
        reference=reference,
        platform=platform,
        sigma=supervisor[:, 0],
        kappa=supervisor[:, 1],
        det_a=np.array([det_a(state) for state in states], dtype=np.float64),
        vhc_error=constraint[:, 0],
        vhc_error_joint=constraint[:, 1:],
        tracking_error=platform[:, :2] - reference[:, :2],
        acceleration_error=_acceleration_errors(
            ImuCheck(robot, plan.mode, scenario.rate_hz, scenario.imu),
            table.values(ACCELERATION),
            reference,
        ),
        estimate_error=_estimate_errors(robot, table, scenario, platform if truth else None),
        vision=_vision(robot, recording, table, scenario, platform if truth else None),
    )


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


def _estimate_errors(robot: FiveBar, table: RunTable, scenario: Scenario, platform: FloatArray | None) -> FloatArray:
    """Return [n], distance (m) of the platform by the published joints from the exact one [n, 4] at the same time."""
    errors = np.full(table.sample.size, math.nan)
    if not scenario.estimated or platform is None:
        return errors
    estimated = _platform_by_joints(robot, table)
    _, then, row = np.intersect1d(
        table.sample, table.sample + scenario.lead_samples, assume_unique=True, return_indices=True
    )
    errors[row] = np.hypot(*(estimated[row] - platform[then, :2]).T)
    return errors


def _vision(
    robot: FiveBar, recording: Recording, table: RunTable, scenario: Scenario, platform: FloatArray | None
) -> VisionSeries:
    """Return what the camera saw, against the published joints and, where it is known, the exact platform [n, 4]."""
    if recording.count(VISION_PLATFORM) == 0:
        return NOTHING_SEEN
    by_joints = _platform_by_joints(robot, table)
    known = np.isfinite(by_joints[:, 0])
    vision_series = optional_part(CAMERA_SERIES, CAMERA_ON)
    seen: VisionSeries = vision_series(
        recording,
        scenario.rate_hz,
        (table.sample[known] + scenario.lead_samples, by_joints[known]),
        None if platform is None else (table.sample, platform[:, :2]),
    )
    return seen


def _platform_by_joints(robot: FiveBar, table: RunTable) -> FloatArray:
    """Return [n, 2], the platform (m) by the published joints of the samples."""
    position, velocity = table.values(FEEDBACK_POSITION), table.values(FEEDBACK_VELOCITY)
    states = [state_from_joints(robot, *row) for row in np.hstack([position, velocity]).tolist()]
    return _rows([(state.x, state.y) for state in states], 2)


def _constraint_errors(robot: FiveBar, plan: Plan, t: float, state: State) -> tuple[float, float, float]:
    """Return h (m) and, for both motors, q_i1 minus that of the path point nearest to the platform (rad).

    NaN on segments that are not straight.
    """
    h, _, n_x, n_y = line_constraint(plan.path.line_at(t), state.x, state.y, state.vx, state.vy)
    on_path = inverse_geometry(robot, plan.mode_at(t), state.x - h * n_x, state.y - h * n_y)
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
