# SPDX-License-Identifier: Apache-2.0
"""What a node opens to the network by default, and that ordinary ROS tools of the same machine still reach it."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import NamedTuple

import pytest
from fivebar_command import RUN_DEADLINE
from graph_probe import COMMAND, DDS_VARIABLES, Bench, node_modules
from middle_motion import MiddleMotion

from fivebar_description.interface import JOINT_STATES, SUPERVISOR_SIGMA, SUPERVISOR_STATE
from fivebar_description.ros.run import use_local_network_only

LOOPBACK = "127.0.0.1"
EXCHANGES, MOST_BATCHES = 20, 50

PLAIN_TOOL = """
import json, sys
import rclpy
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from sensor_msgs.msg import JointState

rclpy.init()
node = Node("tool")
seen = []
node.create_subscription(JointState, "supervisor/state", seen.append, 10)
client = node.create_client(GetParameters, "/supervisor/get_parameters")
future = None
print("listening", flush=True)
while not (seen and future and future.done() and "supervisor" in node.get_node_names()):
    rclpy.spin_once(node, timeout_sec=0.1)
    if future is None and client.service_is_ready():
        future = client.call_async(GetParameters.Request(names=["rate_hz"]))
print(json.dumps({
    "names": list(seen[0].name),
    "rate_hz": future.result().values[0].integer_value,
    "nodes": sorted(node.get_node_names()),
}))
"""
"""An rclpy program that knows nothing of this project, as `ros2 topic echo` and `ros2 param get` are."""


class Socket(NamedTuple):
    """A bound IP socket of a process."""

    protocol: str
    address: str
    port: int


def sockets(pid: int) -> list[Socket]:
    """Return the bound IP sockets of a process, from what the kernel tells of it."""
    inodes = set()
    for entry in Path(f"/proc/{pid}/fd").iterdir():
        target = os.readlink(entry)
        if target.startswith("socket:["):
            inodes.add(target[len("socket:[") : -1])
    found = []
    for protocol in ("udp", "udp6", "tcp", "tcp6", "raw"):
        for line in Path(f"/proc/{pid}/net/{protocol}").read_text(encoding="ascii").splitlines()[1:]:
            fields = line.split()
            if fields[9] in inodes:
                address, _, port = fields[1].partition(":")
                found.append(Socket(protocol, _dotted(address), int(port, 16)))
    return found


def _dotted(address: str) -> str:
    """Return an IPv4 address, which the kernel prints as one little-endian number, in the usual form."""
    if len(address) != 8:
        return address
    return ".".join(str(byte) for byte in bytes.fromhex(address)[::-1])


def well_known_ports(domain: int) -> range:
    """Return the ports that the DDS standard gives to a domain: where others send discovery and data to."""
    base = 7400 + 250 * domain
    return range(base, base + 250)


def test_every_socket_is_on_loopback(bench: Bench) -> None:
    process = bench.start("supervisor")
    probe = bench.probe()
    probe.health("/supervisor")
    found = sockets(process.pid)
    assert {(socket.protocol, socket.address) for socket in found} == {("udp", LOOPBACK)}
    ports = well_known_ports(bench.domain)
    # one for discovery and one for data
    assert len([socket for socket in found if socket.port in ports]) >= 2


def test_there_is_no_shared_memory_for_a_killed_process_to_leave_behind(bench: Bench) -> None:
    process = bench.start("supervisor")
    probe = bench.probe()
    probe.health("/supervisor")
    assert "/dev/shm/fastrtps" not in Path(f"/proc/{process.pid}/maps").read_text(encoding="utf-8")


def test_one_variable_opens_the_network(bench: Bench) -> None:
    """Shows besides that the tests above can see what they look for."""
    process = bench.fork(node_modules()["supervisor"], [], ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET")
    probe = bench.probe()
    probe.health("/supervisor")
    ports = well_known_ports(bench.domain)
    assert "/dev/shm/fastrtps" in Path(f"/proc/{process.pid}/maps").read_text(encoding="utf-8")
    assert "0.0.0.0" in {socket.address for socket in sockets(process.pid) if socket.port in ports}


def test_the_defaults_give_way_to_the_environment() -> None:
    environment: dict[str, str] = {}
    use_local_network_only(environment)
    assert environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "SYSTEM_DEFAULT"
    profiles = [environment[name] for name in DDS_VARIABLES if name.endswith("PROFILES_FILE")]
    assert len(profiles) == 2
    assert all(Path(profile).is_file() for profile in profiles)
    chosen = {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET",
        "FASTDDS_DEFAULT_PROFILES_FILE": "mine.xml",
        "FASTRTPS_DEFAULT_PROFILES_FILE": "mine.xml",
    }
    environment = dict(chosen)
    use_local_network_only(environment)
    assert environment == chosen


@pytest.mark.parametrize(
    "changed", [{"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}, {"FASTDDS_DEFAULT_PROFILES_FILE": "mine.xml"}]
)
def test_where_the_profile_does_not_count_ros_restricts_discovery(changed: dict[str, str]) -> None:
    environment = dict(changed)
    use_local_network_only(environment)
    assert environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
    assert changed.items() <= environment.items()


@pytest.mark.extra
@pytest.mark.parametrize("started_first", ["node", "tool"])
def test_tools_without_the_profile_see_and_call_the_node(
    bench: Bench, motion: MiddleMotion, started_first: str
) -> None:
    command = [sys.executable, "-c", PLAIN_TOOL]
    probe = bench.probe()
    if started_first == "tool":
        tool = bench.run(command)
        probe.wait_for(lambda: "listening" in tool.stdout, "the tool listens")
        bench.start("supervisor")
    else:
        bench.start("supervisor")
        probe.health("/supervisor")
        tool = bench.run(command)
    probe.join("supervisor", [JOINT_STATES], [SUPERVISOR_STATE])

    def tool_has_ended() -> bool:
        probe.publish(JOINT_STATES, motion.joint_states_message(0))
        probe.spin_for(0.1)
        return tool.status is not None

    probe.wait_for(tool_has_ended, "the tool has seen all it looks for")
    assert tool.status == 0, tool.stderr
    seen = json.loads(tool.stdout.splitlines()[-1])
    assert seen["names"] == ["sigma", "inverse_condition"]
    assert seen["rate_hz"] == 500
    assert {"supervisor", "tool"} <= set(seen["nodes"])


def event_wakeups(pid: int) -> int:
    """Return how often the threads that serve the events of DDS have waited so far."""
    waits = 0
    for thread in Path(f"/proc/{pid}/task").iterdir():
        if (thread / "comm").read_text().startswith("dds.ev"):
            fields = dict(line.split(":\t", 1) for line in (thread / "status").read_text().splitlines())
            waits += int(fields["voluntary_ctxt_switches"])
    return waits


def test_a_message_wakes_no_other_thread_of_its_writer(bench: Bench, motion: MiddleMotion) -> None:
    """Else such a thread takes the processor, and the writer's lock, from the control cycle with each message."""
    supervisor = bench.start("supervisor")
    probe = bench.probe()
    probe.join("supervisor", [JOINT_STATES], [SUPERVISOR_STATE, SUPERVISOR_SIGMA])
    probe.ask([(JOINT_STATES, motion.joint_states_message(0))], [SUPERVISOR_STATE], 0)
    assert event_wakeups(supervisor.pid) > 0
    # two messages in each exchange; what is left is the heartbeats and what follows them, some tens in a second, hence
    # until a batch comes for which the machine has time
    wakeups = [MOST_BATCHES * EXCHANGES]  # more than any batch has
    while min(wakeups) >= 1.5 * EXCHANGES and len(wakeups) <= MOST_BATCHES:
        first, before = len(wakeups) * EXCHANGES, event_wakeups(supervisor.pid)
        for sample in range(first, first + EXCHANGES):
            probe.ask([(JOINT_STATES, motion.joint_states_message(sample))], [SUPERVISOR_STATE], sample)
        wakeups.append(event_wakeups(supervisor.pid) - before)
    assert min(wakeups) < 1.5 * EXCHANGES, wakeups


@pytest.mark.extra
def test_a_run_whose_nodes_cannot_hear_each_other_says_so(bench: Bench, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ["run", "middle", "--domain", str(bench.domain), "--no-page", "--json", "--out", str(out)]
    process = bench.fork(COMMAND, words, ROS_AUTOMATIC_DISCOVERY_RANGE="OFF")
    assert process.wait(RUN_DEADLINE) == 2
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["faults"] == ["nodes_missing"]
    (detail,) = summary["fault_details"]
    assert detail.startswith("nodes_missing: no node of the run is heard: ROS_AUTOMATIC_DISCOVERY_RANGE is OFF")
    assert detail in summary["not_completed_because"]
    # less than a node waits for the others
    assert summary["wall_s"] < 30.0
