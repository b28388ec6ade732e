# SPDX-License-Identifier: Apache-2.0
"""Itemises a cycle of the control chain: `python bench/itemised.py [SCENARIO]`."""

from __future__ import annotations

import sys

from rich.console import Console
from rich.table import Table

from cycle_costs import DRIVES, CycleCosts
from fivebar_bringup.graph.node_spec import Mode, Sharing
from fivebar_bringup.scenarios.scenario_files import load_scenario
from graph_speed import graph_speed

REHEARSED = "middle_moteus"
"""Scenario that is run on emulated drives."""


def costs_rows(costs: CycleCosts) -> list[tuple[str, str, str]]:
    """Return the items of a cycle, the largest first, and their sum without the wait for the drives (ms)."""
    items = sorted(costs.before, key=lambda item: costs.before[item] + costs.after[item], reverse=True)
    rows = [_row(item, costs.before[item], costs.after[item]) for item in items if item != DRIVES]
    before, after = (sum(part.values()) - part[DRIVES] for part in (costs.before, costs.after))
    return [*rows, _row("sum", before, after), _row(DRIVES, costs.before[DRIVES], costs.after[DRIVES])]


def _row(item: str, before: float, after: float) -> tuple[str, str, str]:
    return item, f"{1e3 * before:.3f}", f"{1e3 * after:.3f}"


def main() -> None:
    """Measure and print."""
    console = Console()
    name = sys.argv[1] if len(sys.argv) > 1 else REHEARSED
    scenario = load_scenario(name)
    with console.status(f"{name}: with the bridge in the chain's process, itemised and as it is"):
        itemised = graph_speed(scenario, Mode.REALTIME, rehearsed=True, sharing=Sharing.ROBOT, itemised=True)
        plain = graph_speed(scenario, Mode.REALTIME, rehearsed=True, sharing=Sharing.ROBOT)
    assert itemised.costs is not None, "asked for"
    cycles, collections = itemised.costs.cycles, itemised.costs.collections
    table = Table(
        "item, medians of a cycle",
        "until the torque is written, ms",
        "after it, ms",
        title=f"{name}, --together: {cycles} cycles, garbage collected {collections} times",
    )
    for row in costs_rows(itemised.costs):
        table.add_row(*row)
    console.print(table)
    for words, run in (("as it is", plain), ("itemised", itemised)):
        console.print(f"{words}: sample to torque {run.latency_ms}; processor time {run.cpu_ms}; faults {run.faults}")


if __name__ == "__main__":
    main()
