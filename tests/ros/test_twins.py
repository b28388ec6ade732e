# SPDX-License-Identifier: Apache-2.0
"""Texts of the graph and the standard messages that say the same, beside each other on DDS."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticStatus
from graph_probe import Bench, values_of
from std_msgs.msg import String

from fivebar_description.interface import (
    DRIVES_STATE,
    FAULTS,
    RUN_BEGIN,
    RUN_PATH,
    RUN_STATUS,
    SAFETY_STATE,
    START_STAMP_NS,
    TORQUE_COMMAND,
    VALUES,
)
from fivebar_description.ros.messages import content_status, to_stamp


def test_a_plant_tells_its_run_in_standard_messages(bench: Bench) -> None:
    probe = bench.probe("/cell")
    probe.listen(RUN_BEGIN, RUN_STATUS, VALUES[RUN_STATUS], VALUES[DRIVES_STATE])
    bench.start("plant", "/cell")
    probe.wait_for(lambda: probe.got(RUN_BEGIN), "the epoch")
    (begin,) = probe.got(RUN_BEGIN)
    assert (begin.stamp, begin.frame_id) == (to_stamp(START_STAMP_NS), "cell/base_link")
    (told,) = probe.wait_for(lambda: probe.got(VALUES[RUN_STATUS])[:1], "a status")
    assert (told.level, told.message, told.name) == (DiagnosticStatus.OK, "running", "/cell/run/status")
    assert told.hardware_id == "cell/fivebar"
    assert values_of(told)["sample"] == "0"
    drives = probe.wait_for(lambda: probe.got(VALUES[DRIVES_STATE]), "the drives")[0]
    assert (drives.level, drives.message) == (DiagnosticStatus.OK, "ok")


def test_a_fault_is_an_error_with_its_name(bench: Bench) -> None:
    probe = bench.probe()
    probe.listen(VALUES[SAFETY_STATE])
    probe.advertise(FAULTS)
    bench.start("blender", controller="ctc")
    probe.wait_for(lambda: probe.got(VALUES[SAFETY_STATE]) and probe.listeners(FAULTS), "the blender")

    def told() -> list[DiagnosticStatus]:
        # the blender may know the probe later than the probe knows it, and miss the first
        probe.publish(FAULTS, String(data="drive_lost: q11: no heartbeat"))
        return probe.got(VALUES[SAFETY_STATE])[1:]

    status = probe.wait_for(told, "the fault")[0]
    assert status.level == DiagnosticStatus.ERROR
    assert values_of(status) == {"state": "drive_lost", "detail": "q11: no heartbeat"}


def test_the_plan_is_a_path(bench: Bench) -> None:
    probe = bench.probe("/cell")
    probe.listen(RUN_PATH, TORQUE_COMMAND)
    bench.start("trajectory_generator", "/cell", waypoints=[0.0, 0.15, 0.02, 0.10], segment_duration=[0.5])
    (path,) = probe.wait_for(lambda: probe.got(RUN_PATH), "the path")
    places = [(pose.pose.position.x, pose.pose.position.y) for pose in path.poses]
    assert (places[0], places[-1]) == ((0.0, 0.15), (0.02, 0.10))
    assert path.header.frame_id == path.poses[0].header.frame_id == "cell/base_link"


def test_values_are_flat() -> None:
    text = '{"state": "failed", "reason": "why", "latency_ms": {"p50": 0.5}, "waypoints": [[0.0, 0.1]], "x": null}'
    status = content_status(text)
    assert (status.level, status.message) == (DiagnosticStatus.ERROR, "failed: why")
    values = {"latency_ms.p50": "0.5", "waypoints.0.0": "0.0", "waypoints.0.1": "0.1", "x": ""}
    assert values.items() <= values_of(status).items()
