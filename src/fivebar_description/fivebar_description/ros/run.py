# SPDX-License-Identifier: Apache-2.0
"""Entry point of every node: safe defaults for DDS, one executor, clear errors, exit status 0 on a signal."""

from __future__ import annotations

import faulthandler
import inspect
import os
import signal
import sys
from collections.abc import Callable, Sequence
from types import FrameType

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.signals import SignalHandlerOptions

from fivebar_description.errors import unwrapped
from fivebar_description.files import share_file
from fivebar_description.interrupts import end_at_once, service_signals
from fivebar_description.network import PROFILE_VARIABLES
from fivebar_description.ros.exit_timer import end_process_after
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.process_topics import ProcessTopics
from fivebar_description.ros.scheduling import spare_what_exists
from fivebar_description.ros_environment import BAD_INPUT, check_ros_environment
from fivebar_description.strict_yaml import InputError

try:
    from rclpy.experimental import EventsExecutor as ChosenExecutor
except ImportError:
    # missing in early releases of Jazzy; the other executor is equivalent but costs more processor time
    from rclpy.executors import SingleThreadedExecutor as ChosenExecutor

NodeExecutor = ChosenExecutor
"""The executor of all nodes."""

WAKE_PERIOD = 0.1
"""Longest time (s) the executor sleeps before a signal is noticed."""

TEARDOWN_TIME = 3.0
"""Longest time (s) for shutting the middleware down, after all messages have been delivered.

Fast DDS 2.14, as it is in the wheels, has a deadlock where a node is destroyed while the end of another one is being
noticed, about once in 400 times where a dozen nodes end together: `DomainParticipant::set_listener` waits for the
callback to return, without a limit. The time for which it waits overflows, so that it does not wait but tries again,
and again, with the mutex that the callback needs.
"""

MIDDLEWARE_LEFT = "the middleware did not shut down: all messages had been delivered, and the process ends without it"
"""Line that a process prints then, after the name of the program."""

SWITCH_INTERVAL = 2e-4
"""Switch interval (s) of Python's global interpreter lock; the default of 5 ms is more than two periods at 500 Hz."""

FAST_DDS = "rmw_fastrtps"
"""How the names of the ROS middlewares on Fast DDS begin; the default of Jazzy is one of them."""


def use_local_network_only(environment: dict[str, str] | os._Environ[str] = os.environ) -> None:
    """Keep DDS on this machine unless the environment says otherwise: discovery, data and sockets on loopback.

    ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET opens it to the network, as it does for any other node.
    """
    opened = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE") == "SUBNET"
    name = "fastdds_subnet.xml" if opened else "fastdds_loopback.xml"
    profile = str(share_file("fivebar_description", "config", name))
    profiles = [environment.setdefault(variable, profile) for variable in PROFILE_VARIABLES]
    fast_dds = environment.get("RMW_IMPLEMENTATION", FAST_DDS).startswith(FAST_DDS)
    # the profile is enough by itself, and with LOCALHOST, ROS adds shared memory to the transports that it names
    enough = fast_dds and profiles == [profile] * len(PROFILE_VARIABLES)
    environment.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "SYSTEM_DEFAULT" if enough else "LOCALHOST")


def run_node(make: Callable[[], GraphNode]) -> None:
    """Run one node as `run_nodes` does."""
    run_nodes([make])


def run_nodes(makes: Sequence[Callable[[], GraphNode]]) -> None:
    """Run nodes in this process until one finishes or a signal stops them, then exit the process.

    Exit status 0 after SIGINT, SIGTERM, SIGHUP or a finished run, 2 with one line on standard error for bad input; the
    same, with a line, where the middleware does not shut down. On SIGABRT the process prints where each of its threads
    is.
    """
    use_local_network_only()
    faulthandler.enable()
    stopping = False

    def stop(number: int, frame: FrameType | None) -> None:
        nonlocal stopping
        stopping = True

    # nothing has begun before all nodes are made, which may take a minute where one of them compiles
    for number in service_signals():
        signal.signal(number, end_at_once)
    # nodes still publish after a signal, so rclpy's own handlers, which shut the context down, are not installed
    try:
        check_ros_environment()
        rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
    except (InputError, rclpy_implementation.RCLError, rclpy_implementation.UnknownROSArgsError) as error:
        print(unwrapped(error), file=sys.stderr)
        sys.exit(BAD_INPUT)
    topics = GraphNode.process_topics = ProcessTopics() if len(makes) > 1 else None
    try:
        nodes = [make() for make in makes]
        for node in nodes:
            node.check_names()
    except InputError as error:
        print(error, file=sys.stderr)
        rclpy.try_shutdown()
        sys.exit(BAD_INPUT)
    for number in service_signals():
        signal.signal(number, stop)
    if topics is not None:
        topics.connect()
    # rclpy looks up who logs with `inspect`, which visits every module the first time (40 ms and more): now, and not
    # with the fault that stops the robot
    inspect.getframeinfo(sys._getframe())
    executor = NodeExecutor()
    for node in nodes:
        # those made while other nodes were loading would fire once for each period since, and then be silent as long
        for timer in node.timers:
            timer.reset()
        executor.add_node(node)
    for node in nodes:
        node.schedule()
    # objects created at start-up stay
    spare_what_exists()
    sys.setswitchinterval(SWITCH_INTERVAL)
    try:
        while rclpy.ok() and not stopping and _status(nodes) is None:
            executor.spin_once(timeout_sec=WAKE_PERIOD)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        for node in nodes:
            if rclpy.ok():
                node.stop()
                node.deliver()
        end_process_after(TEARDOWN_TIME, _status(nodes) or 0, MIDDLEWARE_LEFT)
        # what may spin from here on must not do so at a real-time priority, which that timer's threads have inherited
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        executor.shutdown()
        for node in nodes:
            node.destroy_node()
        rclpy.try_shutdown()
    sys.exit(_status(nodes) or 0)


def _status(nodes: Sequence[GraphNode]) -> int | None:
    """Return the largest exit status that a node has set, None while all are running."""
    return max((node.exit_status for node in nodes if node.exit_status is not None), default=None)
