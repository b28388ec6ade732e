# SPDX-License-Identifier: Apache-2.0
"""What nodes tell of themselves on /diagnostics, nodes that share a process, and `fivebar status`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticStatus
from forked_node import ForkedNode
from graph_probe import COMMAND, Bench, Probe, node_modules, values_of
from middle_motion import MiddleMotion

from fivebar_description.files import share_file
from fivebar_description.interface import JOINT_STATES, REFERENCE, SUPERVISOR_STATE, status_name


def feed(probe: Probe, motion: MiddleMotion, samples: int) -> None:
    """Let the supervisor answer samples, one after the other."""
    probe.join("supervisor", [JOINT_STATES], [SUPERVISOR_STATE])
    for sample in range(samples):
        feed_one(probe, motion, sample)


def feed_one(probe: Probe, motion: MiddleMotion, sample: int) -> None:
    probe.publish(JOINT_STATES, motion.joint_states_message(sample))
    probe.answer(SUPERVISOR_STATE, sample)


@pytest.mark.extra
def test_a_node_tells_its_rate_jitter_late_and_dropped_messages(bench: Bench, motion: MiddleMotion) -> None:
    bench.start("supervisor")
    probe = bench.probe()
    feed(probe, motion, 50)
    before = len(probe.reports["/supervisor"])
    sample = 50
    # a report is of the second before it: of two that come while samples go by, the later one is of samples only
    while len(probe.reports["/supervisor"]) < before + 2:
        feed_one(probe, motion, sample)
        sample += 1
    assert {(one.name, one.hardware_id) for one in probe.reports["/supervisor"]} == {("/supervisor: health", "fivebar")}
    status, figures = probe.reports["/supervisor"][-1], values_of(probe.reports["/supervisor"][-1])
    assert status.level == DiagnosticStatus.OK
    assert 50 < int(figures["answered"]) <= sample
    assert set(figures) >= {"rate_hz", "jitter_ms", "interval_max_ms", "late", "dropped"}
    assert float(figures["rate_hz"]) > 1.0
    assert float(figures["interval_max_ms"]) >= float(figures["jitter_ms"]) > 0.0
    assert (figures["late"], figures["dropped"]) == ("0", "0")
    probe.report("/supervisor", lambda values: values["answered"] == str(sample))


@pytest.mark.extra
def test_thresholds_are_parameters(bench: Bench, motion: MiddleMotion) -> None:
    bench.start("supervisor", late_after_ms=0.01, warn_dropped=1)
    probe = bench.probe()
    feed(probe, motion, 20)
    # late in the second of which the report is, and no other
    status, _ = probe.report("/supervisor", lambda values: int(values["late"]) > 0)
    assert status.level == DiagnosticStatus.WARN
    assert status.message.startswith("late: ")
    message = motion.joint_states_message(20)
    message.name = ["a", "b", "c", "d"]
    probe.publish(JOINT_STATES, message)
    probe.wait_for_dropped("/supervisor", 1)
    # one dropped message is allowed here; the late answers are over
    status, _ = probe.health("/supervisor")
    assert status.level == DiagnosticStatus.OK
    probe.publish(JOINT_STATES, message)
    probe.wait_for_dropped("/supervisor", 2)
    status, _ = probe.health("/supervisor")
    assert status.level == DiagnosticStatus.WARN
    assert "joint_states" in status.message


def test_what_the_system_does_not_grant_is_a_warning(bench: Bench, motion: MiddleMotion) -> None:
    process = bench.start("supervisor", processors="4095")
    feed(bench.probe(), motion, 3)
    assert process.status is None
    assert "processors 4095 not granted" in process.stderr


def test_processors_are_kept_by_every_thread(bench: Bench, motion: MiddleMotion) -> None:
    process = bench.start("supervisor", processors="0")
    feed(bench.probe(), motion, 3)
    for task in Path(f"/proc/{process.pid}/task").iterdir():
        allowed = [line for line in (task / "status").read_text().splitlines() if line.startswith("Cpus_allowed_list")]
        assert allowed == ["Cpus_allowed_list:\t0"]


def test_malformed_processors_end_the_node(bench: Bench) -> None:
    process = bench.start("supervisor", processors="0;1")
    assert process.wait() == 2
    assert "parameter processors" in process.stderr
    assert len(process.stderr.strip().splitlines()) == 1


def group(bench: Bench, *modules: str, **parameters: object) -> ForkedNode:
    """Start nodes in one process, each with parameters of its own by name."""
    path = bench.folder / "group.yaml"
    content = {f"/**/{node}": {"ros__parameters": values} for node, values in parameters.items()}
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return bench.start_group(*modules, "--ros-args", "--params-file", str(path))


def test_nodes_in_one_process_answer_each_with_its_parameters(bench: Bench, motion: MiddleMotion) -> None:
    modules = [f"fivebar_control.nodes.{name}" for name in ("trajectory_generator", "supervisor")]
    # the zones are those of the plan, on which both must agree; after_fault has one of them alone
    zones = {"zone.rule": "fixed", "zone.epsilon": 0.3}
    process = group(bench, *modules, trajectory_generator={**zones, "after_fault": "continue"}, supervisor=zones)
    probe = bench.probe()
    probe.join("supervisor", [JOINT_STATES], [SUPERVISOR_STATE])
    probe.join("trajectory_generator", [JOINT_STATES], [REFERENCE])
    sample = motion.crossing - 60
    probe.publish(JOINT_STATES, motion.joint_states_message(sample))
    sigma, kappa = probe.answer(SUPERVISOR_STATE, sample).position
    assert 0.0 < sigma < 1.0
    assert sigma == pytest.approx(2.0 - kappa / 0.3, abs=1e-12)
    assert probe.answer(REFERENCE, sample + 1)
    reports = bench.fork(COMMAND, ["status", "--domain", str(bench.domain), "--json"])
    assert reports.wait() == 0
    assert [report["node"] for report in json.loads(reports.stdout)] == ["/supervisor", "/trajectory_generator"]
    assert {report["level"] for report in json.loads(reports.stdout)} == {"ok"}
    process.send(2)
    assert process.wait() == 0


def test_a_group_needs_modules_of_nodes(bench: Bench) -> None:
    for words, expected in (
        ([], "no node given"),
        (["fivebar_control.nodes.nothing"], "expected the module of a node"),
        (["fivebar_control.model.dynamics"], "defines 0 nodes"),
    ):
        process = bench.start_group(*words)
        assert process.wait() == 2
        assert expected in process.stderr
        assert len(process.stderr.strip().splitlines()) == 1


def test_status_of_an_empty_domain_says_so(bench: Bench) -> None:
    process = bench.fork(COMMAND, ["status", "--domain", str(bench.domain)])
    assert process.wait() == 1
    assert f"no node of the graph answers in domain {bench.domain}" in process.stdout


def test_status_without_a_domain_takes_that_of_the_run(bench: Bench, tmp_path: Path) -> None:
    """The bench holds its domain as `fivebar run` does, in a folder that no other test looks at."""
    process = bench.fork(COMMAND, ["status"], ROS_DOMAIN_ID="x", TMPDIR=str(tmp_path))
    assert process.wait() == 2
    assert "ROS_DOMAIN_ID: 'x'" in process.stderr


@pytest.mark.extra
@pytest.mark.clock
def test_the_time_between_two_runs_is_no_late_answer(bench: Bench, motion: MiddleMotion) -> None:
    bench.start("supervisor", late_after_ms=1000.0)
    probe = bench.probe()
    feed(probe, motion, 5)
    # longer than an answer may take; then a new run begins
    probe.spin_for(1.2)
    probe.publish(JOINT_STATES, motion.joint_states_message(0))
    probe.answer(SUPERVISOR_STATE, 0)
    probe.publish(JOINT_STATES, motion.joint_states_message(1))
    _, figures = probe.report("/supervisor", lambda values: values["answered"] == "7")
    assert figures["late"] == "0"


def test_the_aggregator_has_a_place_for_every_node() -> None:
    """A status that is in none of the groups would be shown as "Other"."""
    path = share_file("fivebar_bringup", "config", "diagnostic_aggregator.yaml")
    groups = yaml.safe_load(path.read_text(encoding="utf-8"))["analyzers"]["ros__parameters"]
    expected = [name for group in groups.values() if isinstance(group, dict) for name in group["contains"]]
    assert sorted(expected) == sorted(status_name(f"/{node}") for node in node_modules())
    assert {group["type"] for group in groups.values() if isinstance(group, dict)} == {
        "diagnostic_aggregator/GenericAnalyzer"
    }
