# SPDX-License-Identifier: Apache-2.0
"""Messages of random and mutated kinds for String and JointState topics, the same ones for the same seed."""

from __future__ import annotations

import json
import random
from array import array
from collections.abc import Callable, Sequence
from typing import Any

from builtin_interfaces.msg import Time
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from fivebar_description.interface import ACTIVE_JOINTS, JOINTS, START_STAMP_NS, Topic
from fivebar_description.ros.messages import joint_state, message_class

NUMBERS = (0.0, -0.0, 1.0, -3.5, 1e-310, 1e101, -1e308, float("inf"), float("-inf"), float("nan"))
JSON_VALUES: tuple[Any, ...] = (
    None,
    True,
    5,
    -1,
    2**70,
    1.5,
    1e308,
    "x",
    "running",
    "completed",
    "\ud800",
    [],
    {},
    [[]],
)
WORDS = ("", "q11", "q22", "x", "sigma", "é" * 50, "\x1b[31m", "q" * 5000, "%s", "../..")
LARGE = 20_000
"""Number of values in a large message."""


class HostileMessages:
    """Makes messages from a seed; each may be an rclpy message, or bytes that take the place of one."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)

    def texts(self, valid: str) -> String | bytes:
        """Return a message for a topic on which texts like a valid one are expected."""
        kinds: tuple[Callable[[str], str | bytes], ...] = (
            self._changed_json,
            self._changed_json,
            self._cut,
            self._nested,
            self._garbage,
            self._bytes,
            self._damaged_text,
        )
        made = self._random.choice(kinds)(valid)
        return made if isinstance(made, bytes) else String(data=made)

    def joints(self, names: Sequence[str] = JOINTS) -> JointState | bytes:
        """Return a message for a topic on which JointStates with some names are expected."""
        stamp = self._random.choice((0, 1, START_STAMP_NS, START_STAMP_NS + 2_000_000 * self._random.randrange(10_000)))
        values = [self._random.choice(NUMBERS) for _ in names]
        message = joint_state(stamp, names, values, values, values)
        kind = self._random.randrange(8)
        if kind == 0:
            message.header.stamp = Time(sec=self._random.choice((-(2**31), -1, 2**31 - 1)), nanosec=2**32 - 1)
        elif kind == 1:
            message.name = [self._random.choice(WORDS) for _ in range(self._random.randrange(8))]
        elif kind == 2:
            message.position = array("d", [0.0] * self._random.choice((0, 1, 3, 5, LARGE)))
        elif kind == 3:
            message.name, message.position = ["q11"] * LARGE, array("d", [0.0] * LARGE)
        elif kind == 4:
            return self._bytes("")
        elif kind == 5:
            return self._damaged(serialize_message(message))
        return message

    def any(self, topic: Topic) -> Any:
        """Return a message of a topic's type, of random content where that is known, or bytes in its place."""
        if topic.type == "sensor_msgs/msg/JointState":
            return self.joints(self._random.choice((JOINTS, ACTIVE_JOINTS, ("x", "y"), ("sigma",))))
        if topic.type == "std_msgs/msg/String":
            return self.texts('{"state": "running", "sample": 5}')
        message = message_class(topic)()
        header = getattr(message, "header", None)
        if header is not None:
            seconds = self._random.choice((-(2**31), -1, 0, 1, 2**31 - 1))
            header.stamp = Time(sec=seconds, nanosec=self._random.choice((0, 2**32 - 1)))
            header.frame_id = self._random.choice(WORDS)
        for name in ("angular_velocity", "linear_acceleration"):
            if (vector := getattr(message, name, None)) is not None:
                vector.x, vector.y, vector.z = (self._random.choice(NUMBERS) for _ in range(3))
        if isinstance(getattr(message, "data", None), float):
            message.data = self._random.choice(NUMBERS)
        return self._random.choice((message, self._damaged(serialize_message(message)), self._bytes("")))

    def _changed_json(self, valid: str) -> str:
        content = json.loads(valid)
        for key in self._random.sample(sorted(content), self._random.randint(0, min(2, len(content)))):
            content[key] = self._random.choice(JSON_VALUES)
        if self._random.random() < 0.3:
            content[self._random.choice(WORDS)] = self._random.choice(JSON_VALUES)
        return json.dumps(content)

    def _cut(self, valid: str) -> str:
        return valid[: self._random.randrange(len(valid) + 1)]

    def _nested(self, valid: str) -> str:
        return self._random.choice(("[", '{"values":', '[{"a":')) * self._random.choice((20, 5000))

    def _garbage(self, valid: str) -> str:
        return self._random.choice(("", "x", "null", "[]", "NaN", '{"sample": 5}', '"' + "y" * LARGE, *WORDS))

    def _bytes(self, valid: str) -> bytes:
        return self._random.randbytes(self._random.choice((0, 1, 4, 8, 40, 4000)))

    def _damaged_text(self, valid: str) -> bytes:
        return self._damaged(serialize_message(String(data=valid)))

    def _damaged(self, data: bytes) -> bytes:
        changed = bytearray(data)
        for _ in range(self._random.randint(1, 4)):
            changed[self._random.randrange(4, len(changed))] = self._random.randrange(256)
        return bytes(changed)
