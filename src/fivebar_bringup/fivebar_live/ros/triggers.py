# SPDX-License-Identifier: Apache-2.0
"""Services that a button of the live page calls: those of them that the graph has."""

from __future__ import annotations

from collections.abc import Callable

from std_srvs.srv import Trigger

from fivebar_description.ros.node import GraphNode


class Triggers:
    """Calls services in a fixed order, and reports once all have answered."""

    def __init__(self, node: GraphNode, names: tuple[str, ...], notice: Callable[[bool, str], None]) -> None:
        """Make the clients on behalf of a node.

        Args:
            node: the node.
            names: of the services, in the order in which they are called.
            notice: is called with whether all succeeded, and what they said.
        """
        self._clients = {name: node.create_client(Trigger, name) for name in names}
        self._notice = notice

    def call(self) -> None:
        """Call the services that are there."""
        ready = {name: client for name, client in self._clients.items() if client.service_is_ready()}
        if not ready:
            self._notice(False, "no node of the graph offers this")
            return
        answers: dict[str, Trigger.Response] = {}

        def note(name: str, answer: Trigger.Response) -> None:
            answers[name] = answer
            if len(answers) == len(ready):
                good = all(answer.success for answer in answers.values())
                self._notice(good, "; ".join(f"{name}: {answers[name].message}" for name in ready))

        for name, client in ready.items():
            call = client.call_async(Trigger.Request())
            call.add_done_callback(lambda done, name=name: note(name, done.result()))
