"""Parameters of nodes: declared and checked by the settings that they hold, and the run's file as those of a node."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.parameter import Parameter

from fivebar_description.errors import unwrapped
from fivebar_description.scenario_file import DEFAULT_SCENARIO, read_content, scenario_path
from fivebar_description.settings import Declared, Setting, SettingShape, keys_of, section_keys, with_keys
from fivebar_description.strict_yaml import InputError, StrictModel, validate

if TYPE_CHECKING:
    from fivebar_description.ros.node import GraphNode

M = TypeVar("M", bound=StrictModel)

SCENARIO = Declared(
    "scenario",
    str,
    False,
    DEFAULT_SCENARIO,
    Setting(
        "The run's file: the name of a shipped scenario, or the path to a YAML file. Parameters with its keys override"
        " it."
    ),
    SettingShape(str),
)


def descriptor_of(one: Declared, default: Any, tunable: bool) -> ParameterDescriptor:
    """Return the descriptor of the parameter that holds a setting, which `ros2 param describe` shows."""
    setting, none = one.setting, one.none
    constraints = []
    if setting.unit:
        constraints.append(f"unit: {setting.unit}")
    if setting.choices and not one.shape.depth:
        constraints.append(f"one of: {', '.join(setting.choices)}")
    descriptor = ParameterDescriptor(
        name=one.name,
        description=setting.description if none is None else f"{setting.description} {none!r} for none.",
        additional_constraints="; ".join(constraints),
        read_only=not tunable,
        dynamic_typing=one.shape.single,
    )
    lower, upper = _range(one)
    if lower is not None and upper is not None:
        if isinstance(default, float):
            descriptor.floating_point_range = [FloatingPointRange(from_value=float(lower), to_value=float(upper))]
        elif isinstance(default, int):
            descriptor.integer_range = [IntegerRange(from_value=int(lower), to_value=int(upper))]
    return descriptor


def _range(one: Declared) -> tuple[float | None, float | None]:
    """Return the range of the parameter that holds a setting, with what stands for none."""
    setting, none = one.setting, one.none
    lower = setting.at_least if setting.above is None else setting.above
    upper = setting.at_most if setting.below is None else setting.below
    if lower is not None and isinstance(none, float | int):
        lower = min(lower, none)
    return lower, upper


def declare(
    node: GraphNode, settings: Sequence[Declared], defaults: Mapping[str, Any], tunable: bool = True
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
    for one in settings:
        default, place = defaults[one.name], f"{node.get_name()}: parameter {one.name}"
        descriptor = descriptor_of(one, default, tunable and one.setting.tunable)
        try:
            value = as_tuple(node.declare_parameter(one.name, default, descriptor).value)
        except InvalidParameterTypeException as error:
            raise InputError(f"{place}: {unwrapped(error)}") from error
        except InvalidParameterValueException as error:
            lower, upper = _range(one)
            bounds = f"expected {lower} to {upper} {one.setting.unit}".rstrip()
            expected = "" if lower is None else f"{bounds}: "
            raise InputError(f"{place}: {expected}{unwrapped(error)}") from error
        if value is None:
            raise InputError(f"{place}: has no value, as ROS reads an empty list: expected a value such as {default!r}")
        if one.shape.single:
            value = value if isinstance(value, tuple) else (value,)
            if not all(isinstance(part, float | int) and not isinstance(part, bool) for part in value):
                raise InputError(f"{place}: {value!r}: expected numbers")
        problem = one.problem(value)
        if problem is not None:
            raise InputError(f"{place}: {list(value) if isinstance(value, tuple) else value!r}: {problem}")
        values[one.name] = value
    # known only now, so that a refused declaration is explained here and not by rclpy's callback
    node.declared.extend(settings)
    return values


def as_tuple(value: Any) -> Any:
    """Return an array as a tuple, any other value as it is."""
    return tuple(value) if isinstance(value, Sequence) and not isinstance(value, str) else value


def check_changes(settings: Sequence[Declared], parameters: Sequence[Parameter]) -> SetParametersResult:
    """Return whether a change of parameters may be made; types and ranges are checked by rclpy itself."""
    by_name = {one.name: one for one in settings}
    for parameter in parameters:
        one = by_name.get(parameter.name)
        problem = one.problem(as_tuple(parameter.value)) if one is not None else None
        if problem is not None:
            return SetParametersResult(successful=False, reason=f"{parameter.name}: {problem}")
    return SetParametersResult(successful=True)


class FileParameters(Generic[M]):
    """The keys of a run's file that a node uses, declared as its parameters.

    The file gives the defaults; a key that the file leaves out has the default that the robot and the other keys give
    it. A value that is set beside the file takes its place, and the whole is checked again.

    Attributes:
        file: the file with these values.
        path: of the file.
    """

    file: M
    path: Path

    def __init__(
        self,
        node: GraphNode,
        model: type[M],
        names: Sequence[str],
        sections: Callable[[M], Mapping[str, tuple[Any, ...]]] | None = None,
        tunable: bool = False,
        default: str = DEFAULT_SCENARIO,
    ) -> None:
        """Declare the parameters.

        Args:
            node: of them.
            model: what the file has to fit.
            names: of keys, of whole sections, or of keys in sections.
            sections: returns sections whose keys depend on what else the file says, as those of a law do.
            tunable: whether settings that may be tuned may be changed while the node runs.
            default: the scenario where the node is told of none.

        Raises:
            InputError: the file cannot be read, or it or a parameter does not fit.
        """
        self._node, self._model, self._tunable = node, model, tunable
        name = declare(node, (SCENARIO,), {SCENARIO.name: default})[SCENARIO.name]
        self.path = scenario_path(name)
        self._keys: dict[str, Declared] = {}
        self._source = f"{node.get_name()}: {self.path}"
        self._content = read_content(self.path)
        self.file = validate(self._content, model, self._source)
        keys = keys_of(model, names)
        # what decides about the defaults of others comes first
        for part in ([key for key in keys if "." not in key.name], [key for key in keys if "." in key.name]):
            self._declare(part, {key.name: attrgetter(key.name)(self.file) for key in part})
        for section, settings in ({} if sections is None else sections(self.file)).items():
            own = section_keys(type(settings), f"{section}.")
            self._declare(own, {key.name: attrgetter(key.name.partition(".")[2])(settings) for key in own})

    def change(self, values: Mapping[str, Any]) -> None:
        """Take changed parameters into the file and check it; those that are none of its keys are left out.

        Raises:
            InputError: the file does not fit with them.
        """
        changes = {name: self._keys[name].to_file(value) for name, value in values.items() if name in self._keys}
        if changes:
            content = with_keys(self._content, changes)
            self.file, self._content = validate(content, self._model, self._source), content

    def _declare(self, keys: Sequence[Declared], present: Mapping[str, Any]) -> None:
        defaults = {key.name: key.to_parameter(present[key.name]) for key in keys}
        self._keys |= {key.name: key for key in keys}
        values = declare(self._node, keys, defaults, self._tunable)
        self.change({name: value for name, value in values.items() if value != as_tuple(defaults[name])})
