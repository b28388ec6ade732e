# SPDX-License-Identifier: Apache-2.0
"""The lower part of every node of the graph: checked parameters, steady timers and counted drops."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, ClassVar, TypeVar

from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.timer import Timer
from std_msgs.msg import String

from fivebar_description.interface import Topic
from fivebar_description.joint_sample import MessageError
from fivebar_description.outside_text import one_line
from fivebar_description.ros.parameters import as_tuple, check_changes, declare
from fivebar_description.settings import Declared, declared, from_parameters

WARNING_PERIOD = 5.0
"""Shortest time (s) between two warnings of the same kind."""

S = TypeVar("S", bound=tuple[Any, ...])
R = TypeVar("R")


class BaseNode(Node):
    """A node, which does not watch its topics yet."""

    commands_robot: ClassVar[bool] = False
    """Whether it stops the robot by itself for a second publisher: blender, plant and bridges."""

    def __init__(self, name: str) -> None:
        """Create the node without topics."""
        super().__init__(name)
        self.declared: list[Declared] = []
        """The settings that its parameters hold."""
        self.answered = 0
        """Samples answered so far."""
        self.external_inputs: tuple[str, ...] = ()
        """Topics of states that come from outside of the graph, where others may publish other joints."""
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._drops = 0
        self._last_drop = ""
        self.add_on_set_parameters_callback(partial(check_changes, self.declared))

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set parameters; one that keeps its value is no change, so that a node loads what it has dumped."""
        changed = [parameter for parameter in parameter_list if not self._has(parameter)]
        return super().set_parameters_atomically(changed) if changed else SetParametersResult(successful=True)

    def _has(self, parameter: Parameter) -> bool:
        if not self.has_parameter(parameter.name):
            return False
        present = self.get_parameter(parameter.name)
        if (present.type_, parameter.type_) == (Parameter.Type.DOUBLE, Parameter.Type.STRING):
            # rclpy reads 3e-05 in a parameter file as a text
            return bool(parameter.value == repr(present.value))
        return bool(present.type_ == parameter.type_ and as_tuple(present.value) == as_tuple(parameter.value))

    @property
    def in_simulated_time(self) -> bool:
        """Whether nothing moves while a sample waits for its answer."""
        return False

    def stop_robot(self, fault: str) -> None:
        """Report a fault that this node has found; whoever commands the robot stops it."""
        self.get_logger().error(fault)

    def declare_settings(self, settings: type[S], **defaults: Any) -> S:
        """Declare the settings of a NamedTuple as parameters and return their values.

        Args:
            settings: the NamedTuple, which has a default for every field.
            defaults: of the node where they are not those of the settings, by field.

        Raises:
            InputError: a value given from outside is not allowed.
        """
        own = declared(settings)
        values = {
            declaration.name: declaration.to_parameter(defaults.get(declaration.name, declaration.default))
            for declaration in own
        }
        return from_parameters(settings, self.declare_checked(own, values))

    def declare_checked(
        self, settings: Sequence[Declared], defaults: Mapping[str, Any], tunable: bool = True
    ) -> dict[str, Any]:
        """Declare parameters that hold settings, and return their values by name, as `declare` does.

        Raises:
            InputError: a value given from outside has another type, is out of range or is not allowed.
        """
        values = declare(self, settings, defaults, tunable)
        # known only now, so that a refused declaration is explained there and not by rclpy's callback
        self.declared.extend(settings)
        return values

    def every(self, period: float, callback: Callable[[], None]) -> Timer:
        """Create a timer with a period (s) of the steady clock."""
        return self.create_timer(period, callback, clock=self._steady)

    def reading(self, topic: Topic, read: Callable[[str], R], take: Callable[[R], None]) -> Callable[[String], None]:
        """Return a callback that passes on what a reader finds in a text, and drops a text that it refuses."""

        def receive(message: String) -> None:
            try:
                value = read(message.data)
            except MessageError as error:
                self.drop(topic, str(error))
                return
            take(value)

        return receive

    def drop(self, topic: Topic, reason: str) -> None:
        """Count a discarded message and log a throttled warning."""
        self._drops += 1
        self._last_drop = f"{topic.name}: {one_line(reason)}"
        self.get_logger().warning(
            f"dropped a message on {self._last_drop} ({self._drops} so far)",
            throttle_duration_sec=WARNING_PERIOD,
        )
