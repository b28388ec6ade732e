"""What scenarios of an older format said otherwise; see `fivebar_description.file_format`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from fivebar_description.file_format import Edit, added, node_at, replaced, yaml_1_1
from fivebar_sim.effects.transmission import Transmission


def transmission_of_the_link(root: Any) -> Iterator[Edit]:
    """Frequency and damping ratio of a transmission were those of the link alone, and are those of the whole leg.

    Stiffness and damper stay the same: k = zz (2 pi f)^2 and d = 2 zeta zz 2 pi f with the inertia zz of the link are
    written with that of the leg, of which the link has the share 1 - rotor_share.
    """
    nodes = {key: node_at(root, "plant", "transmission", key) for key in Transmission._fields}
    numbers = {key: _number(node) for key, node in nodes.items() if node is not None}
    settings = Transmission()._replace(**{key: one for key, one in numbers.items() if one is not None})
    if settings.frequency == 0.0 or None in numbers.values() or not 0.0 < settings.rotor_share < 1.0:
        return
    factor = math.sqrt(1.0 - settings.rotor_share)
    yield replaced(nodes["frequency"], round(settings.frequency * factor, 9))
    damping = round(settings.damping * factor, 9)
    if nodes["damping"] is not None:
        yield replaced(nodes["damping"], damping)
    else:
        yield added(node_at(root, "plant", "transmission"), "damping", damping)


def _number(node: Any) -> float | None:
    """Return the number that a scalar was in format 0, None where it was none."""
    try:
        return float(node.value)
    except (TypeError, ValueError):
        return None


SCENARIO_RULES = ((transmission_of_the_link, yaml_1_1),)
