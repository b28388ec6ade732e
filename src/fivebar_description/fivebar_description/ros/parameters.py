"""Declares and checks node parameters with description, unit and range."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from fivebar_description.settings import Declared, declared
from fivebar_description.strict_yaml import InputError
from fivebar_description.suggestion import expected_one_of


class Spec(NamedTuple):
    """One parameter of a node.

    Attributes:
        name: its name.
        default: its default, which also fixes its type.
        description: one sentence on what it does.
        unit: its unit, "" for none.
        minimum, maximum: its range, for numbers.
        choices: the allowed words, for strings.
        tunable: whether it may be changed while the node runs.
        check: returns what else is wrong with a value, None if nothing.
        number: whether a single number may stand in the place of an array of them.
    """

    name: str
    default: Any
    description: str
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    tunable: bool = False
    check: Callable[[Any], str | None] | None = None
    number: bool = False

    def descriptor(self) -> ParameterDescriptor:
        """Return the descriptor that `ros2 param describe` shows."""
        constraints = []
        if self.unit:
            constraints.append(f"unit: {self.unit}")
        if self.choices:
            constraints.append(f"one of: {', '.join(self.choices)}")
        descriptor = ParameterDescriptor(
            name=self.name,
            description=self.description,
            additional_constraints="; ".join(constraints),
            read_only=not self.tunable,
            dynamic_typing=self.number,
        )
        if self.minimum is not None and self.maximum is not None:
            if isinstance(self.default, float):
                descriptor.floating_point_range = [
                    FloatingPointRange(from_value=float(self.minimum), to_value=float(self.maximum))
                ]
            elif isinstance(self.default, int):
                descriptor.integer_range = [IntegerRange(from_value=int(self.minimum), to_value=int(self.maximum))]
        return descriptor

    def problem(self, value: Any) -> str | None:
        """Return what is wrong with a value beyond its type and range, None if nothing."""
        value = as_tuple(value)
        numbers = value if isinstance(value, tuple) else (value,)
        if any(isinstance(number, float) and not math.isfinite(number) for number in numbers):
            return "expected finite numbers"
        if self.choices and value not in self.choices:
            return expected_one_of(value, self.choices)
        return self.check(value) if self.check is not None else None


def specs_of(settings: type[tuple[Any, ...]], **defaults: Any) -> tuple[Spec, ...]:
    """Return the parameters that hold the settings of a NamedTuple; `settings.from_parameters` makes it of them.

    Args:
        settings: the NamedTuple, which has a default for every field.
        defaults: of the node where they are not those of the settings, by field.
    """
    return tuple(spec_of(one, one.to_parameter(defaults.get(one.name, one.default))) for one in declared(settings))


def spec_of(one: Declared, default: Any) -> Spec:
    """Return the parameter that holds a setting, with a default as a parameter has it."""
    setting, none = one.setting, one.none
    lower = setting.at_least if setting.above is None else setting.above
    upper = setting.at_most if setting.below is None else setting.below
    if lower is not None and isinstance(none, float | int):
        lower = min(lower, none)
    return Spec(
        one.name,
        default,
        setting.description if none is None else f"{setting.description} {none!r} for none.",
        setting.unit,
        lower,
        upper,
        () if one.shape.depth else setting.choices,
        setting.tunable,
        one.problem,
        one.shape.single,
    )


def declare(node: Node, specs: Sequence[Spec]) -> dict[str, Any]:
    """Declare parameters and return their values, arrays as tuples.

    Raises:
        InputError: a value given from outside has another type, is out of range or is not allowed.
    """
    return {spec.name: _declare_one(node, spec) for spec in specs}


def _declare_one(node: Node, spec: Spec) -> Any:
    try:
        value = node.declare_parameter(spec.name, spec.default, spec.descriptor()).value
    except InvalidParameterTypeException as error:
        raise InputError(f"{node.get_name()}: parameter {spec.name}: {_one_line(error)}") from error
    except InvalidParameterValueException as error:
        bounds = f"expected {spec.minimum} to {spec.maximum} {spec.unit}".rstrip()
        expected = "" if spec.minimum is None else f"{bounds}: "
        raise InputError(f"{node.get_name()}: parameter {spec.name}: {expected}{_one_line(error)}") from error
    if value is None:
        example = list(spec.default) if isinstance(spec.default, tuple) else spec.default
        raise InputError(
            f"{node.get_name()}: parameter {spec.name}: has no value, as ROS reads an empty list:"
            f" expected a value such as {example!r}"
        )
    value = as_tuple(value)
    if spec.number:
        value = value if isinstance(value, tuple) else (value,)
        if not all(isinstance(one, float | int) and not isinstance(one, bool) for one in value):
            raise InputError(f"{node.get_name()}: parameter {spec.name}: {value!r}: expected numbers")
    problem = spec.problem(value)
    if problem is not None:
        shown = list(value) if isinstance(value, tuple) else value
        raise InputError(f"{node.get_name()}: parameter {spec.name}: {shown!r}: {problem}")
    return value


def as_tuple(value: Any) -> Any:
    """Return an array as a tuple, any other value as it is."""
    return tuple(value) if isinstance(value, Sequence) and not isinstance(value, str) else value


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())


def check_changes(specs: Sequence[Spec], parameters: Sequence[Parameter]) -> SetParametersResult:
    """Return whether a change of parameters may be made; types and ranges are checked by rclpy itself."""
    by_name = {spec.name: spec for spec in specs}
    for parameter in parameters:
        spec = by_name.get(parameter.name)
        problem = spec.problem(parameter.value) if spec is not None else None
        if problem is not None:
            return SetParametersResult(successful=False, reason=f"{parameter.name}: {problem}")
    return SetParametersResult(successful=True)
