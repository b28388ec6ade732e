# SPDX-License-Identifier: Apache-2.0
"""Faults in the name of a parameter that a node does not have: a slip, or a name of a former release.

Parameters of other nodes are no mistake: a launch file sets some for all nodes of a group.
"""

from __future__ import annotations

from collections.abc import Collection

from fivebar_description.scenario_file import KEYS
from fivebar_description.suggestion import meant

FORMER = {
    "segment_durations": "segment_duration",
    "candidates": "controller",
    "weighting": "controller",
    "law": "controller",
    "goal_controller": "controller",
    "takes_goals": "controller",
    "min_authority": "controller",
    "samples_ahead": "controller",
    "resolution": "vhc_resolution",
    "homing": "waypoints",
    "assembly_mode": "waypoints",
    "publishes": "estimator",
    "disturbance": "estimator",
    "lead_samples": "plant.delay_samples",
    "awaits_readings": "mode",
    "announces_readings": "mode",
    "by_the_clock": "mode",
    "estimate_recovers": "camera.on",
}
"""Parameters of releases before 2.0.0 by what says the same now, where that is no other spelling."""

FORMER_PREFIXES = (
    *("goal_estimator_", "goal_tolerance_", "goal_risk_", "goal_load_", "goal_passive_", "goal_safety_", "goal_law_"),
    *("goal_", "tolerance_", "passive_"),
)
"""How parameters of such releases begin that are keys of sections now."""

CLOSE = 0.8
"""Likeness from which on another name is taken for the one that was meant."""


def is_key(name: str) -> bool:
    """Return whether a parameter may be a key of the run's file, which other nodes use."""
    return name.partition(".")[0] in KEYS


def meant_by(name: str, known: Collection[str]) -> list[str]:
    """Return the parameters of a node that somebody may have meant by a name that is none of them; [] for no mistake.

    Args:
        name: of a parameter that was set.
        known: names of the node's parameters, those of keys of the run's file with dots.
    """
    if FORMER.get(name) in known:
        return [FORMER[name]]
    flat = {key.replace(".", "_"): key for key in known if "." in key}
    if name in flat:
        return [flat[name]]
    prefix = next((former for former in FORMER_PREFIXES if name.startswith(former)), "")
    if prefix and name not in KEYS:
        rest = name.removeprefix(prefix)
        return sorted(key for key in known if key == rest or key.endswith(f".{rest}"))
    if "." not in name:
        ended = [key for key in known if key.endswith(f".{name}")]
        if ended:
            return sorted(ended)
    if name in KEYS:
        return []
    section, dot, _ = name.partition(".")
    # keys of other sections are those of other nodes
    likely = [key for key in known if key.startswith(f"{section}.")] if dot and section in KEYS else [*known, *flat]
    close = meant(name, likely, CLOSE)
    return [flat.get(close, close)] if close is not None else []
