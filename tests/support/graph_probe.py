# SPDX-License-Identifier: Apache-2.0
"""Real nodes as processes of their own, and a probe that talks to them over DDS as any other ROS process would."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import time
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, TypeVar

import pytest
import rclpy
import yaml
from console_scripts import console_scripts
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from forked_node import DEADLINE, ForkedNode, end_with_parent, fork_context
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.publisher import Publisher
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fivebar_bringup.runs.domain import private_domain
from fivebar_bringup.runs.processes import NODE_GROUP
from fivebar_description.executable import Executable
from fivebar_description.interface import (
    NANOSECONDS,
    RUN_EPOCH,
    RUN_PLAN,
    RUN_READY,
    START_STAMP_NS,
    Topic,
    node_of_status,
    sample_of_stamp,
    sample_stamp_ns,
)
from fivebar_description.joint_sample import MessageError
from fivebar_description.ros.messages import message_class, qos_profile, stamp_of
from fivebar_description.ros.run import use_local_network_only
from fivebar_description.run_plan import plan_text, read_epoch

RATE_HZ = 500
"""Default rate of every node."""

RESPONSE_PERIOD = 3.0
"""Time (s) after which a request without a response is sent again."""

DROPPED_RESPONSE = re.compile(r"client will not receive response|service_send_response\(")
"""The two lines with which a service warns that it has dropped a response."""

DDS_VARIABLES = (
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "ROS_LOCALHOST_ONLY",
    "ROS_STATIC_PEERS",
    "FASTDDS_DEFAULT_PROFILES_FILE",
    "FASTRTPS_DEFAULT_PROFILES_FILE",
)

COMMAND = "forked_command"
"""The module that is the `fivebar` command."""

RUN_READY_PROFILE = qos_profile(RUN_READY.qos)

T = TypeVar("T")


def node_modules() -> dict[str, str]:
    """Return every executable that is a node, with its module, as the packages announce them."""
    loaded = {name: entry.load() for name, entry in console_scripts().items()}
    modules = {name: program.module for name, program in loaded.items() if isinstance(program, Executable)}
    # a process for others, no node itself
    return {name: module for name, module in modules.items() if ".nodes." in module and module != NODE_GROUP}


PRELOADED = (*node_modules().values(), NODE_GROUP, COMMAND)
"""What forked processes need not load."""


def clean_environment(domain: int, folder: Path) -> dict[str, str]:
    """Return this process' environment with nothing in it that says how DDS is to behave, but the domain."""
    kept = {name: value for name, value in os.environ.items() if name not in DDS_VARIABLES}
    return {**kept, "ROS_DOMAIN_ID": str(domain), "ROS_LOG_DIR": str(folder / "ros_logs")}


class ChildProcess:
    """A process of the test, in a session of its own, with what it prints in files."""

    def __init__(self, command: Sequence[str], folder: Path, environment: Mapping[str, str]) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        number = len(list(folder.glob("*.stderr")))
        self._out, self._err = folder / f"{number}.stdout", folder / f"{number}.stderr"
        with self._out.open("wb") as out, self._err.open("wb") as err:
            self._process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=out, stderr=err, env=environment, cwd=folder,
                start_new_session=True, preexec_fn=end_with_parent,
            )  # fmt: skip
        self.pid = self._process.pid

    @property
    def status(self) -> int | None:
        """Exit status, None while the process runs."""
        return self._process.poll()

    @property
    def stdout(self) -> str:
        return self._out.read_text(encoding="utf-8")

    @property
    def stderr(self) -> str:
        return self._err.read_text(encoding="utf-8")

    def send(self, number: signal.Signals) -> None:
        self._process.send_signal(number)

    def wait(self, deadline: float = DEADLINE) -> int:
        """Return the exit status; fail where the process does not end in time."""
        try:
            return self._process.wait(deadline)
        except subprocess.TimeoutExpired:
            pytest.fail(f"still running after {deadline} s: {self._process.args}\n{self.stderr}")

    def close(self) -> None:
        if self.status is None:
            self._process.kill()
            self._process.wait()


class Probe:
    """A ROS node of the test in a context of its own: publishes, listens, and spins only while it waits."""

    def __init__(self, domain: int, namespace: str = "", name: str = "probe") -> None:
        use_local_network_only()
        self.domain = domain
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
        self.node = Node(name, namespace=namespace, context=self._context, enable_rosout=False)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._publishers: dict[str, Publisher[Any]] = {}
        self.received: dict[str, list[Any]] = defaultdict(list)
        """Messages of each topic that was listened to, in order of arrival."""
        self._sent: dict[str, list[float]] = defaultdict(list)
        self._by_stamp: dict[str, tuple[int, dict[int, Any]]] = {}
        self.reports: dict[str, list[DiagnosticStatus]] = defaultdict(list)
        """What each node (absolute name) has told on /diagnostics, in order."""
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)
        self.listen(RUN_READY)
        self.epochs = [START_STAMP_NS]
        """Stamps of sample 0, as they were published, the present one last."""
        # before all else, so that it is known when a sample comes
        self.listen(RUN_EPOCH, callback=self._on_epoch)

    @property
    def epoch_ns(self) -> int:
        return self.epochs[-1]

    def sample(self, message: Any, rate_hz: int = RATE_HZ) -> int | None:
        """Return the sample that a message's stamp names."""
        return sample_of_stamp(stamp_of(message), rate_hz, self.epoch_ns)

    def _on_epoch(self, message: String) -> None:
        # a hostile test may send anything
        with suppress(MessageError):
            epoch_ns = read_epoch(message.data)
            if epoch_ns is not None:
                self.epochs.append(epoch_ns)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self.reports[node_of_status(status.name)].append(status)

    def advertise(self, *topics: Topic, depth: int | None = None) -> None:
        """Make the publishers of topics, so that others can discover them."""
        for topic in topics:
            if topic.name not in self._publishers:
                self._publishers[topic.name] = self.node.create_publisher(
                    message_class(topic), topic.name, qos_profile(topic.qos, depth)
                )

    def publish(self, topic: Topic, message: Any) -> None:
        self.advertise(topic)
        self._publishers[topic.name].publish(message)

    def withdraw(self, topic: Topic) -> None:
        """Destroy the publisher of a topic."""
        self.node.destroy_publisher(self._publishers.pop(topic.name))

    def listeners(self, topic: Topic) -> int:
        """Return how many subscriptions the publisher of a topic here has found."""
        return self._publishers[topic.name].get_subscription_count()

    def delivered(self, *topics: Topic) -> bool:
        """Wait until what was published has arrived at every listener; return whether it has in time."""
        return all(self._publishers[topic.name].wait_for_all_acked(Duration(seconds=DEADLINE)) for topic in topics)

    def listen(self, *topics: Topic, callback: Callable[[Any], None] | None = None, depth: int = 5000) -> None:
        """Keep the messages of topics, or hand them to a callback."""
        for topic in topics:
            take = callback if callback is not None else self._keeper(topic)
            self.node.create_subscription(message_class(topic), topic.name, take, qos_profile(topic.qos, depth))

    def _keeper(self, topic: Topic) -> Callable[[Any, Any], None]:
        messages, sent = self.received[topic.name], self._sent[topic.name]

        def keep(message: Any, information: Any) -> None:
            messages.append(message)
            sent.append(information["source_timestamp"] / NANOSECONDS)

        return keep

    def sent(self, topic: Topic) -> list[float]:
        """Return when the messages of a topic were sent (s), by the clock of the system."""
        return self._sent[topic.name]

    def got(self, topic: Topic) -> list[Any]:
        """Return the messages of a topic that have come so far."""
        return self.received[topic.name]

    def wait_for(self, condition: Callable[[], T], what: str, deadline: float = DEADLINE) -> T:
        """Spin until the condition gives something true, and return it; fail after the deadline (s)."""
        end = time.monotonic() + deadline
        while not (result := condition()):
            if time.monotonic() > end:
                counts = {name: len(messages) for name, messages in self.received.items()}
                health = [reports[-1] for reports in self.reports.values()]
                pytest.fail(f"not within {deadline} s: {what}; messages: {counts}; health: {health}")
            self._executor.spin_once(timeout_sec=0.02)
        return result

    def spin_for(self, seconds: float) -> None:
        """Take what comes within a time; only for what is a rate or a pause by its nature."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.01)

    def publish_plan(self, **values: Any) -> None:
        """Publish the plan of a run, which nodes compare with their own values."""
        self.publish(RUN_PLAN, String(data=plan_text(values)))

    def join(self, name: str, inputs: Sequence[Topic], outputs: Sequence[Topic]) -> None:
        """Take the part of the rest of the graph around a node, and wait until both know of each other's topics.

        A node announces itself once it knows of the publishers of its inputs. That it knows of the subscriptions to its
        outputs, too, shows in the arrival of this announcement, which is kept for latecomers, at a subscription made
        after those: a participant hears of another's subscriptions in the order in which they were made.
        """
        self.advertise(*inputs)
        self.listen(*outputs)
        publishers = [self._publishers[topic.name] for topic in inputs]
        announced: set[str] = set()
        last = self.node.create_subscription(
            message_class(RUN_READY), RUN_READY.name, lambda message: announced.add(message.data), RUN_READY_PROFILE
        )
        self.wait_for(
            lambda: (
                name in announced
                and all(publisher.get_subscription_count() > 0 for publisher in publishers)
                and all(self.node.count_publishers(topic.name) > 0 for topic in outputs)
            ),
            f"{name} is ready",
        )
        self.node.destroy_subscription(last)

    def samples(self, topic: Topic, rate_hz: int = RATE_HZ) -> list[int | None]:
        """Return the sample numbers that the stamps of a topic's messages name."""
        return [self.sample(message, rate_hz) for message in self.got(topic)]

    def answer(self, topic: Topic, sample: int, rate_hz: int = RATE_HZ) -> Any:
        """Wait for the message of a topic that answers a sample, and return the last such."""
        stamp = sample_stamp_ns(sample, rate_hz, self.epoch_ns)
        return self.wait_for(lambda: self._last_by_stamp(topic).get(stamp), f"{topic.name} of sample {sample}")

    def _last_by_stamp(self, topic: Topic) -> dict[int, Any]:
        """Return the last message of each stamp of a topic; only what is new is looked at."""
        messages = self.got(topic)
        known, found = self._by_stamp.get(topic.name, (0, {}))
        found.update((stamp_of(message), message) for message in messages[known:])
        self._by_stamp[topic.name] = len(messages), found
        return found

    def ask(self, inputs: Sequence[tuple[Topic, Any]], outputs: Sequence[Topic], sample: int) -> None:
        """Publish the inputs of a sample again and again until every output has answered it: the start of a run."""
        asked = 0.0

        def answered() -> bool:
            nonlocal asked
            if time.monotonic() - asked > 0.2:
                asked = time.monotonic()
                for topic, message in inputs:
                    self.publish(topic, message)
            return all(sample in self.samples(topic) for topic in outputs)

        self.wait_for(answered, f"{[topic.name for topic in outputs]} answer sample {sample}")

    def health(self, node: str) -> tuple[DiagnosticStatus, dict[str, str]]:
        """Wait for the next /diagnostics of a node (absolute name); return its status and its values."""
        return self.report(node, lambda values: True, len(self.reports[node]))

    def report(
        self, node: str, wanted: Callable[[dict[str, str]], bool], after: int = 0
    ) -> tuple[DiagnosticStatus, dict[str, str]]:
        """Wait for the first report of a node, after so many, with values as wanted; return its status and values."""

        def find() -> tuple[DiagnosticStatus, dict[str, str]] | None:
            told = ((status, values_of(status)) for status in self.reports[node][after:])
            return next((report for report in told if wanted(report[1])), None)

        return self.wait_for(find, f"/diagnostics of {node}")

    def wait_for_dropped(self, node: str, count: int) -> None:
        """Wait until a node (absolute name) says that it has dropped so many messages, and no more."""
        self.report(node, lambda values: int(values["dropped"]) >= count)
        _, values = self.health(node)
        assert values["dropped"] == str(count)

    def call(self, kind: Any, name: str, request: Any) -> Any:
        """Call a service and return its response.

        A service that has not discovered this client's reader yet takes the request and drops its response, with a
        warning; ROS 2 has no way to see that from here. So the request, which changes nothing when it is repeated, is
        sent again until there is a response.
        """
        client = self.node.create_client(kind, name)
        self.wait_for(client.service_is_ready, f"service {name}")
        responses: list[Any] = []
        sent: list[float] = []

        def answered() -> bool:
            if not sent or time.monotonic() > sent[-1] + RESPONSE_PERIOD:
                sent.append(time.monotonic())
                client.call_async(request).add_done_callback(lambda future: responses.append(future.result()))
            return bool(responses)

        self.wait_for(answered, f"answer of {name}")
        self.node.destroy_client(client)
        return responses[0]

    def reset(self, node: str) -> Trigger.Response:
        return self.call(Trigger, f"{node}/reset", Trigger.Request())

    def describe(self, node: str) -> list[ParameterDescriptor]:
        """Return the descriptors of all parameters of a node."""
        names = self.call(ListParameters, f"{node}/list_parameters", ListParameters.Request()).result.names
        request = DescribeParameters.Request(names=names)
        return list(self.call(DescribeParameters, f"{node}/describe_parameters", request).descriptors)

    def parameter(self, node: str, name: str) -> Any:
        """Return the value of a node's parameter."""
        (value,) = self.call(GetParameters, f"{node}/get_parameters", GetParameters.Request(names=[name])).values
        return parameter_value_to_python(value)

    def set_parameter(self, node: str, name: str, value: Any) -> SetParametersResult:
        message: ParameterMessage = Parameter(name, value=value).to_parameter_msg()
        request = SetParameters.Request(parameters=[message])
        return self.call(SetParameters, f"{node}/set_parameters", request).results[0]

    def close(self) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()


class Bench:
    """A private DDS domain with the nodes and probes that a test puts into it; use it as a context manager."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._stack = ExitStack()

    def __enter__(self) -> Bench:
        self.domain = self._stack.enter_context(private_domain())
        return self

    def __exit__(self, *exception: object) -> None:
        self._stack.close()

    def start(self, node: str, namespace: str = "", arguments: Sequence[str] = (), **parameters: Any) -> ForkedNode:
        """Start a node by the name of its executable."""
        values = [word for name, value in parameters.items() for word in ("-p", f"{name}:={_yaml(value)}")]
        remaps = ["-r", f"__ns:={namespace}"] if namespace else []
        return self.fork(node_modules()[node], ["--ros-args", *remaps, *values, *arguments])

    def start_group(self, *words: str) -> ForkedNode:
        """Start nodes in one process: their modules, then what follows `--ros-args`."""
        return self.fork(NODE_GROUP, words)

    def fork(self, module: str, arguments: Sequence[str], **variables: str) -> ForkedNode:
        """Start what `python -m MODULE ARGUMENTS` would, from a process that has loaded all nodes."""
        environment = {**clean_environment(self.domain, self.folder), **variables}
        process = ForkedNode(fork_context(PRELOADED), module, arguments, self.folder / "processes", environment)
        self._stack.callback(process.close)
        return process

    def run(self, command: Sequence[str], **variables: str) -> ChildProcess:
        """Start any process in the domain."""
        environment = {**clean_environment(self.domain, self.folder), **variables}
        process = ChildProcess(command, self.folder / "processes", environment)
        self._stack.callback(process.close)
        return process

    def probe(self, namespace: str = "", name: str = "probe") -> Probe:
        probe = Probe(self.domain, namespace, name)
        self._stack.callback(probe.close)
        return probe


def values_of(status: DiagnosticStatus) -> dict[str, str]:
    """Return the values of a report on /diagnostics by their names."""
    return {value.key: value.value for value in status.values}


def _yaml(value: Any) -> str:
    text = yaml.safe_dump(value, default_flow_style=True, width=10_000)
    return text.removesuffix("\n").removesuffix("\n...")
