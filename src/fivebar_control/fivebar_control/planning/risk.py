# SPDX-License-Identifier: Apache-2.0
"""How likely a motion may be to fail on a robot that is not exactly as its file says."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting


class Risk(NamedTuple):
    """How likely it may be that the robot fails because it is not exactly as its file says, and how far loads move it.

    Judged before a motion begins: probabilities where an estimator works with declared tolerances of lengths, bases or
    zeros, displacements where `loads` are declared.
    """

    position: Annotated[
        float,
        Setting(
            "Largest predicted probability of leaving the reference by more than `error_tolerance`.",
            at_least=1e-6,
            at_most=1.0,
        ),
    ] = 0.3
    load_share: Annotated[
        float,
        Setting(
            "Largest displacement by the declared loads at a crossing, as a share of `error_tolerance`; slower"
            " crossings are refused.",
            above=0.0,
            at_most=100.0,
        ),
    ] = 1.0

    load: Annotated[
        float,
        Setting(
            "Largest predicted probability of a displacement beyond `load_share`, where push and tilt come from any"
            " direction and anywhere between none and those declared; 0: no such load may displace the platform"
            " further.",
            at_least=0.0,
            at_most=1.0,
        ),
    ] = 0.0

    success: Annotated[
        float,
        Setting(
            "Least success probability of a motion: the share of robots, drawn within the declared tolerances and"
            " loads, on which its simulated run succeeds.",
            at_least=0.0,
            at_most=1.0,
        ),
    ] = 0.9

    odds_time: Annotated[
        float,
        Setting(
            "Longest time that a request to a running graph may take, in real time, to find its success probability;"
            " where that does not suffice, the displacement by the declared loads decides.",
            "s",
            at_least=0.0,
            at_most=600.0,
        ),
    ] = 10.0
