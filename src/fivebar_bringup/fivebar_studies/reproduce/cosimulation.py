# SPDX-License-Identifier: Apache-2.0
"""The inverse dynamics against an independent multi-body model: section 1.4.3, figures 1.17 and 1.18.

The thesis moved both motors by sin(t) / 10 and compared its model with ADAMS; here the other side is Pinocchio, from
its own velocities and accelerations on: the two share the parameters and the joint angles. Friction is off.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.pages.style import GREY, INK, MOTORS, PALE, house_style, new_figure, png
from fivebar_control.model.dynamics import inverse_dynamics
from fivebar_control.model.kinematics import (
    assembly_mode,
    platform_acceleration,
    state_from_motors,
    state_from_platform,
)
from fivebar_control.model.state import Leg
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.parameters import FiveBar, LegParameters

AMPLITUDE = 0.1
"""Amplitude of both motors' swing about where they start, rad; its frequency is 1 rad/s."""

THESIS_ERROR = 1e-8
"""Order of the error between the thesis' model and ADAMS, Nm."""

HOME = (0.0, 0.13)
"""Where the platform starts, m: the robot stays in one assembly mode throughout the swing."""

MODES = (1, -1)
"""Working mode of HOME: elbows outwards."""

LOWEST, HIGHEST = 1e-22, 1e0
"""Limits of the figure's logarithmic axis, Nm."""


class CoSimulation(NamedTuple):
    """Torques (Nm) of both models along one motion; n samples, motors 1 and 2.

    Attributes:
        time: [n], s.
        analytic: [n, 2], the closed-form model (1.30 without f).
        pinocchio: [n, 2], the two chains of the URDF, closed by Pinocchio.
    """

    time: FloatArray
    analytic: FloatArray
    pinocchio: FloatArray

    @property
    def difference(self) -> FloatArray:
        """Analytic minus Pinocchio, [n, 2], Nm."""
        return self.analytic - self.pinocchio


def co_simulate(
    robot: FiveBar, duration: float = 10.0, rate_hz: int = 500, actual: FiveBar | None = None
) -> CoSimulation:
    """Return both models' torques while both motors follow q0 + sin(t) / 10 for `duration` s, ends included.

    The swing is prescribed, so no error adds up: each sample is a comparison of its own. Pinocchio's side is `actual`,
    a robot of the same lengths, by default the same robot.
    """
    loop = ClosedLoop(robot if actual is None else actual)
    home = state_from_platform(robot, MODES, *HOME, 0.0, 0.0)
    assembly = assembly_mode(home)
    time = np.arange(round(duration * rate_hz) + 1) / rate_hz
    analytic, pinocchio = np.empty((len(time), 2)), np.empty((len(time), 2))
    for sample, t in enumerate(time.tolist()):
        swing, rate, bend = AMPLITUDE * math.sin(t), AMPLITUDE * math.cos(t), -AMPLITUDE * math.sin(t)
        q11, q21 = home.leg1.q1 + swing, home.leg2.q1 + swing
        state = state_from_motors(robot, assembly, q11, q21, rate, rate)
        analytic[sample] = inverse_dynamics(robot, state, bend, bend, 0.0, 0.0)
        place = platform_acceleration(state, bend, bend)
        legs = ((robot.leg1, state.leg1), (robot.leg2, state.leg2))
        q = np.array([angle for _, leg in legs for angle in (leg.q1, leg.q2)])
        v = np.array([speed for _, leg in legs for speed in (leg.dq1, leg.dtheta - leg.dq1)])
        a = np.array(
            [column for each, leg in legs for column in (bend, distal_acceleration(each, leg, bend, *place) - bend)]
        )
        pinocchio[sample] = loop.inverse_dynamics(q, v, a)
    return CoSimulation(time, analytic, pinocchio)


def distal_acceleration(parameters: LegParameters, leg: Leg, ddq1: float, ax: float, ay: float) -> float:
    """Return the angular acceleration (rad/s^2) of a distal link, of its motor's and the platform's (m/s^2).

    Solves xddot = l1 (ddq1 n - dq1^2 r) + l2 (ddtheta n' - dtheta^2 u) for ddtheta, along n'.
    """
    rest_x = ax - parameters.proximal * (-ddq1 * leg.r_y - leg.dq1**2 * leg.r_x)
    rest_y = ay - parameters.proximal * (ddq1 * leg.r_x - leg.dq1**2 * leg.r_y)
    return (-leg.u_y * rest_x + leg.u_x * rest_y) / parameters.distal


def draw_cosimulation(run: CoSimulation) -> bytes:
    """Return figures 1.17 and 1.18 as one PNG: the size of the error in each motor's torque, beside the torque's."""
    equal = float(np.mean(run.difference == 0.0))
    subtitle = (
        f"Both motors follow q₀ + sin(t)/10 for {run.time[-1]:g} s, friction off. Largest error "
        f"{_scientific(float(np.abs(run.difference).max()))} Nm; "
        f"{100.0 * equal:.0f} % of the torques are equal to the last bit (not drawn)"
    )
    with house_style():
        figure = new_figure("Torque of the analytic model minus Pinocchio", subtitle, height=6.0)
        panels = figure.subplots(2, 1, sharex=True)
        for motor, (axes, number) in enumerate(zip(panels, ("1.17", "1.18"), strict=True)):
            axes.set_title(f"Figure {number}: error in the torque of joint $q_{{{motor + 1}1}}$")
            _panel(axes, run, motor)
        panels[-1].set_xlabel("time in s")
        return png(figure)


def _panel(axes: Axes, run: CoSimulation, motor: int) -> None:
    error = np.abs(run.difference[:, motor])
    torque = np.abs(run.analytic[:, motor])
    axes.plot(
        run.time[error > 0.0],
        error[error > 0.0],
        linestyle="none",
        marker=".",
        markersize=2.0,
        color=MOTORS[motor],
        label="error, |analytic − Pinocchio|",
    )
    thesis = f"{_scientific(THESIS_ERROR)} Nm, the thesis' error against ADAMS"
    axes.axhline(THESIS_ERROR, color=INK, linestyle=(0, (5, 3)), linewidth=1.2, label=thesis)
    axes.plot(run.time, torque, color=GREY, linewidth=1.2, label="the torque itself")
    axes.set_yscale("log")
    axes.set_ylim(LOWEST, HIGHEST)
    axes.yaxis.set_major_locator(LogLocator(base=10.0, numticks=8))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_ylabel("magnitude in Nm")
    axes.legend(loc="center", bbox_to_anchor=(0.5, 0.37), ncols=3, markerscale=5.0)
    axes.spines["bottom"].set_color(PALE)


def _scientific(value: float) -> str:
    if value == 0.0:
        return "0"
    mantissa, exponent = f"{value:.1e}".split("e")
    return (
        f"{mantissa.removesuffix('.0')}·10{str(int(exponent)).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))}"
    )
