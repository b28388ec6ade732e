# SPDX-License-Identifier: Apache-2.0
"""Registry of controllers by name, which nodes, runners, studies and the command all read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from typing import Any, NamedTuple

from fivebar_control.laws.law import Instant, Law, TunedLaw, check_law
from fivebar_control.laws.robot_sizes import sizes_of_law
from fivebar_control.laws.torque import Torque
from fivebar_description.modules import PLACE, is_unopened, load_part
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import RobotFile
from fivebar_description.strict_yaml import InputError
from fivebar_description.suggestion import expected_one_of

OF_CONTROLLER = "controller"
"""In place of one of `SUPERVISIONS`: the controller's own."""

CONDITION, SIGMOID, ESTIMATE = SUPERVISIONS = ("condition", "sigmoid", "estimate")
"""Blending by 1/cond(A) in the planned zones (4.1.2, supervision by performance), by a sigmoid in time around each
planned crossing (figure 1.10, prerouted), or in zones as wide as the estimated state's speed makes them."""


class Controller(NamedTuple):
    """A controller, composed of one or two laws.

    Attributes:
        name: its name in scenarios.
        nominal: its law off the locus, or the only one.
        constraint: its law on the locus, None for no blending.
        weighting: what decides the blending, one of `SUPERVISIONS`.
    """

    name: str
    nominal: Law
    constraint: Law | None = None
    weighting: str = CONDITION

    @property
    def laws(self) -> tuple[Law, ...]:
        """Its laws, the nominal one first."""
        return (self.nominal,) if self.constraint is None else (self.nominal, self.constraint)

    @property
    def blended(self) -> bool:
        """Whether it blends in a constraint law near the locus."""
        return self.constraint is not None

    @property
    def crosses(self) -> bool:
        """Whether it is meant to cross the Type 2 locus."""
        return self.blended or self.nominal.regular_on_locus

    @property
    def needs_no_zones(self) -> bool:
        """Whether a single regular law needs no blending zones."""
        return not self.blended and self.nominal.regular_on_locus

    @property
    def takes_goals(self) -> bool:
        """Whether it follows motions that are planned during a run."""
        return self.needs_no_zones and all(law.prepare is None or law.follow is not None for law in self.laws)

    @property
    def follows_motions(self) -> bool:
        """Whether a law has to be told all references of a motion that begins during a run."""
        return any(law.follow is not None for law in self.laws)

    @property
    def meets_type_1(self) -> bool:
        """Whether every law is defined where a leg is stretched or folded."""
        return all(law.meets_type_1 for law in self.laws)

    @property
    def compiles(self) -> bool:
        """Whether numba can compile every law."""
        return all(law.compiles for law in self.laws)

    @property
    def observes_disturbance(self) -> bool:
        """Whether it estimates disturbance torques itself."""
        return self.nominal.observes_disturbance

    @property
    def min_authority(self) -> float:
        """Least |n . v1| at which all its laws can cross."""
        return max(law.min_authority for law in self.laws)


class TunedController(NamedTuple):
    """A controller with the settings of its laws."""

    controller: Controller
    nominal: TunedLaw
    constraint: TunedLaw | None = None

    @property
    def laws(self) -> tuple[TunedLaw, ...]:
        """Its laws, the nominal one first."""
        return (self.nominal,) if self.constraint is None else (self.nominal, self.constraint)

    def law_of_node(self, name: str) -> TunedLaw | None:
        """Return the law whose candidate a node publishes, None where the node has none of this controller."""
        return next((tuned for tuned in self.laws if tuned.law.executable == name), None)

    @property
    def samples_ahead(self) -> int:
        """Number of samples ahead whose reference the laws need."""
        return max(law.samples_ahead for law in self.laws)

    def limited_to(self, torque: float) -> TunedController:
        """Return the controller whose laws keep a torque limit (Nm) themselves, or the lower one of their settings."""
        constraint = None if self.constraint is None else self.constraint.limited_to(torque)
        return self._replace(nominal=self.nominal.limited_to(torque), constraint=constraint)


class Composition(NamedTuple):
    """The modules of this folder with the laws of a controller, and what decides the blending."""

    nominal: str
    constraint: str = ""
    weighting: str = CONDITION


COMPOSITIONS = {
    "ctc": Composition("ctc"),
    "multi_joint": Composition("ctc", "vhc_joint"),
    "multi_cartesian": Composition("ctc", "vhc_cartesian"),
    "multi_model_ctc": Composition("ctc", "multi_model", SIGMOID),
    "unified": Composition("unified"),
    "mpc": Composition("mpc"),
    "lqr": Composition("lqr"),
    "path": Composition("path"),
}
"""The controllers of this package by name."""


class Controllers(Mapping[str, Controller]):
    """The controllers of this package by name. The modules of a controller's laws are imported when it is asked for."""

    def __getitem__(self, name: str) -> Controller:
        """Return a controller."""
        return _composed(name)

    def __contains__(self, name: object) -> bool:
        """Return whether there is a controller of that name, without its laws."""
        return name in COMPOSITIONS

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(COMPOSITIONS)

    def __len__(self) -> int:
        """Return the number of controllers."""
        return len(COMPOSITIONS)


CONTROLLERS = Controllers()
"""The controllers of this package."""


@cache
def _composed(name: str) -> Controller:
    parts = COMPOSITIONS[name]
    constraint = _law_in(parts.constraint) if parts.constraint else None
    return Controller(name, _law_in(parts.nominal), constraint, parts.weighting)


def _law_in(module: str) -> Law:
    law: Law = import_module(f"{__package__}.{module}").LAW
    return law


def timed_controllers() -> tuple[str, ...]:
    """Return the names of those that follow the plan in time, which studies run unless they are told others."""
    return tuple(name for name, controller in CONTROLLERS.items() if all(law.timed for law in controller.laws))


def crossing_controllers() -> tuple[str, ...]:
    """Return the names of those that are meant to cross the Type 2 locus."""
    return tuple(name for name, controller in CONTROLLERS.items() if controller.crosses)


def goal_controllers() -> tuple[str, ...]:
    """Return the names of the controllers that follow motions that are planned during a run."""
    return tuple(name for name, controller in CONTROLLERS.items() if controller.takes_goals)


def own_laws() -> dict[str, Law]:
    """Return the laws of this package by name."""
    return {law.name: law for controller in CONTROLLERS.values() for law in controller.laws}


UNOPENED = "unopened"
"""Name of a law whose module is not imported: its own name is not known."""


def stays_unopened(name: str) -> bool:
    """Return whether a controller is a law outside this package that is not to be imported here."""
    return is_unopened() and name not in CONTROLLERS


class UnopenedSettings(NamedTuple):
    """The settings of a law whose module is not imported: none are known."""


def unopened_step(robot: FiveBar, instant: Instant, memory: Any, settings: Any) -> tuple[Torque, Any]:
    """Refuse to run a law whose module is not imported.

    Raises:
        InputError: always.
    """
    raise InputError("controller: the module of its law was not imported, so that it cannot run")


def unopened_controller(name: str) -> Controller:
    """Return a controller by its name, one outside this package without its law's module.

    What is not known of such a law is taken so that no motion is refused which the law itself can make.
    """
    if name in CONTROLLERS:
        return CONTROLLERS[name]
    return Controller(name, Law(UNOPENED, name, UnopenedSettings, unopened_step, meets_type_1=True, compiles=False))


def find_controller(name: str) -> Controller:
    """Return a controller by its name, or one that consists of a single law outside this package.

    Raises:
        InputError: there is none of that name, or the law cannot be loaded.
    """
    if name in CONTROLLERS:
        return CONTROLLERS[name]
    problem = controller_problem(name)
    if problem is not None:
        raise InputError(f"controller: {name!r}: {problem}")
    return unopened_controller(name) if stays_unopened(name) else Controller(name, _plugin(name))


def controller_problem(name: str) -> str | None:
    """Return why there is no such controller, None where there is one."""
    if name in CONTROLLERS:
        return None
    if not PLACE.fullmatch(name):
        return expected_one_of(name, CONTROLLERS, ", or my_package.my_law:LAW")
    if is_unopened():
        return None
    try:
        _plugin(name)
    except InputError as error:
        return str(error).removeprefix(f"{name}: ")
    return None


def default_tuning(controller: Controller, robot: RobotFile | None = None) -> TunedController:
    """Return a controller with the default settings of its laws, those of a robot or else those of DexTAR."""
    tuned = [TunedLaw(law, law.settings(**sizes_of_law(law.name, robot))) for law in controller.laws]
    return TunedController(controller, *tuned)


@cache
def _plugin(name: str) -> Law:
    """Return a law outside this package.

    Raises:
        InputError: it cannot be loaded; where the message has not the name, the caller adds it.
    """
    law = load_part(name)
    if not isinstance(law, Law):
        raise InputError(f"expected a fivebar_control.laws.law.Law, found {type(law).__name__}")
    check_law(law)
    laws = own_laws()
    if law.name in laws and law != laws[law.name]:
        raise InputError(f"the name {law.name!r} is taken, expected another one")
    return law
