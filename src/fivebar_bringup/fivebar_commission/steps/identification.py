# SPDX-License-Identifier: Apache-2.0
"""Inertias, mass and friction, and with weighed links the torque constants: the first motion under control."""

from __future__ import annotations

from typing import Any

from fivebar_bringup.identify.identify import identify_bag, map_bag
from fivebar_bringup.recorded.outcome import RunOutcome
from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_bringup.recorded.summary import Summary
from fivebar_bringup.scenario import Scenario
from fivebar_commission.motions import exciting_points
from fivebar_commission.session import Session
from fivebar_commission.step import Findings, GateClosed, GatedStep, fault_or_outcome
from fivebar_control.model.geometry import wrap
from fivebar_control.planning.reference_scan import ReferenceScan
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_description.interface import ACTIVE_JOINTS

TORQUE_SHARE, SPEED_SHARE = 0.5, 0.6
"""Parts of the allowed torque and speed that the motion needs on the robot as it is known."""

TURNING = (5.0, 1.5, 3.5, 0.8)
"""Mean speeds (rad/s) of the faster motor in its segments, one after the other: fast for inertia, slow for friction."""

SHORTEST = 0.3
"""Shortest segment (s)."""

BANDWIDTH = 20.0
"""Bandwidth of the control (rad/s): low enough for any transmission, of which nothing is known yet."""

SLOWER, ATTEMPTS = 1.3, 8

OFF_BY = 0.02
"""Distance (m) from the reference at which the robot is stopped."""

LARGEST_CHANGE = 3.0
"""Ratio of inertia or mass to those of the file before, beyond which the gate closes."""


def run(session: Session) -> Findings:
    """Make the exciting motion, identify the robot from it, and write its file."""
    scenario = exciting(session)
    run_directory, summary = session.run(scenario, "excitation")
    finished(summary, run_directory)
    robot = str(session.robot_path)
    result = identify_bag(run_directory.path, robot)
    changes = {
        parameter.name: parameter.value / parameter.before for parameter in result.parameters()[:3] if parameter.before
    }
    figures: dict[str, Any] = {
        f"{parameter.name}, {parameter.unit}": parameter.text() for parameter in result.parameters()
    }
    figures |= {"largest torques, Nm": list(summary.torque_peak_nm)}
    wrong = [name for name, ratio in changes.items() if not 1.0 / LARGEST_CHANGE < ratio < LARGEST_CHANGE]
    if wrong:
        raise GateClosed(
            "implausible",
            f"{wrong[0]} comes out {changes[wrong[0]]:.2g} times that of the file: check gear_ratio and"
            " torque_constant",
            figures,
        )
    if session.robot.proximal_links is not None:
        # with weighed links the torque constants can be told from the inertias
        figures |= {
            f"{joint}: actual over commanded torque": f"{motor.gain.value:.4f} ± {motor.gain.half_width:.4f}"
            for joint, motor in zip(ACTIVE_JOINTS, map_bag(run_directory.path, robot, ()), strict=True)
        }
    session.learn_robot(result.robot_file())
    words = ", ".join(
        f"{parameter.name} {parameter.value:.4g} {parameter.unit} ({parameter.change()})"
        for parameter in result.parameters()[:3]
    )
    return Findings(words, figures, (str(run_directory.path.relative_to(session.folder)),))


def exciting(session: Session) -> Scenario:
    """Return the exciting motion, slow enough for what the robot is allowed.

    Raises:
        GateClosed: it takes too much torque at any speed.
    """
    points = exciting_points(session.five_bar, session.robot.home_m)
    angles = [session.angles_at(*point) for point in points]
    durations = []
    for number in range(len(points) - 1):
        before, after = angles[number], angles[number + 1]
        turned = max(abs(wrap(after.q11 - before.q11)), abs(wrap(after.q21 - before.q21)))
        speed = min(TURNING[number % len(TURNING)], 0.4 * session.allowed.speed)
        durations.append(max(SHORTEST, turned / speed))
    for _ in range(ATTEMPTS):
        scenario = session.scenario(
            "excitation",
            waypoints=points,
            segment_duration=[round(duration, 3) for duration in durations],
            unified={"kp": BANDWIDTH**2, "kd": 2.0 * BANDWIDTH},
            tracking_error_limit=OFF_BY,
            error_tolerance=OFF_BY,
        )
        scan = ReferenceScan(session.five_bar, scenario.plan(), scenario.rate_hz, tuned_controller(scenario))
        torque = scan.worst("torque", "torque", TORQUE_SHARE * session.allowed.torque, True)
        speed_needed = scan.worst("speed", "speed", SPEED_SHARE * session.allowed.speed, True)
        if torque.kept and speed_needed.kept:
            return scenario
        durations = [SLOWER * duration for duration in durations]
    raise GateClosed(
        "too_little_torque",
        f"the exciting motion takes {torque.value:.3g} Nm at any speed: allow more than {session.allowed.torque:g} Nm",
    )


def finished(summary: Summary, directory: RunDirectory) -> None:
    """Close the gate where a run has not been finished without a fault."""
    if summary.outcome not in (RunOutcome.SUCCEEDED, RunOutcome.OFF_REFERENCE):
        details, name = [*summary.fault_details, *summary.not_completed_because], fault_or_outcome(summary)
        words = (details[0] if details else str(summary.outcome)).removeprefix(f"{name}: ")
        raise GateClosed(name, f"{words}: look at {directory.path}")


IDENTIFICATION = GatedStep(
    name="identification",
    title="Inertias, mass, friction",
    does="moves both motors slowly and fast, far from singularities, and identifies the robot from it",
    cost="a minute",
    risk=f"the first motion under control: stopped {1e3 * OFF_BY:.0f} mm off, or beyond the allowed torque or speed",
    gate="the motion is finished; inertias and mass are determined and plausible",
    run=run,
)
