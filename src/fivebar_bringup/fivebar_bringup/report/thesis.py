# SPDX-License-Identifier: Apache-2.0
"""The thesis' results for the same motion: the counterparts of the report's figures."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_bringup.scenario import Scenario

Waypoints = tuple[tuple[float, float], ...]

A, B = (0.0, 0.15), (0.0, 0.035)
C, D = (-0.025, 0.025), (-0.025, 0.125)
E, F = (0.025, 0.025), (0.025, 0.125)

MIDDLE: Waypoints = (A, (0.0, 0.02), A)
MULTIPLE: Waypoints = (A, B, A, B, A, C, D, A, E, F, A)

JOINT, CARTESIAN = "multi_joint", "multi_cartesian"


class Counterpart(NamedTuple):
    """Where the thesis shows the same as one of the report's figures; each is a phrase that ends a sentence."""

    path: str
    torque: str
    vhc_error: str
    vhc_error_joint: str
    acceleration: str


class ThesisFigures(NamedTuple):
    """The thesis' statements on a run, for the table of results; None where it states nothing."""

    mode_changes: str | None = None
    torque: str | None = None
    vhc_error: str | None = None
    vhc_error_joint: str | None = None


def counterpart(scenario: Scenario) -> Counterpart:
    """Return where the thesis shows what a scenario does, or the nearest to it."""
    joint = scenario.controller == JOINT
    if scenario.waypoints == MIDDLE:
        same = scenario.controller in (JOINT, CARTESIAN)
        return Counterpart(
            path="figure 4.5",
            torque="figure 4.6"
            if joint
            else "figures 4.8 and 4.13"
            if same
            else "figure 4.8, there for another controller",
            vhc_error="figure 4.9" if scenario.controller == CARTESIAN else "figure 4.9, there for another controller",
            vhc_error_joint="figure 4.7" if joint else "figure 4.7, there for another controller",
            acceleration="figure 4.15",
        )
    if scenario.waypoints == MULTIPLE:
        other = "" if scenario.controller == CARTESIAN else ", there for another controller"
        return Counterpart(
            path="figure 4.10",
            torque=f"figures 4.11 and 4.16{other}",
            vhc_error=f"figure 4.12{other}",
            vhc_error_joint="figure 4.7, there for another motion",
            acceleration=f"figure 4.17{other}",
        )
    return Counterpart(
        path="figures 4.5 and 4.10, there for other motions",
        torque="figures 4.6, 4.8 and 4.11, there for other motions",
        vhc_error="figures 4.9 and 4.12, there for other motions",
        vhc_error_joint="figure 4.7, there for another motion",
        acceleration="figures 4.15 and 4.17, there for other motions",
    )


def thesis_figures(scenario: Scenario) -> ThesisFigures:
    """Return what the thesis states for the motion and the controller of a scenario."""
    if scenario.controller == CARTESIAN and scenario.waypoints == MIDDLE:
        return ThesisFigures("2", "finite", vhc_error="of order 1e-4")
    if scenario.controller == CARTESIAN and scenario.waypoints == MULTIPLE:
        return ThesisFigures("several", "finite", vhc_error="of order 1e-3")
    if scenario.controller == JOINT and scenario.waypoints == MIDDLE:
        return ThesisFigures("2", "finite", vhc_error_joint="of order 1e-4")
    return ThesisFigures()
