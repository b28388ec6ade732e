# SPDX-License-Identifier: Apache-2.0
"""A bound on the distance from the reference, before a run: the tube of `unified` and of `mpc`.

Along the reference the closed loop is a linear time-varying system: the error and its derivative, the estimated
disturbance, and for `mpc` the torques that it has planned. What the motion asks for and the law cannot give near the
locus drives it, and so does a disturbance torque. The first response is computed as it is; of the second, which is
known by a bound alone, the sum of the norms of all responses to single samples, which no disturbance within the bound
exceeds. docs/bounds.md says what is proved by that and what is assumed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.laws.gains import UnifiedSettings
from fivebar_control.laws.mpc import MpcSettings
from fivebar_control.laws.mpc_problem import weights_of
from fivebar_control.laws.reference import held_torque
from fivebar_control.laws.unified import input_map
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar

FloatArray = NDArray[np.float64]

REMAINDER, FLOOR = 0.5, 2e-5
"""Assumed remainder of the linear system: a share of its response, and a distance (m)."""

STEPS = 1e-6, 1e-6, 1e-4, 1e-4
"""Steps (m, m, m/s, m/s) of the differences of a_0."""


class Mismatch(NamedTuple):
    """How far the robot may be from its model.

    Attributes:
        scale: of mass and inertias, as a share: 0.1 for 0.9 to 1.1 times what is believed.
        friction: of the Coulomb friction, the same.
    """

    scale: float = 0.0
    friction: float = 0.0


class Along(NamedTuple):
    """The model at the samples of a reference, n of them.

    Attributes:
        reference: float64[n, 6], position, velocity and acceleration.
        inputs: float64[n, 2, 2], G.
        drift: float64[n, 2], a_0.
        slopes: float64[n, 2, 4], the derivative of a_0 by position and velocity.
        held: float64[n, 2], torques beyond friction (Nm) that hold what acts all the time.
    """

    reference: FloatArray
    inputs: FloatArray
    drift: FloatArray
    slopes: FloatArray
    held: FloatArray


class ErrorDynamics(NamedTuple):
    """A closed loop along a reference: z+ = F z + c + D delta, of whose state the first two are the error (m).

    Attributes:
        transitions: float64[n, states, states].
        forcing: float64[n, states].
        disturbing: float64[n, states, 2], of the disturbance torques (Nm).
        torques: float64[n, 2], beyond friction, that the law gives to the response without a disturbance (Nm).
    """

    transitions: FloatArray
    forcing: FloatArray
    disturbing: FloatArray
    torques: FloatArray


class Tube(NamedTuple):
    """A bound on the distance from the reference at every sample.

    Attributes:
        nominal: float64[n + 1], distance of the linear system without a mismatch (m).
        radius: float64[n + 1], the bound (m).
    """

    nominal: FloatArray
    radius: FloatArray


def tube(robot: FiveBar, plan: Plan, rate_hz: int, law: UnifiedSettings | MpcSettings, mismatch: Mismatch) -> Tube:
    """Return the tube of a plan under a law with these settings, without limits of the torque.

    Args:
        robot: as the law models it.
        plan: to be followed, in platform coordinates throughout.
        rate_hz: of the law.
        law: settings, from exact states.
        mismatch: of the robot.
    """
    ahead = law.horizon if isinstance(law, MpcSettings) else 1
    along = model_along(robot, plan, rate_hz, ahead)
    period = 1.0 / rate_hz
    loop = _mpc_loop(along, period, law) if isinstance(law, MpcSettings) else _unified_loop(along, period, law)
    bound = _disturbance_bound(robot, plan, along, loop.torques, mismatch)
    steps, states = loop.forcing.shape
    response, nominal = np.zeros(states), np.zeros(steps + 1)
    # of each sample so far: the response to a disturbance torque of each motor at that sample
    single = np.zeros((steps, states, 2))
    disturbed = np.zeros(steps + 1)
    for k in range(steps):
        response = loop.transitions[k] @ response + loop.forcing[k]
        single[:k] = loop.transitions[k] @ single[:k]
        single[k] = loop.disturbing[k] * bound[k]
        nominal[k + 1] = math.hypot(response[0], response[1])
        disturbed[k + 1] = np.sqrt(np.sum(single[: k + 1, :2] ** 2, axis=1)).sum()
    return Tube(nominal, FLOOR + (1.0 + REMAINDER) * (nominal + disturbed))


def model_along(robot: FiveBar, plan: Plan, rate_hz: int, ahead: int) -> Along:
    """Return the model at the samples of a plan, and at `ahead` more of the rest after it.

    Raises:
        ValueError: the model is not defined somewhere, as at Type 1.
    """

    def mapped(place: FloatArray) -> FloatArray:
        found = input_map(robot, state_from_platform(robot, plan.mode, *place.tolist()))
        if found is None or math.isnan(found.g_x1):
            raise ValueError("the model is not defined on the reference")
        return np.array(found)

    count = plan.path.samples(rate_hz) + 1 + ahead
    reference = np.array([plan.path.at(number / rate_hz) for number in range(count)])
    maps = np.array([mapped(place[:4]) for place in reference])
    slopes = np.zeros((count, 2, 4))
    for number, place in enumerate(reference[:, :4]):
        for column, step in enumerate(STEPS):
            moved = np.eye(4)[column] * step
            slopes[number, :, column] = (mapped(place + moved) - mapped(place - moved))[4:] / (2.0 * step)
    states = [state_from_platform(robot, plan.mode, *place[:4].tolist()) for place in reference]
    held = [held_torque(robot, state, *place[4:].tolist()) for state, place in zip(states, reference, strict=True)]
    return Along(reference, maps[:, :4].reshape(count, 2, 2), maps[:, 4:], slopes, np.array(held))


def _plant(along: Along, k: int, period: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return F, c and H of the error over a sample: xi+ = F xi + c + H u, u the torques beyond friction."""
    before, after = along.reference[k], along.reference[k + 1]
    inputs = 0.5 * (along.inputs[k] + along.inputs[k + 1])
    drift = 0.5 * (along.drift[k] + along.drift[k + 1])
    hold = np.vstack((0.5 * period * period * np.eye(2), period * np.eye(2)))
    transition = np.eye(4)
    transition[:2, 2:] = period * np.eye(2)
    # the platform is at x_d - e, so that a_0 there is less by its slope times the error
    transition += hold @ along.slopes[k]
    moved = np.concatenate((after[:2] - before[:2] - period * before[2:4], after[2:4] - before[2:4]))
    return transition, moved - hold @ drift, -hold @ inputs


def _with_law(
    along: Along,
    k: int,
    period: float,
    gain: FloatArray,
    fixed: FloatArray,
    inner: tuple[FloatArray, FloatArray],
    observer: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return F, c and D of the closed loop at a sample.

    Args:
        along: the model.
        k: the sample.
        period: s.
        gain, fixed: u = gain (xi, inner state) + fixed, beyond friction.
        inner: the law's inner state after the sample, as a matrix of (xi, inner state), and a constant.
        observer: how much of an unknown torque the law's observer learns in a sample.
    """
    transition, constant, inputs = _plant(along, k, period)
    within = gain.shape[1] - 4
    states = 4 + within + 2
    whole, forcing, disturbing = np.zeros((states, states)), np.zeros(states), np.zeros((states, 2))
    whole[:4, :4] = transition
    whole[:4, : 4 + within] += inputs @ gain
    whole[:4, -2:] = -inputs
    whole[4:-2, : 4 + within] = inner[0]
    whole[-2:, -2:] = np.eye(2) - observer
    forcing[:4] = constant + inputs @ fixed
    forcing[4:-2] = inner[1]
    disturbing[:4], disturbing[-2:] = inputs, observer
    return whole, forcing, disturbing


def _observer(along: Along, k: int, period: float, rate: float, weight: float) -> FloatArray:
    inputs = along.inputs[k]
    share = np.linalg.solve(inputs.T @ inputs + weight * np.eye(2), inputs.T @ inputs)
    return np.asarray((1.0 - math.exp(-rate * period)) * share)


def _unified_loop(along: Along, period: float, law: UnifiedSettings) -> ErrorDynamics:
    steps = len(along.reference) - 2
    nothing = np.zeros((0, 4)), np.zeros(0)

    def at(k: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        inputs = along.inputs[k]
        normal = inputs.T @ inputs + law.weight * np.eye(2)
        inverse = np.linalg.solve(normal, inputs.T)
        feedback = np.hstack((law.kp * np.eye(2), law.kd * np.eye(2))) + along.slopes[k]
        gain, fixed = inverse @ feedback, inverse @ (along.reference[k, 4:] - along.drift[k])
        fixed = fixed + np.linalg.solve(normal, law.weight * along.held[k])
        observer = _observer(along, k, period, law.observer_rate, law.weight)
        return gain, fixed, *_with_law(along, k, period, gain, fixed, nothing, observer)

    parts = [at(k) for k in range(steps)]
    return _closed(parts, 4)


def _mpc_loop(along: Along, period: float, law: MpcSettings) -> ErrorDynamics:
    count = law.horizon
    steps = len(along.reference) - count - 1
    weights = weights_of(count, period, law.speed_time, law.end_weight, law.step_weight, law.weight)
    means = 0.5 * (along.inputs[:-1] + along.inputs[1:])
    drifts = 0.5 * (along.drift[:-1] + along.drift[1:])
    shift = np.eye(2 * count, k=2)
    shift[-2:, -2:] = np.eye(2)

    def at(k: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        inputs, ahead = means[k : k + count], along.reference[k + 1 : k + 1 + count]
        here = along.reference[k]
        flat = inputs.transpose(1, 0, 2).reshape(2, 2 * count)
        hessian = np.kron(weights.quadratic, np.ones((2, 2))) * (flat.T @ flat) + weights.torques
        # errors at the ends of the intervals without any torque: of the reference, and per error of the state
        place = ahead[:, :2] - here[:2] - weights.times[:, None] * here[2:4] - weights.to_place @ drifts[k : k + count]
        speed = ahead[:, 2:4] - here[2:4] - weights.to_speed @ drifts[k : k + count]
        pull = weights.from_place @ place + weights.from_speed @ speed
        per_place = weights.from_place.sum(axis=1)
        per_speed = weights.from_place @ weights.times + weights.from_speed.sum(axis=1)
        right = np.zeros((2 * count, 4 + 2 * count + 1))
        for axis in range(2):
            right[:, axis] = (per_place[:, None] * inputs[:, axis]).reshape(-1)
            right[:, 2 + axis] = (per_speed[:, None] * inputs[:, axis]).reshape(-1)
        if k > 0:
            right[:, 4:-1] = weights.steps
        right[:, -1] = np.einsum("na,nam->nm", pull, inputs).reshape(-1)
        solved = np.linalg.solve(hessian, right)
        inner = np.asarray(shift @ solved[:, :-1], np.float64), np.asarray(shift @ solved[:, -1], np.float64)
        observer = _observer(along, k, period, law.observer_rate, law.fallback_weight)
        gain, fixed = np.asarray(solved[:2, :-1], np.float64), np.asarray(solved[:2, -1], np.float64)
        return gain, fixed, *_with_law(along, k, period, gain, fixed, inner, observer)

    return _closed([at(k) for k in range(steps)], 4 + 2 * count)


def _closed(
    parts: list[tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]], states: int
) -> ErrorDynamics:
    gains, fixed, transitions, forcing, disturbing = (np.array(part) for part in zip(*parts, strict=True))
    response, torques = np.zeros(forcing.shape[1]), np.zeros((len(parts), 2))
    for k in range(len(parts)):
        torques[k] = gains[k] @ response[:states] + fixed[k]
        response = transitions[k] @ response + forcing[k]
    return ErrorDynamics(transitions, forcing, disturbing, torques)


def _disturbance_bound(robot: FiveBar, plan: Plan, along: Along, torques: FloatArray, mismatch: Mismatch) -> FloatArray:
    """Return float64[n, 2], how large the disturbance torque of each motor may be (Nm).

    What a motor of a robot with other inertias falls short of is a share of what its own inertia and its distal link
    take: ZZ q'' and B lambda, in the motion that the robot makes.
    """
    bounds = np.zeros((len(torques), 2))
    friction = robot.leg1.coulomb, robot.leg2.coulomb
    for k, (torque1, torque2) in enumerate(torques.tolist()):
        state = state_from_platform(robot, plan.mode, *along.reference[k, :4].tolist())
        motion = direct_dynamics(robot, state, torque1, torque2, 0.0, 0.0)
        own = robot.leg1.inertia * motion.ddq11, robot.leg2.inertia * motion.ddq21
        for motor, torque in enumerate((torque1, torque2)):
            taken = abs(own[motor]) + abs(torque - own[motor])
            bounds[k, motor] = mismatch.scale * taken + mismatch.friction * friction[motor]
    return bounds
