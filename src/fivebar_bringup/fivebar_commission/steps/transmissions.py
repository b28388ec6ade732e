# SPDX-License-Identifier: Apache-2.0
"""The resonance of the transmissions: a chirp, and the bandwidth that they allow."""

from __future__ import annotations

import math

from fivebar_bringup.identify.resonance import resonance_of_bag
from fivebar_commission.session import Session
from fivebar_commission.step import Findings, GateClosed, GatedStep
from fivebar_commission.steps.identification import finished
from fivebar_control.identification.resonance import NoResonance, OnlyBounded
from fivebar_control.laws.robot_sizes import bandwidth_of, tuning_for
from fivebar_description.strict_yaml import InputError

AMPLITUDE = 4.0
"""Amplitude of the chirp, in Coulomb frictions: below these it shows nothing."""

SHARE = 0.6
"""Part of the allowed torque that it may have."""

LEAST_AMPLITUDE = 1.5
"""Coulomb frictions below which a chirp shows nothing."""

FALL = 0.6
"""The smaller amplitude of the chirp over the larger one, by which play shows."""

SWEEP, SWEEPS = 5.0, 4

FROM_HZ, TO_HZ = 10.0, 200.0

OFF_BY = 0.03
"""Distance (m) from its place at which the robot is stopped."""

ASSUMED_HZ = 150.0
"""Frequency that is assumed of transmissions whose resonance is not visible."""


def run(session: Session) -> Findings:
    """Make a chirp at home, and write what bandwidth the transmissions allow."""
    robot, home = session.robot, session.robot.home_m
    friction = max(robot.friction.f_s11, robot.friction.f_s21, 1e-3 * session.allowed.torque)
    amplitude = min(AMPLITUDE * friction, SHARE * session.allowed.torque)
    if amplitude < LEAST_AMPLITUDE * friction:
        raise GateClosed(
            "too_little_torque",
            f"a chirp of {amplitude:.3g} Nm shows nothing beside {friction:.3g} Nm of friction: allow at least"
            f" {LEAST_AMPLITUDE * friction / SHARE:.2g} Nm",
        )
    scenario = session.scenario(
        "resonance",
        controller="fivebar_control.laws.chirp:LAW",
        waypoints=[list(home), [home[0], home[1] + 1e-3]],
        segment_duration=SWEEP * SWEEPS,
        law={
            "amplitude": amplitude,
            "from_hz": FROM_HZ,
            "to_hz": min(TO_HZ, 0.4 * session.drives.rate_hz),
            "sweep": SWEEP,
            "fall": FALL,
        },
        tracking_error_limit=OFF_BY,
        error_tolerance=OFF_BY,
    )
    folder, summary = session.run(scenario, "resonance")
    finished(summary, folder)
    figures: dict[str, object] = {"amplitude, Nm": round(amplitude, 3)}
    try:
        result = resonance_of_bag(folder.path, str(session.robot_path))
    except InputError as error:
        if isinstance(error.__cause__, OnlyBounded):
            return _bounded(session, error.__cause__, figures)
        if not isinstance(error.__cause__, NoResonance):
            raise
        session.learn(transmissions={"frequency": ASSUMED_HZ, "rotor_share": 0.7})
        return Findings(f"{error.__cause__}: the default gains bear such transmissions", figures)
    legs = result.resonance.legs
    share = sum(leg.rotor_share.value for leg in legs) / 2.0
    session.learn(
        transmissions={
            "frequency": result.resonance.lowest,
            "damping": sum(leg.damping.value for leg in legs) / 2.0,
            "rotor_share": min(0.95, max(0.05, share)),
        }
    )
    session.learn_robot(result.robot_file())
    for number, leg in enumerate(legs, start=1):
        figures[f"leg {number}: frequency, Hz"] = f"{leg.frequency.value:.4g} ± {leg.frequency.half_width:.2g}"
        figures[f"leg {number}: rotor's share"] = f"{leg.rotor_share.value:.3g} ± {leg.rotor_share.half_width:.2g}"
    figures["bandwidth at most, rad/s"] = round(result.allowed, 1)
    usual = "" if result.lowered else ", which is more than the usual one"
    return Findings(
        f"the transmissions swing at {legs[0].frequency.value:.3g} and {legs[1].frequency.value:.3g} Hz: a bandwidth of"
        f" {math.floor(result.allowed)} rad/s at most{usual}",
        figures,
    )


def _bounded(session: Session, bounded: OnlyBounded, figures: dict[str, object]) -> Findings:
    """Have gains for the lowest frequency that the transmissions may have, and simulate them with the likeliest one."""
    likely = min(ASSUMED_HZ, bounded.likely)
    session.learn(transmissions={"frequency": likely, "rotor_share": 0.7})
    session.learn_robot(session.robot.model_copy(update={"tuning": tuning_for(session.robot, bounded.at_least)}))
    figures["frequency at least, Hz"] = round(bounded.at_least, 1)
    figures["frequency, simulated, Hz"] = round(likely, 1)
    allowed = bandwidth_of(bounded.at_least)
    figures["bandwidth at most, rad/s"] = round(allowed, 1)
    return Findings(f"{bounded}: a bandwidth of {math.floor(allowed)} rad/s at most", figures)


TRANSMISSIONS = GatedStep(
    name="transmissions",
    title="Resonance of the transmissions",
    does="adds a chirp to the torques of the robot at home, and finds elasticity and the bandwidth that it allows",
    cost="half a minute",
    risk="the robot shakes by some millimetres, audibly; its torque is some times the friction",
    gate="the motion is finished; the resonance is found, or a bound of it, or is beyond what the encoders show",
    run=run,
)
