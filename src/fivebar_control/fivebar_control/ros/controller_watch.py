# SPDX-License-Identifier: Apache-2.0
"""Whether a controller of ros2_control follows the bridge alone, and whether the watchdog is there."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

from fivebar_control.fault import Fault
from fivebar_control.hardware.controlled_joints import EFFORT, HEARS, SEPARATOR, WATCHDOG, JointsLink
from fivebar_control.hardware.fault import DriveError
from fivebar_description.interface import DIAGNOSTICS, node_of_status
from fivebar_description.publishers import Living, second_publisher
from fivebar_description.ros.endpoints import is_own, node_name, publishers_of

try:
    from controller_manager_msgs.srv import ListControllers
except ImportError:
    # not installed: diagnostics of the controller manager tell the state of its controllers
    ListControllers = None

LOOK_PERIOD = 0.05
"""Period (s) of looking who publishes and who listens to the commands."""

SERVICE_TIME = 1.0
"""Longest time (s) that a service of controller or controller manager is waited for."""

WATCHDOG_TIME = 3.5
"""Age (s) of the watchdog's last report, one of which comes each second, beyond which it counts as missing."""

HEARING_TIME = 2.5
"""Longest time (s) for which the watchdog's report is awaited that it hears the commands: it reports each second."""

ACTIVE = "active"
ACTIVITY = "Controllers Activity"
"""End of the name of the controller manager's status on /diagnostics, and what controllers are to be there."""


def has_controller(node: Node, link: JointsLink) -> bool:
    """Return whether the controller of a drives file listens to its commands, as far as a node sees."""
    return any(
        node_name(subscription) == link.controller
        for subscription in node.get_subscriptions_info_by_topic(link.commands)
    )


class ControllerWatch:
    """Watches controller, commands and watchdog, on behalf of a node that publishes the commands."""

    def __init__(self, node: Node, link: JointsLink) -> None:
        """Begin to look, in the thread that spins the node."""
        self._node = node
        self._link = link
        self._short_name = link.controller.rpartition("/")[2]
        self._watchdog = f"{node.get_namespace().rstrip('/')}/{WATCHDOG}"
        self._living = Living(time.monotonic)
        self._commander: Fault | None = None
        self._listens = True
        self._state = ACTIVE
        """The state of the controller, as the controller manager has it."""
        self._reported: float | None = None
        """When the watchdog has last reported, None until it has been found."""
        self._heard: frozenset[str] = frozenset()
        """The publishers whose commands it hears, by its last report."""
        node.create_subscription(DiagnosticArray, DIAGNOSTICS.name, self._on_diagnostics, DIAGNOSTICS.qos.depth)
        node.create_timer(LOOK_PERIOD, self.look)

    @property
    def fault(self) -> Fault | None:
        """The present fault; None while there is none."""
        reported = self._reported
        if reported is not None and time.monotonic() - reported > WATCHDOG_TIME:
            return Fault("watchdog_missing", f"{self._watchdog}: nothing heard for {WATCHDOG_TIME:g} s")
        return self._commander or self._loss

    @property
    def _loss(self) -> Fault | None:
        """The fault that a controller is which no longer takes commands."""
        if self._state != ACTIVE:
            return Fault("controller_lost", f"{self._link.controller} is {self._state}")
        return None if self._listens else Fault("controller_lost", f"{self._link.controller} no longer listens")

    def find(self, end: float) -> None:
        """Find the controller as it is described, and the watchdog, which has to hear the commands.

        Raises:
            DriveError: one is missing at a time (s) of the steady clock, or the controller differs or is not active.
        """
        self._find_controller(end)
        self._wait_until(self._has_watchdog, end)
        if not self._has_watchdog():
            raise DriveError(Fault("watchdog_missing", f"{self._watchdog}: it does not publish {self._link.commands}"))
        self._wait_until(self._is_heard, time.monotonic() + HEARING_TIME)
        if not self._is_heard():
            words = f"it does not hear what this bridge publishes on {self._link.commands}"
            raise DriveError(Fault("watchdog_missing", f"{self._watchdog}: {words}"))
        self._reported = time.monotonic()

    def _find_controller(self, end: float) -> None:
        self._wait_until(self._has_controller, end)
        self._listens = self._has_controller()
        if not self._listens:
            raise DriveError(Fault("controller_missing", f"{self._link.commands} has no subscription of it"))
        parameters = self._ask(
            GetParameters,
            f"{self._link.controller}/get_parameters",
            GetParameters.Request(names=["joints", "interface_name"]),
        )
        if parameters is not None:
            # empty where the controller has none of these parameters
            joints, interface, *_ = (*map(parameter_value_to_python, parameters.values), None, None)
            if joints and tuple(joints) != self._link.joints:
                claimed, expected = (", ".join(names) for names in (joints, self._link.joints))
                raise DriveError(
                    Fault(
                        "controller_differs", f"{self._link.controller} has the joints {claimed}, expected {expected}"
                    )
                )
            if interface and interface != EFFORT and self._link.takes == EFFORT:
                raise DriveError(
                    Fault("controller_differs", f"{self._link.controller} commands {interface}, expected {EFFORT}")
                )
        self._ask_manager()
        if self._loss is not None:
            raise DriveError(self._loss)

    def _ask_manager(self) -> None:
        """Ask the controller manager for the state of the controller, where its messages are installed."""
        if ListControllers is None:
            return
        answer = self._ask(ListControllers, f"{self._link.manager}/list_controllers", ListControllers.Request())
        for controller in () if answer is None else answer.controller:
            if controller.name == self._short_name:
                self._state = controller.state

    def _ask(self, kind: Any, name: str, request: Any) -> Any:
        """Return the answer of a service, None where it does not answer."""
        client = self._node.create_client(kind, name)
        try:
            if not client.wait_for_service(SERVICE_TIME):
                return None
            answered = threading.Event()
            future = client.call_async(request)
            future.add_done_callback(lambda _: answered.set())
            return future.result() if answered.wait(SERVICE_TIME) else None
        finally:
            self._node.destroy_client(client)

    def _wait_until(self, condition: Callable[[], bool], end: float) -> None:
        while not condition() and time.monotonic() < end:
            time.sleep(LOOK_PERIOD)

    def _has_controller(self) -> bool:
        return has_controller(self._node, self._link)

    def _has_watchdog(self) -> bool:
        return any(publisher.node == self._watchdog for publisher in publishers_of(self._node, self._link.commands))

    def _is_heard(self) -> bool:
        publishers = publishers_of(self._node, self._link.commands)
        return any(is_own(self._node, publisher) and publisher.gid.hex() in self._heard for publisher in publishers)

    def look(self) -> None:
        """Look who publishes the commands, and whether the controller listens; in any thread."""
        publishers = publishers_of(self._node, self._link.commands)
        own = next((publisher for publisher in publishers if is_own(self._node, publisher)), None)
        machine = b"" if own is None else own.machine
        others = [
            publisher
            for publisher in publishers
            if publisher.node != self._watchdog
            and not is_own(self._node, publisher)
            and not self._living.is_gone(publisher, machine)
        ]
        self._commander = (
            Fault.from_text(second_publisher(self._link.commands, [own, *others], machine))
            if others and own is not None
            else None
        )
        self._listens = self._has_controller()

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if node_of_status(status.name) == self._watchdog:
                values = {value.key: value.value for value in status.values}
                self._heard = frozenset(values.get(HEARS, "").split(SEPARATOR))
                if self._reported is not None:
                    self._reported = time.monotonic()
            elif status.name.endswith(ACTIVITY):
                for value in status.values:
                    if value.key == f"{self._short_name}.state":
                        self._state = value.value
