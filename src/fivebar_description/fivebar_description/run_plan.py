# SPDX-License-Identifier: Apache-2.0
"""Facts that all nodes of a run share: the plan, values on which they must agree, and the stamp of sample 0.

Nothing here needs ROS.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple

from pydantic import Field

from fivebar_description.interface import LATEST_STAMP_NS, NANOSECONDS, START_STAMP_NS
from fivebar_description.outside_text import LARGEST_COUNT, Count, OutsideModel, one_line, read_object
from fivebar_description.robot_file import load_robot

DIGEST_LENGTH = 12

WORKING_MODE_AT_START = "working_mode (at the start)"
"""The first two signs of the working mode, for nodes that know only those."""

HOMING = "homing (first waypoint)"
LEAD_SAMPLES = "lead_samples (delay of the drives, where the state is estimated)"

START = "start"
"""Key of the facts for the plant: the fields of `MotionStart`."""


class PlanText(OutsideModel):
    """The fields of `run/plan`."""

    digest: Annotated[str, Field(max_length=DIGEST_LENGTH)]
    values: dict[str, Any]
    pid: Count = 0


class EpochText(OutsideModel):
    """The fields of `run/epoch`."""

    epoch_ns: Annotated[int, Field(gt=0, le=LATEST_STAMP_NS)] | None


class MotionStart(NamedTuple):
    """The facts of a motion for the plant.

    Attributes:
        samples: number of its last sample.
        joints: angles in which the robot starts (rad): q11, q12, q21, q22.
        announces: whether each sample announces in lockstep which late readings come with it.
    """

    samples: int
    joints: tuple[float, float, float, float]
    announces: bool


class RunPlan(NamedTuple):
    """A plan as it was published: a digest of all values, the values by name, and the process that has published it."""

    digest: str
    values: dict[str, Any]
    pid: int | None = None

    @property
    def start(self) -> MotionStart | None:
        """The facts for the plant; None where the plan does not say them, or not rightly."""
        told = self.values.get(START)
        if not isinstance(told, dict) or set(told) != set(MotionStart._fields):
            return None
        samples, joints, announces = told["samples"], told["joints"], told["announces"]
        angles = isinstance(joints, list) and all(type(joint) is float and math.isfinite(joint) for joint in joints)
        counted = type(samples) is int and 0 < samples <= LARGEST_COUNT
        if not (counted and angles and len(joints) == 4 and isinstance(announces, bool)):
            return None
        return MotionStart(samples, (joints[0], joints[1], joints[2], joints[3]), announces)


class Difference(NamedTuple):
    """A value on which a node and the plan differ."""

    name: str
    here: Any
    there: Any

    def __str__(self) -> str:
        return f"{self.name}: {_shown(self.here)} here, {_shown(self.there)} in the plan"


def robot_value(robot: str) -> dict[str, str]:
    """Return what stands for a robot in a plan: its file, and a digest of its parameters, which alone is compared."""
    return {"file": robot, "content": _digest(load_robot(robot))}


def plan_text(values: Mapping[str, Any]) -> str:
    """Return a plan as the text of `run/plan`, from this process."""
    return json.dumps({"digest": _digest(values), "values": values, "pid": os.getpid()})


def read_plan(text: str) -> RunPlan:
    """Return the plan of a text.

    Raises:
        MessageError: it is not that of a plan.
    """
    content = read_object(text, PlanText)
    return RunPlan(content["digest"], content["values"], content.get("pid"))


def difference(own: Mapping[str, Any], plan: RunPlan) -> Difference | None:
    """Return the first value that a node and the plan both name and that is not the same in both; None for none."""
    for name, here in json.loads(json.dumps(own)).items():
        if name in plan.values and _compared(here) != _compared(plan.values[name]):
            return Difference(name, here, plan.values[name])
    return None


def epoch_text(epoch_ns: int | None) -> str:
    """Return the stamp of sample 0 (ns), None while no run is on, as the text of `run/epoch`."""
    return json.dumps({"epoch_ns": epoch_ns})


def read_epoch(text: str) -> int | None:
    """Return the stamp of sample 0 (ns) of a text, None for no run.

    Raises:
        MessageError: it is not that of an epoch.
    """
    epoch_ns: int | None = read_object(text, EpochText)["epoch_ns"]
    return epoch_ns


def next_epoch(now_ns: int, rate_hz: int) -> int:
    """Return the first multiple of the period from a moment (ns) on, as the stamp of sample 0."""
    period = NANOSECONDS // rate_hz
    return max(-(-now_ns // period) * period, START_STAMP_NS)


def _compared(value: Any) -> Any:
    return value["content"] if isinstance(value, dict) and "content" in value else value


def _shown(value: Any) -> str:
    if isinstance(value, dict) and {"file", "content"} <= set(value):
        value = f"{value['file']} (content {value['content']})"
    return one_line(str(value))


def _digest(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:DIGEST_LENGTH]
