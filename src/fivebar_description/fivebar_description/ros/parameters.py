# SPDX-License-Identifier: Apache-2.0
"""Parameters of nodes: declared and checked by the settings that they hold, and the run's file as those of a node."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from fivebar_description.errors import unwrapped
from fivebar_description.settings import Declared
from fivebar_description.strict_yaml import InputError, StrictModel

if TYPE_CHECKING:
    pass

M = TypeVar("M", bound=StrictModel)


def descriptor_of(declaration: Declared, default: Any, tunable: bool) -> ParameterDescriptor:
    """Return the descriptor of the parameter that holds a setting, which `ros2 param describe` shows."""
    setting, none = declaration.setting, declaration.none
    constraints = []
    if setting.unit:
        constraints.append(f"unit: {setting.unit}")
    if setting.choices and not declaration.shape.depth:
        constraints.append(f"one of: {', '.join(setting.choices)}")
    descriptor = ParameterDescriptor(
        name=declaration.name,
        description=setting.description if none is None else f"{setting.description} {none!r} for none.",
        additional_constraints="; ".join(constraints),
        read_only=not tunable,
        dynamic_typing=declaration.shape.single,
    )
    lower, upper = _range(declaration)
    if lower is not None and upper is not None:
        if isinstance(default, float):
            descriptor.floating_point_range = [FloatingPointRange(from_value=float(lower), to_value=float(upper))]
        elif isinstance(default, int):
            descriptor.integer_range = [IntegerRange(from_value=int(lower), to_value=int(upper))]
    return descriptor


def _range(declaration: Declared) -> tuple[float | None, float | None]:
    """Return the range of the parameter that holds a setting, with what stands for none."""
    setting, none = declaration.setting, declaration.none
    lower = setting.at_least if setting.above is None else setting.above
    upper = setting.at_most if setting.below is None else setting.below
    if lower is not None and isinstance(none, float | int):
        lower = min(lower, none)
    return lower, upper


def declare(
    node: Node, settings: Sequence[Declared], defaults: Mapping[str, Any], tunable: bool = True
) -> dict[str, Any]:
    """Declare the parameters that hold settings, and return their values by name, arrays as tuples.

    Args:
        node: of the parameters.
        settings: which they hold.
        defaults: by name, as parameters have them.
        tunable: whether settings that may be tuned may be changed while the node runs.

    Raises:
        InputError: a value given from outside has another type, is out of range or is not allowed.
    """
    values: dict[str, Any] = {}
    for setting in settings:
        default, place = defaults[setting.name], f"{node.get_name()}: parameter {setting.name}"
        descriptor = descriptor_of(setting, default, tunable and setting.setting.tunable)
        _read_tuple(node, setting.name, default)
        try:
            value = as_tuple(node.declare_parameter(setting.name, default, descriptor).value)
        except InvalidParameterTypeException as error:
            raise InputError(f"{place}: {unwrapped(error)}") from error
        except InvalidParameterValueException as error:
            lower, upper = _range(setting)
            bounds = f"expected {lower} to {upper} {setting.setting.unit}".rstrip()
            expected = "" if lower is None else f"{bounds}: "
            raise InputError(f"{place}: {expected}{unwrapped(error)}") from error
        if value is None:
            raise InputError(f"{place}: has no value, as ROS reads an empty list: expected a value such as {default!r}")
        if setting.shape.single:
            value = value if isinstance(value, tuple) else (value,)
            if not all(isinstance(part, float | int) and not isinstance(part, bool) for part in value):
                raise InputError(f"{place}: {value!r}: expected numbers")
        problem = setting.problem(value)
        if problem is not None:
            raise InputError(f"{place}: {list(value) if isinstance(value, tuple) else value!r}: {problem}")
        values[setting.name] = value
    return values


def _read_tuple(node: Node, name: str, default: Any) -> None:
    """Read an array that was given as launch_ros writes that of a SetParameter: as a tuple of Python."""
    override = node._parameter_overrides.get(name)
    if override is None or override.type_ != Parameter.Type.STRING or not isinstance(as_tuple(default), tuple):
        return
    with suppress(ValueError, SyntaxError):
        value = ast.literal_eval(override.value)
        if isinstance(value, tuple):
            if any(isinstance(part, float) for part in value):
                value = tuple(map(float, value))
            node._parameter_overrides[name] = Parameter(name, value=list(value))


def as_tuple(value: Any) -> Any:
    """Return an array as a tuple, any other value as it is."""
    return tuple(value) if isinstance(value, Sequence) and not isinstance(value, str) else value


def check_changes(settings: Sequence[Declared], parameters: Sequence[Parameter]) -> SetParametersResult:
    """Return whether a change of parameters may be made; types and ranges are checked by rclpy itself."""
    by_name = {setting.name: setting for setting in settings}
    for parameter in parameters:
        declaration = by_name.get(parameter.name)
        problem = declaration.problem(as_tuple(parameter.value)) if declaration is not None else None
        if problem is not None:
            return SetParametersResult(successful=False, reason=f"{parameter.name}: {problem}")
    return SetParametersResult(successful=True)
