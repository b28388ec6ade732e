# SPDX-License-Identifier: Apache-2.0
"""Costs of a cycle of the control chain, from a reading to its torque and after it: times per item.

The nodes of a process run as ever, with their functions wrapped. Each item's time leaves out that of the items that it
calls; what the wrapping itself takes is measured and subtracted.
"""

from __future__ import annotations

import functools
import gc
import importlib
import json
import os
import statistics
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

from fivebar_bringup.runs.processes import NODE_GROUP, ProcessSpec

CALIBRATION = 20_000
"""Calls of an empty function by which the wrapping is measured."""

WARM_UP = 100
"""Cycles that do not count."""

REST = "bridge: readings to message, torque to drives"
DRIVES = "waiting for the drives' answers"

ITEMS: Mapping[str, tuple[str, ...]] = {
    DRIVES: ("fivebar_control.hardware.two_motors:TwoMotors.exchange",),
    "session of the drives: age of the torque, limits, lateness": (
        "fivebar_control.hardware.drive_session:DriveSession.cycle",
        "fivebar_control.hardware.drive_session:DriveSession.command",
        "fivebar_control.hardware.two_motors:TwoMotors.write",
    ),
    "messages passed on within the process": ("fivebar_description.ros.process_topics:ProcessTopics.dispatch",),
    "messages made": ("fivebar_description.joint_sample:JointSample.__init__",),
    "fields read and checked": ("fivebar_description.joint_sample:FieldReader.__call__",),
    "stamps to samples and back": (
        "fivebar_description.ros.run_agreement:RunAgreement.sample",
        "fivebar_description.ros.run_agreement:RunAgreement.stamp",
    ),
    "inputs joined by stamp": (
        "fivebar_description.ros.sampling_node:StampJoin.put",
        "fivebar_description.ros.sampling_node:StampJoin.arrival",
    ),
    "second publishers looked for": (
        "fivebar_description.ros.node:GraphNode.refuses",
        "fivebar_description.ros.node:GraphNode.has_second_publisher",
    ),
    "rest of the nodes' reception": ("fivebar_description.ros.sampling_node:SamplingNode._receiver",),
    "estimator: step of the filter": ("fivebar_control.estimation.compiled_estimator:CompiledEstimator._next",),
    "estimator: readings, memory, deviations": (
        "fivebar_control.estimation.estimator:StateEstimator.take",
        "fivebar_control.estimation.estimator:StateEstimator.commanded",
    ),
    "state_estimator: rest of its answer": (
        "fivebar_control.nodes.state_estimator:StateEstimatorNode.answer",
        "fivebar_control.nodes.state_estimator:StateEstimatorNode._end_wait",
    ),
    "trajectory_generator: rest of its answer": (
        "fivebar_control.nodes.trajectory_generator:TrajectoryGenerator.answer",
    ),
    "controllers and supervisor: rest of their answers": (
        "fivebar_control.ros.controller_node:ControllerNode.answer",
        "fivebar_control.nodes.supervisor:SupervisorNode.answer",
    ),
    "blender: rest of its answer": ("fivebar_control.nodes.blender:Blender.answer",),
    "blender: deadlines": ("fivebar_control.nodes.blender:Blender.admit",),
    "reference of the next sample": ("fivebar_control.planning.motion_queue:MotionQueue.window",),
    "reference for the laws": ("fivebar_control.loop.compiled_node_parts:CompiledLaw.expect",),
    "supervisor": ("fivebar_control.loop.compiled_node_parts:CompiledSupervisor.answer",),
    "laws": ("fivebar_control.loop.compiled_node_parts:CompiledLaw.answer",),
    "guard: blending, limits, faults": ("fivebar_control.loop.compiled_node_parts:CompiledGuard.answer",),
    "publishing on DDS": ("fivebar_description.ros.messages:Serializing.publish",),
}
"""Functions of the items, as MODULE:NAME."""

MAKERS = ("_receiver",)
"""Ends of the names of functions that make one: what they make is wrapped."""

TICK = "fivebar_control.ros.drive_bridge:DriveBridge._tick"
WRITTEN = "fivebar_control.hardware.drive_session:DriveSession.command"


class Costs:
    """Times (s) per item and cycle, those until the torque is written apart from those after it."""

    def __init__(self) -> None:
        """Begin without any, with the wrapping measured."""
        self.before = defaultdict[str, list[float]](list)
        self.after = defaultdict[str, list[float]](list)
        self.began = 0.0
        """When the first cycle that counts began (s), 0 before."""
        self._stack = list[str]()
        self._last = 0.0
        self._spent = defaultdict[str, float](float)
        self._until_written: dict[str, float] | None = None
        self._own = self._others = 0.0
        self._own, self._others = self._wrapping()

    def timed(self, item: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function that does the same, and whose time is that of an item."""
        stack, spent = self._stack, self._spent

        @functools.wraps(function)
        def call(*arguments: Any, **named: Any) -> Any:
            if not stack:
                return function(*arguments, **named)
            now = perf_counter()
            spent[stack[-1]] += now - self._last - self._others
            stack.append(item)
            self._last = perf_counter()
            try:
                return function(*arguments, **named)
            finally:
                now = perf_counter()
                spent[stack.pop()] += now - self._last - self._own
                self._last = perf_counter()

        return call

    def cycle(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function that does the same, and is a cycle where a torque is written in it."""

        @functools.wraps(function)
        def call(*arguments: Any, **named: Any) -> Any:
            if self._stack:
                return function(*arguments, **named)
            self._spent.clear()
            self._until_written = None
            self._stack.append(REST)
            self._last = perf_counter()
            try:
                return function(*arguments, **named)
            finally:
                self._spent[self._stack.pop()] += perf_counter() - self._last
                self._end()

        return call

    def written(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function that does the same, and after which the torque has been written."""

        @functools.wraps(function)
        def call(*arguments: Any, **named: Any) -> Any:
            try:
                return function(*arguments, **named)
            finally:
                if self._stack and self._until_written is None:
                    self._until_written = dict(self._spent)

        return call

    def _end(self) -> None:
        if self._until_written is None:
            return
        if len(self.before[REST]) == WARM_UP:
            self.began = perf_counter()
        for item in (REST, *ITEMS):
            until = self._until_written.get(item, 0.0)
            self.before[item].append(until)
            self.after[item].append(self._spent.get(item, 0.0) - until)

    def _wrapping(self) -> tuple[float, float]:
        """Return what a wrapped call adds to its own item, and to that of its caller (s)."""
        empty = self.timed("empty", _nothing)
        self._stack.append(REST)
        self._last = perf_counter()
        for _ in range(CALIBRATION):
            empty()
        self._spent[REST] += perf_counter() - self._last
        own, others = self._spent["empty"] / CALIBRATION, self._spent[REST] / CALIBRATION
        self._stack.clear()
        self._spent.clear()
        return own, others


class CycleCosts(NamedTuple):
    """The costs of the cycles of a process.

    Attributes:
        before, after: medians (s) by item, until the torque was written and after it.
        cycles: how many there were.
        collections: of garbage, since the first of them.
    """

    before: dict[str, float]
    after: dict[str, float]
    cycles: int
    collections: int = 0


class WatchedGroup(ProcessSpec):
    """A process whose nodes' cycles are itemised in a file in its folder."""

    @property
    def module(self) -> str:
        """The module that runs it."""
        return __name__ if super().module == NODE_GROUP else super().module


@contextmanager
def importable() -> Iterator[None]:
    """Have the processes that are started meanwhile find this module by its name."""
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join([*([before] if before else []), str(Path(__file__).parent)])
    try:
        yield
    finally:
        if before is None:
            del os.environ["PYTHONPATH"]
        else:
            os.environ["PYTHONPATH"] = before


def medians(costs: Costs) -> CycleCosts:
    """Return what the cycles after the first ones came to."""

    def middle(times: list[float]) -> float:
        return statistics.median(times[WARM_UP:] or [0.0])

    before = {item: middle(times) for item, times in costs.before.items()}
    after = {item: middle(times) for item, times in costs.after.items()}
    return CycleCosts(before, after, max(0, len(costs.before[REST]) - WARM_UP))


def read_costs(path: Path) -> CycleCosts:
    """Return the costs that a process has left in a file."""
    return CycleCosts(**json.loads(path.read_text(encoding="utf-8")))


def costs_file(parameters: Path) -> Path:
    """Return the file of a process by that of its parameters."""
    return parameters.with_suffix(".costs.json")


def wrap(costs: Costs) -> None:
    """Wrap the functions of all items."""
    for item, places in ITEMS.items():
        for place in places:
            timed = functools.partial(costs.timed, item)
            _replace(place, functools.partial(_made, timed) if place.endswith(MAKERS) else timed)
    _replace(WRITTEN, costs.written)
    _replace(TICK, costs.cycle)


def _made(change: Callable[[Any], Any], make: Callable[..., Any]) -> Callable[..., Any]:
    """Return what makes functions as before, each of them changed."""

    @functools.wraps(make)
    def made(*arguments: Any, **named: Any) -> Any:
        return change(make(*arguments, **named))

    return made


def _replace(place: str, change: Callable[[Any], Any]) -> None:
    module, _, name = place.partition(":")
    holder: Any = importlib.import_module(module)
    *outer, last = name.split(".")
    for one in outer:
        holder = getattr(holder, one)
    old = getattr(holder, last)
    new = change(old)
    setattr(holder, last, new)
    for other in () if outer else list(sys.modules.values()):
        # whoever has imported it by name
        if vars(other).get(last) is old:
            setattr(other, last, new)


def _nothing() -> None:
    """Do nothing."""


def main() -> None:
    """Run the nodes of a group as `node_group` does, and leave the costs of their cycles beside their parameters."""
    from fivebar_bringup.nodes import node_group

    words = sys.argv[1:]
    for module in words[: words.index("--ros-args")]:
        importlib.import_module(module)
    costs, collected = Costs(), list[float]()
    wrap(costs)
    gc.callbacks.append(lambda phase, _: collected.append(perf_counter()) if phase == "start" else None)
    try:
        node_group.main()
    finally:
        began = costs.began or perf_counter()
        found = medians(costs)._replace(collections=sum(moment > began for moment in collected))
        file = costs_file(Path(words[words.index("--params-file") + 1]))
        file.write_text(json.dumps(found._asdict()), encoding="utf-8")
