"""`python -m fivebar_bringup.bench`: print what the project costs here."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from fivebar_bringup.bench.laws import plain_speed
from fivebar_bringup.bench.processes import HOPS, bare_chain_p50_ms, graph_speed, stamp
from fivebar_bringup.scenario import load_scenario


def main() -> None:
    """Measure and print."""
    console = Console()
    scenario = load_scenario("middle")
    with console.status("plain code, then the bare ring, the node graph, and the ring again"):
        plain = plain_speed(scenario)
        ring_before = bare_chain_p50_ms()
        graph = graph_speed(scenario.model_copy(update={"segment_duration": 5.0}))
        ring_after = bare_chain_p50_ms()
    ring = min(ring_before, ring_after)
    table = Table("what", "measured", "target", title=f"Measured {stamp()}, side by side in one run")
    table.add_row("closed loop without ROS", f"{plain.realtime_factor:.1f} x real time", "at least 8")
    table.add_row("all control laws, uncompiled", f"{plain.laws_us:.1f} us per sample", "at most 60")
    table.add_row("node graph in lockstep", f"{graph.realtime_factor:.2f} x real time", "at least 0.5")
    table.add_row("cycle of the graph", f"{graph.cycle_p50_ms:.2f} ms median, {graph.cycle_p99_ms:.2f} ms p99", "")
    table.add_row(f"bare ring of {HOPS} nodes", f"{ring_before:.2f} and {ring_after:.2f} ms median", "")
    table.add_row("cycle / bare ring", f"{graph.cycle_p50_ms / ring:.2f}", "at most 2")
    for name, cpu_ms in graph.cpu_ms.items():
        table.add_row(f"processor time of {name}", f"{cpu_ms:.3f} ms per cycle", "")
    console.print(table)


if __name__ == "__main__":
    main()
