# SPDX-License-Identifier: Apache-2.0
"""`python bench`: run the benchmarks and print them."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from engine_speed import EngineSpeed, engine_speed
from environment_speed import ENVIRONMENTS, environment_speed
from estimator_speed import estimator_us
from fivebar_bringup.graph.node_spec import Mode, Sharing
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.interface import DEFAULT_PRIORITY
from graph_speed import HOPS, bare_chain_p50_ms, graph_speed, stamp
from histogram import histogram
from plain_speed import plain_speed
from real_time import ALONE, TOGETHER, real_time_rows
from stalls import bare_loop
from start_up import start_up_rows
from step_speed import mujoco_us, step_speed

ESTIMATED = {"from encoders": "middle_encoders", "with a gyroscope": "gyro_middle"}
"""Scenarios on which the estimator is measured, by what it has."""


STEPPED = {"all joints": "unified_middle", "from encoders": "middle_encoders", "with a gyroscope": "gyro_middle"}
"""Scenarios whose controller is stepped, by what it knows."""

RIGS = ("ideal", "calibrated")
"""Rigs on whose robots the environment of gymnasium is measured."""

REHEARSED = "middle_moteus"
"""Scenario that is rehearsed on emulated drives, whose bridge is in a process of its own, and in that of the chain."""


def main() -> None:
    """Measure and print."""
    console = Console()
    scenario = load_scenario("middle")
    rehearsed = load_scenario(REHEARSED)
    with console.status("start-up"):
        starts = [*start_up_rows()]
    with console.status("plain code, then the bare ring, the node graph, and the ring again"):
        plain = plain_speed(scenario)
        engine = engine_speed(scenario)
        estimators = {words: estimator_us(load_scenario(name)) for words, name in ESTIMATED.items()}
        plain_steps, fast_steps = (
            {words: step_speed(name, compiled) for words, name in STEPPED.items()} for compiled in (False, True)
        )
        environments = {rig: environment_speed(rig) for rig in RIGS}
        beside_mujoco = mujoco_us("dextar", 1.0 / scenario.rate_hz, 1000)
        ring_before = bare_chain_p50_ms()
        longer = scenario.model_copy(update={"segment_duration": 5.0})
        graph = graph_speed(longer, Mode.LOCKSTEP)
        composed = graph_speed(longer, Mode.LOCKSTEP, sharing=Sharing.CHAIN)
        clocked = graph_speed(longer, Mode.REALTIME)
        samples = longer.plan().path.samples(longer.rate_hz)
        stalls = bare_loop(longer.rate_hz, samples, DEFAULT_PRIORITY)
        apart, together = (
            graph_speed(rehearsed, Mode.REALTIME, rehearsed=True, sharing=sharing) for sharing in (None, Sharing.ROBOT)
        )
        ring_after = bare_chain_p50_ms()
    ring = min(ring_before, ring_after)
    table = Table("what", "measured", "target", title=f"Measured {stamp()}, side by side in one run")
    table.add_row("closed loop without ROS", f"{plain.realtime_factor:.1f} x real time", "at least 8")
    table.add_row("all control laws, uncompiled", f"{plain.laws_us:.1f} us per sample", "at most 60")
    for words, microseconds in estimators.items():
        table.add_row(f"compiled estimator, {words}", f"{microseconds:.0f} us per sample", "at most 60")
    for words, step in plain_steps.items():
        both = f"{step.controller:.0f} us, as machine code {fast_steps[words].controller:.0f} us"
        table.add_row(f"step of the controller, {words}", both, "")
        table.add_row(f"step of its plant, {words}", f"{step.plant:.0f} us", "")
    table.add_row("steps of MuJoCo in a period", f"{beside_mujoco:.0f} us", "")
    for rig, made in environments.items():
        target = "at least 100000" if rig == "ideal" else ""
        table.add_row(f"{ENVIRONMENTS} environments, {rig}", f"{made.steps:.0f} steps per second", target)
        table.add_row("the same / samples of the compiled closed loop", f"{made.steps / made.loop:.2f}", "")
    table.add_row("node graph in lockstep", f"{graph.realtime_factor:.2f} x real time", "at least 0.5")
    table.add_row("cycle of the graph", f"{graph.cycle_p50_ms:.2f} ms median, {graph.cycle_p99_ms:.2f} ms p99", "")
    table.add_row(f"bare ring of {HOPS} nodes", f"{ring_before:.2f} and {ring_after:.2f} ms median", "")
    table.add_row("cycle / bare ring, a process per node", f"{graph.cycle_p50_ms / ring:.2f}", "")
    table.add_row("the same, control chain in one process", f"{composed.cycle_p50_ms / ring:.2f}", "at most 3")
    for name, cpu_ms in graph.cpu_ms.items():
        table.add_row(f"processor time of {name}", f"{cpu_ms:.3f} ms per cycle", "")
    _add_engine(table, engine)
    console.print(table)
    begun = Table("what", "processor time", "target", title="Start-up")
    for name, measured, target in starts:
        begun.add_row(name, measured, target)
    console.print(begun)
    beside = Table("what", "control chain", stalls.name, "target", title=f"Real time at {longer.rate_hz} Hz")
    for row in real_time_rows(clocked, stalls, samples):
        beside.add_row(*row)
    console.print(beside)
    cycles = rehearsed.plan().path.samples(rehearsed.rate_hz)
    for words, speed, latency in (("apart", apart, ALONE), ("in the chain's process", together, TOGETHER)):
        title = f"{REHEARSED} on emulated drives at {rehearsed.rate_hz} Hz, bridge {words}"
        bridged = Table("what", "robot", stalls.name, "target", title=title)
        for row in real_time_rows(speed, stalls, cycles, latency):
            bridged.add_row(*row)
        console.print(bridged)
    periods = {"control chain": clocked.periods_ms, stalls.name: stalls.periods_ms}
    console.print(histogram("From one sample to the next, as recorded", 1e3 / longer.rate_hz, periods))


def _add_engine(table: Table, speed: EngineSpeed) -> None:
    gap = f"at most MuJoCo's {speed.mujoco_gap:.0e} m"
    table.add_row("compiled closed loop, one core", f"{speed.engine:.0f} x real time", "")
    table.add_row("the same from encoders", f"{speed.estimated:.0f} x real time", "")
    table.add_row("step of MuJoCo alone", f"{speed.mujoco:.0f} x real time", "")
    table.add_row("compiled closed loop / MuJoCo", f"{speed.ratio:.1f}", "at least 25")
    table.add_row("largest gap of the closed loop", f"{speed.engine_gap:.0e} m", gap)
    table.add_row("first call of the compiled loop", f"{speed.compile_s:.1f} s", "")


if __name__ == "__main__":
    main()
