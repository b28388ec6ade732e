# SPDX-License-Identifier: Apache-2.0
"""Queries another node's parameters without blocking."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.parameter import parameter_value_to_python

from fivebar_description.ros.node import GraphNode

ASK_PERIOD = 0.1
"""Period (s) of polling for the answer, or for the node."""

ANSWER_TIMEOUT = 3.0
"""Time (s) after which a question is asked again: its answer is lost where the node restarts, or has not discovered who
asks."""


class ParameterQuery:
    """Waits for the node, then queries the names and after that the values."""

    def __init__(self, node: GraphNode, of: str, take: Callable[[dict[str, Any]], None]) -> None:
        """Begin to ask on behalf of a node; `take` is called once, with the values by name."""
        self._take = take
        self._answer: Any = None
        self._asked = 0.0
        self._names: list[str] = []
        self._list_names = node.create_client(ListParameters, f"{of}/list_parameters")
        self._get_values = node.create_client(GetParameters, f"{of}/get_parameters")
        self._timer = node.every(ASK_PERIOD, self._ask)

    def _ask(self) -> None:
        if self._answer is not None and not self._answer.done():
            if time.monotonic() < self._asked + ANSWER_TIMEOUT:
                return
            self._answer = None
        answer = None if self._answer is None else self._answer.result()
        if isinstance(answer, ListParameters.Response):
            self._names = list(answer.result.names)
            self._asked = time.monotonic()
            self._answer = self._get_values.call_async(GetParameters.Request(names=self._names))
        elif isinstance(answer, GetParameters.Response):
            self._timer.cancel()
            values = [parameter_value_to_python(value) for value in answer.values]
            self._take(dict(zip(self._names, values, strict=True)))
        elif self._list_names.service_is_ready() and self._get_values.service_is_ready():
            self._asked = time.monotonic()
            self._answer = self._list_names.call_async(ListParameters.Request())
