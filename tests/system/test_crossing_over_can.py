# SPDX-License-Identifier: Apache-2.0
"""The rehearsal of an experiment: estimator, controllers, bridge, bus and emulated drives, by the clock."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from emulation_file import load_emulation
from fivebar_command import RUN_DEADLINE, FivebarCommand
from graph_probe import Bench, Probe

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.recording import Recording
from fivebar_bringup.drives.choice import write_drive_files
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.hardware.configuration import load_drives
from fivebar_control.hardware.units import position_rad, scale_of
from fivebar_description.interface import (
    FAULTS,
    GROUND_TRUTH,
    MOTOR_STATES,
    TORQUE_COMMAND,
    TORQUE_REQUESTED,
)
from fivebar_description.strict_yaml import InputError

PRIORITY = ("--priority", "20")
"""Real-time scheduling where it is granted: the clock waits for nobody, whatever else the machine has to do."""

ZERO = (0.0, 0.0)

SLOW = 20.0
"""Time (s) of one segment of a motion that is interrupted."""


CALM_HZ = 50
"""Rate where the test is not of the rate."""

STEADY_S = 0.2
"""Time for which a torque holds here: many times what a shared machine stands still now and then."""


def rehearse(fivebar: Callable[..., FivebarCommand], scenario: str | Path, *options: str) -> FivebarCommand:
    arguments = ("run", str(scenario), "--hardware", "emulated", "--json", "--out", "out")
    return fivebar(*arguments, *PRIORITY, *options)


def steady(**changes: object) -> Scenario:
    """The shipped experiment with some values changed and a watchdog that bears a machine's standing still."""
    content = load_scenario("middle_robot").model_dump(mode="json") | changes
    content["safety"]["stop_cycles"] = round(STEADY_S * content["rate_hz"])
    return Scenario.model_validate(content)


@pytest.fixture(scope="module")
def calm(folder: Path) -> Path:
    path = folder / "calm.yaml"
    # at this rate the robot strays by some 7 mm, of which the screen allows 5
    path.write_text(steady(name="calm", rate_hz=CALM_HZ, force=True).to_yaml())
    return path


def bag_of(call: FivebarCommand) -> Recording:
    return read_bag(call.folder / "out" / "bag")


@pytest.mark.clock
def test_the_middle_crossing(fivebar: Callable[..., FivebarCommand], folder: Path) -> None:
    """At its own rate.

    Each time the machine stands still for longer than the bridge awaits the drives' answers costs a sample or two, as
    the run says.
    """
    path = folder / "steady.yaml"
    path.write_text(steady().to_yaml())
    call = rehearse(fivebar, path)
    status = call.finish()
    call.expect_no_process(0.0)
    summary = call.json()
    print({key: summary[key] for key in ("overruns", "tracking_error_peak_m", "estimate_error_max_m")})
    assert summary["faults"] == [], call.stdout + call.stderr
    missed = 201 - summary["samples"]
    assert 0 <= missed <= 10
    other = [reason for reason in summary["not_completed_because"] if "sample" not in reason]
    assert other == []
    assert (status, summary["outcome"]) == ((1, "stopped") if summary["not_completed_because"] else (0, "succeeded"))
    assert summary["mode"] == "realtime"
    assert summary["assembly_mode_changes"] == 2
    # counted, on the clock of this machine
    assert isinstance(summary["overruns"], int)
    assert summary["tracking_error_peak_m"] < 0.01
    assert 0.0 < summary["estimate_error_max_m"] < 0.002
    assert 0.1 < max(summary["torque_peak_nm"]) < 5.0
    bag = bag_of(call)
    # the exact state is for the judge: the controllers had steps of an encoder of 20000 counts
    counts = bag.field(MOTOR_STATES, "position")[:, 0] * 20_000 / 6.283185307179586
    assert abs(counts - counts.round()).max() < 1e-6
    assert bag.count(GROUND_TRUTH) >= 201 - missed
    assert bag.count(TORQUE_REQUESTED) >= 201 - 2 * missed - 10


@pytest.mark.extra
@pytest.mark.clock
def test_a_fault_that_is_injected_on_the_way(fivebar: Callable[..., FivebarCommand], calm: Path) -> None:
    call = rehearse(fivebar, calm, "--inject", "0.3 fault 2")
    assert call.finish() == 1, call.stderr
    call.expect_no_process(0.0)
    summary = call.json()
    assert (summary["outcome"], summary["faults"]) == ("stopped", ["drive_fault"])
    bag = bag_of(call)
    assert "q21 (node 2)" in bag.texts(FAULTS)[0]
    assert tuple(bag.field(TORQUE_COMMAND, "effort")[-1]) == ZERO
    # sample 15 is at 0.3 s; three cycles later nothing pushes any more
    assert not bag.field(GROUND_TRUTH, "effort")[20:].any()
    assert bag.field(GROUND_TRUTH, "effort")[5:15].any()


@pytest.mark.clock
@pytest.mark.extra
def test_a_killed_node_is_told_and_stops_the_robot(fivebar: Callable[..., FivebarCommand], calm: Path) -> None:
    call = rehearse(fivebar, calm, "--inject", "0.3 kill dextar_bridge")
    assert call.finish() == 1, call.stderr
    call.expect_no_process(0.0)
    summary = call.json()
    assert summary["faults"][0] in ("node_died", "state_stale")
    assert "node_died: dextar_bridge" in " ".join(summary["fault_details"])
    assert tuple(bag_of(call).field(TORQUE_COMMAND, "effort")[-1]) == ZERO


def has_moved(probe: Probe, call: FivebarCommand) -> bool:
    if call.status is not None:
        pytest.fail(f"the run has ended before it was interrupted: {call.stdout}{call.stderr}")
    return len(probe.got(MOTOR_STATES)) > 30


@pytest.mark.clock
@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.extra)])
def test_an_interrupt_ends_it_in_order(tmp_path: Path, number: signal.Signals) -> None:
    with Bench(tmp_path) as bench:
        probe = bench.probe()
        probe.listen(MOTOR_STATES)
        # nobody awaits the probe: the motion lasts longer than a busy machine may take until it has joined
        slow = steady(name="slow", segment_duration=SLOW, rate_hz=CALM_HZ, force=True)
        (tmp_path / "slow.yaml").write_text(slow.to_yaml())
        arguments = ("run", "slow.yaml", "--hardware", "emulated", "--json", "--out", "out", *PRIORITY)
        call = FivebarCommand(tmp_path, *arguments, "--domain", str(bench.domain), domain=bench.domain)
        try:
            probe.wait_for(lambda: has_moved(probe, call), "the motion", RUN_DEADLINE)
            call.send(number)
            assert call.finish() == 1
            assert call.stdout, call.stderr
            summary = call.json()
            assert (summary["outcome"], summary["faults"]) == ("interrupted", ["interrupted"])
            assert tuple(bag_of(call).field(TORQUE_COMMAND, "effort")[-1]) == ZERO
            call.expect_no_process(0.0)
        finally:
            call.close()


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"estimator": "none"}, "estimator: expected ekf"),
        ({"delay_samples": 0}, "plant.delay_samples: expected 1"),
        ({"encoder_counts": None}, "plant.encoder_counts: expected a number"),
        ({"torque_limit": None}, "plant.torque_limit: expected a number"),
        ({"rate_hz": 1280}, "rate_hz: expected a divisor of 1000000"),
    ],
)
def test_what_drives_cannot_do_is_refused(tmp_path: Path, change: dict[str, object], reason: str) -> None:
    content = load_scenario("middle_robot").model_dump(mode="json")
    for key, value in change.items():
        (content["plant"] if key in content["plant"] else content)[key] = value
    with pytest.raises(InputError, match=reason):
        write_drive_files(Scenario.model_validate(content), tmp_path)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("middle", "--hardware", "emulated"), "expected ekf"),
        (("middle", "--inject", "1 fault 1"), "expected --hardware emulated"),
        (("middle_robot", "--hardware", "emulated", "--inject", "soon fault 1"), "expected seconds and one of"),
        (("middle_robot", "--hardware", "emulated", "--inject", "1 fault 3"), "expected seconds and one of"),
        (("middle_robot", "--hardware", "emulated", "--inject", "1 kill cook"), "node cook: expected one of"),
    ],
)
def test_bad_input_is_one_line(fivebar: Callable[..., FivebarCommand], arguments: tuple[str, ...], text: str) -> None:
    call = fivebar("run", *arguments)
    assert call.finish() == 2
    assert text in call.stderr
    assert call.stderr.strip().count("\n") == 0


def test_both_files_tell_of_the_same_drives(tmp_path: Path) -> None:
    scenario = load_scenario("middle_robot")
    files = write_drive_files(scenario, tmp_path)
    drives, emulation = load_drives(str(files.drives)), load_emulation(str(files.emulation))
    assert drives.rate_hz == scenario.rate_hz
    assert drives.bus.model_dump(exclude={"bitrate"}) == emulation.bus.model_dump()
    other = write_drive_files(scenario, tmp_path / ".")
    assert load_drives(str(other.drives)).bus != drives.bus, "two runs never meet"
    for drive, facts in zip(drives.pair, emulation.pair, strict=True):
        assert drive.counts_per_revolution == facts.counts_per_revolution == 20_000
        assert drive.torque_limit_nm == 5.0
        # one step of 0x6071 is the torque step of the scenario
        assert drive.rated_torque_nm / 1000 == facts.rated_torque_nm / 1000 == 0.002
        # whatever way the counts run, the reading is the lower edge of the angles that give it
        scale = scale_of(drive)
        counts = 1234 if drive.sign > 0 else -1235
        assert position_rad(scale, counts) == pytest.approx(1234 * 6.283185307179586 / 20_000)
    assert yaml.safe_load(files.drives.read_text())["master"]["timeout_ms"] == 30
