# SPDX-License-Identifier: Apache-2.0
"""The run's file as parameters of a node."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any, Generic, TypeVar

from fivebar_description.ros.base_node import BaseNode
from fivebar_description.ros.parameters import as_tuple
from fivebar_description.scenario_file import DEFAULT_SCENARIO, read_content, scenario_path
from fivebar_description.settings import Declared, Setting, SettingShape, keys_of, section_keys, with_keys
from fivebar_description.strict_yaml import StrictModel, validate

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
        node: BaseNode,
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
        name = node.declare_checked((SCENARIO,), {SCENARIO.name: default})[SCENARIO.name]
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
        values = self._node.declare_checked(keys, defaults, self._tunable)
        self.change({name: value for name, value in values.items() if value != as_tuple(defaults[name])})
