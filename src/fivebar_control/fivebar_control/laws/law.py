# SPDX-License-Identifier: Apache-2.0
"""Definition of a control law: a name, settings, memory and a pure step function.

A law is one module with a settings class, the memory before the first sample, a function `step` and an entry `LAW`.
`registry` lists the laws of this package; a law from elsewhere is named in a scenario by its module,
`controller: my_package.my_law:LAW`. Nodes, the offline runner, the compiled engine and the planner's screen all run the
same step, so it must be a plain module-level function of numbers that numba can compile. One that it cannot, such as a
law with a solver from a library, says so (`compiles`), and the engine interprets its loop, which takes longer.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.laws.reference import Reference
from fivebar_control.laws.torque import UNDEFINED, Torque
from fivebar_control.model.line import Line
from fivebar_control.model.state import Platform, State, WorkingMode
from fivebar_description.interface import Topic, torque_topic
from fivebar_description.parameters import FiveBar
from fivebar_description.strict_yaml import InputError

MIN_AUTHORITY = 0.3
"""Least |n . v1| at a crossing for a law that controls the direction n normal to the path: below it this direction is
nearly the uncontrollable t_s."""


MOST_AHEAD = 50
"""Samples that a law may look ahead at most."""


class Instant(NamedTuple):
    """Input of a law at one sample.

    Attributes:
        state: measured or estimated state.
        reference: desired instant.
        line: straight line through the reference along the current path segment; NaN where the segment is not straight.
        mode: working mode of the motion.
        zone_weight: blending weight by cond(A) (4.1.2), positive inside a blending zone.
        period: between two samples (s).
        ahead: the reference of the samples that follow, for a law that looks ahead; else None.
    """

    state: State
    reference: Reference
    line: Line
    mode: WorkingMode
    zone_weight: float
    period: float
    ahead: tuple[Platform, ...] | None


Step = Callable[[FiveBar, Instant, Any, Any], tuple[Torque, Any]]
"""(robot, instant, memory, settings as numbers) -> torque (Nm), memory for the next sample.

A law without memory takes and returns None.
"""


def unchanged(memory: Any) -> Any:
    """Return the memory unchanged: a gap in the samples does not affect it."""
    return memory


def nothing_to_load() -> None:
    """Load nothing: the law needs no more than its module."""


def present_only(settings: Any) -> int:
    """Return that a law needs the reference of no further samples."""
    return 0


FREE_WEIGHT = 1e-3
"""Weight on torque ((m/s^2 / Nm)^2) of a law that inverts the model: hardly any."""


class Feedback(NamedTuple):
    """How a law answers a displacement, as the screen judges it.

    Attributes:
        kp, kd: gains (1/s^2, 1/s); the defaults are those of the unified law for DexTAR.
        weight: on torque ((m/s^2 / Nm)^2).
        observer_rate: bandwidth of its disturbance observer (1/s), 0 for none.
    """

    kp: float = 6400.0
    kd: float = 160.0
    weight: float = FREE_WEIGHT
    observer_rate: float = 0.0


def feedback_by_name(settings: Any) -> Feedback:
    """Return the feedback of a law whose settings call it as `Feedback` does; what they lack has the default."""
    return Feedback(**{name: float(getattr(settings, name)) for name in Feedback._fields if name in settings._fields})


class Law(NamedTuple):
    """A control law.

    Attributes:
        name: a word in lower case; its candidate torque is published on `NAME/torque`.
        title: its name in figures and pages.
        settings: class of its settings (see `fivebar_description.settings`); every field has a default.
        step: the law itself.
        memory: before the first sample.
        after_gap: returns the memory to continue with where samples are missing.
        topic_name: of the candidate torque where it is not `NAME/torque`.
        executable: the node that publishes the candidate.
        regular_on_locus: whether it is defined on the Type 2 locus, so that it can cross on its own.
        meets_type_1: whether it is defined where a leg is stretched or folded.
        observes_disturbance: whether it estimates disturbance torques itself; for all others an estimator may.
        min_authority: least |n . v1| at which it can cross.
        samples_ahead: from its settings, of how many samples that follow it needs the reference.
        compiles: whether numba can compile the step; without, the engine interprets the loop around it.
        prepare: (robot, mode, references of all samples, period, settings as numbers) -> the memory before the
            first sample, for a law that needs the whole plan.
        follow: (memory, float64[n, 6] as in `Platform`) -> the memory to go on with where a motion begins that is
            planned during a run, or changes, of which these are all references. Without it a law that needs the whole
            plan is refused requested motions.
        torque_limit: the field of its settings, if they have it, that is the limit of the torque (Nm) which the law
            keeps itself; None in it stands for that of the drives.
        torque_rate_limit: likewise the limit of the torque's change (Nm/s); None in it stands for that of the last
            node.
        feedback: from its settings, how it answers a displacement; the screen judges crossings by it.
        like_unified: whether what its settings share with those of `unified` is by default that of section `unified`.
        timed: whether it follows the plan in time; studies that run all laws run others where they are asked to.
        warm_up: loads what the first step needs beyond its module, such as a solver: a node does so before it is ready,
            since a first sample that takes seconds looks like a node that does not answer.
    """

    name: str
    title: str
    settings: type[tuple[Any, ...]]
    step: Step
    memory: Any = None
    after_gap: Callable[[Any], Any] = unchanged
    topic_name: str = ""
    executable: str = "law_controller"
    regular_on_locus: bool = True
    meets_type_1: bool = False
    observes_disturbance: bool = False
    min_authority: float = 0.0
    samples_ahead: Callable[[Any], int] = present_only
    compiles: bool = True
    prepare: Callable[[FiveBar, WorkingMode, Sequence[Platform], float, Any], Any] | None = None
    follow: Callable[[Any, NDArray[np.float64]], Any] | None = None
    torque_limit: str = "torque_limit"
    torque_rate_limit: str = "torque_rate_limit"
    feedback: Callable[[Any], Feedback] = feedback_by_name
    like_unified: bool = False
    timed: bool = True
    warm_up: Callable[[], None] = nothing_to_load

    @property
    def topic(self) -> Topic:
        """Where its candidate torque is published."""
        return torque_topic(self.topic_name or self.name)

    def first_memory(
        self,
        robot: FiveBar,
        mode: WorkingMode,
        references: Callable[[], Sequence[Platform]],
        period: float,
        settings: Any,
    ) -> Any:
        """Return its memory before the first sample.

        Args:
            robot: its nominal robot.
            mode: working mode of the motion.
            references: returns those of all samples, for a law that needs the whole plan.
            period: between two samples (s).
            settings: as numbers.
        """
        if self.prepare is None:
            return self.memory
        return self.prepare(robot, mode, references(), period, settings)


def check_law(law: Law) -> None:
    """Refuse a law that cannot run.

    Raises:
        InputError: its name is no word for a topic, or its settings have no defaults.
    """
    if not re.fullmatch(r"[a-z][a-z0-9_]*", law.name):
        raise InputError(f"name {law.name!r}: expected a word of lower-case letters, digits and underscores")
    try:
        law.settings()
    except TypeError as error:
        raise InputError(f"settings {law.settings.__name__}: every field needs a default: {error}") from error


def no_step(robot: FiveBar, instant: Instant, memory: None, settings: None) -> tuple[Torque, None]:
    """Stand in for the constraint law of a controller that has none."""
    return UNDEFINED, memory


class TunedLaw(NamedTuple):
    """A law with its settings."""

    law: Law
    settings: tuple[Any, ...]

    @property
    def samples_ahead(self) -> int:
        """Number of samples ahead whose reference the law needs."""
        return self.law.samples_ahead(self.settings)

    @property
    def feedback(self) -> Feedback:
        """How it answers a displacement."""
        return self.law.feedback(self.settings)

    def within(self, torque: float | None, torque_rate: float) -> TunedLaw:
        """Return the law with the limits (Nm, Nm/s) that its settings leave open; None and infinite for none."""
        tuned = self
        if getattr(self.settings, self.law.torque_limit, 0.0) is None:
            tuned = tuned._with(self.law.torque_limit, torque)
        if getattr(self.settings, self.law.torque_rate_limit, 0.0) is None and math.isfinite(torque_rate):
            tuned = tuned._with(self.law.torque_rate_limit, torque_rate)
        return tuned

    def unlimited(self) -> TunedLaw:
        """Return the law without the torque limit that its settings may have."""
        return self._with(self.law.torque_limit, None)

    def limited_to(self, torque: float) -> TunedLaw:
        """Return the law with a torque limit (Nm), infinite for none, or the lower one of its settings."""
        own: float | None = getattr(self.settings, self.law.torque_limit, None)
        if not math.isfinite(torque):
            return self
        return self._with(self.law.torque_limit, torque if own is None else min(own, torque))

    def _with(self, field: str, limit: float | None) -> TunedLaw:
        settings: Any = self.settings
        return self._replace(settings=settings._replace(**{field: limit})) if field in settings._fields else self
