"""The run's file as the parameters of a node: the keys that the node uses, under their own names in the file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, TypeVar

from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.parameters import Spec, as_tuple, spec_of
from fivebar_description.scenario_file import DEFAULT_SCENARIO, read_content, scenario_path
from fivebar_description.settings import Declared, keys_of, section_keys, value_at, with_keys
from fivebar_description.strict_yaml import StrictModel, validate

M = TypeVar("M", bound=StrictModel)

SCENARIO = Spec(
    "scenario",
    DEFAULT_SCENARIO,
    "The run's file: the name of a shipped scenario, or the path to a YAML file. Parameters with its keys override it.",
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
        name = node.parameters((SCENARIO._replace(default=default),))[SCENARIO.name]
        self.path = scenario_path(name)
        self._content: dict[str, Any] = read_content(self.path)
        self.file = self._checked(self._content)
        self._keys: dict[str, Declared] = {}
        keys = keys_of(model, names)
        # what decides about the defaults of others comes first
        for part in ([key for key in keys if "." not in key.name], [key for key in keys if "." in key.name]):
            self._declare(part, {key.name: value_at(self.file, key.name) for key in part})
        for section, settings in ({} if sections is None else sections(self.file)).items():
            own = section_keys(type(settings), f"{section}.")
            self._declare(own, {key.name: value_at(settings, key.name.partition(".")[2]) for key in own})

    def change(self, values: Mapping[str, Any]) -> None:
        """Take changed parameters into the file; those that are none of its keys are left out.

        Raises:
            InputError: the file does not fit with them.
        """
        changes = {name: self._keys[name].to_file(value) for name, value in values.items() if name in self._keys}
        if changes:
            content = with_keys(self._content, changes)
            self.file, self._content = self._checked(content), content

    def _declare(self, keys: Sequence[Declared], present: Mapping[str, Any]) -> None:
        defaults = {key.name: key.to_parameter(present[key.name]) for key in keys}
        self._keys |= {key.name: key for key in keys}
        specs = [spec_of(key, defaults[key.name]) for key in keys]
        values = self._node.parameters([spec._replace(tunable=self._tunable and spec.tunable) for spec in specs])
        self.change({name: value for name, value in values.items() if value != as_tuple(defaults[name])})

    def _checked(self, content: Mapping[str, Any]) -> M:
        return validate(dict(content), self._model, f"{self._node.get_name()}: {self.path}")
