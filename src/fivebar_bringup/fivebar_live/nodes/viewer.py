# SPDX-License-Identifier: Apache-2.0
"""Serves a page that shows a running graph: outside the control cycle, which never waits for it."""

from __future__ import annotations

import json
import sys
import threading
from collections import deque
from typing import Annotated, Any, NamedTuple

from sensor_msgs.msg import JointState

from fivebar_bringup.graph.node_spec import BRIDGES
from fivebar_bringup.reference.faults import advice_of_drives
from fivebar_control.scenario.goal_conditions import conditions_of
from fivebar_control.scenario.parameters import scenario_of
from fivebar_description.interface import GOAL, GOAL_STATUS
from fivebar_description.parameters import FiveBar
from fivebar_description.ros.messages import goal_message, new_request_id, qos_profile
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.run import run_node
from fivebar_description.settings import Setting
from fivebar_description.shared_settings import REALTIME
from fivebar_description.strict_yaml import InputError
from fivebar_live.commands import MOVE, PLAN, STOP, Command
from fivebar_live.ending import ended_message
from fivebar_live.page import live_page, live_scene
from fivebar_live.preview import Preview, answer_to
from fivebar_live.ros.graph_states import GraphStates
from fivebar_live.ros.parameter_query import ParameterQuery
from fivebar_live.ros.sample_feed import SampleFeed
from fivebar_live.ros.triggers import Triggers
from fivebar_live.samples import COLUMNS
from fivebar_live.server import LiveServer

GENERATOR = "trajectory_generator"
"""The node whose parameters say which robot moves, and how requests are judged."""

STOPS = tuple(f"{node}/emergency_stop" for node in ("blender", *BRIDGES))
RESETS = tuple(f"{node}/reset" for node in (*BRIDGES, "plant", "state_estimator", "blender"))
"""Services for the two buttons, in the order in which they are called; those that a graph lacks are left out."""

COMMAND_PERIOD = 0.02
"""Period (s) of looking for commands of pages."""

LONELY_AFTER = 5.0
"""Time (s) within which the nodes of a graph, which report once a second, are seen."""

STATES_EVERY = 6
"""Frames from one list of the nodes' states to the next."""


class ViewerSettings(NamedTuple):
    """Parameters of the viewer."""

    port: Annotated[
        int, Setting("Port on 127.0.0.1 of the live page, 0 for a free one.", at_least=0, at_most=65535)
    ] = 0
    frame_rate: Annotated[
        float, Setting("Frames that the live page gets in a second.", "Hz", at_least=1.0, at_most=60.0)
    ] = 30.0
    drives_interface: Annotated[
        str, Setting("Interface of the drives whose faults are explained; without one those of the graph alone.")
    ] = ""
    told_on_input: Annotated[
        bool, Setting("Whether whoever started the viewer tells on its standard input what became of the run.")
    ] = False


class Viewer(GraphNode):
    """Collects what the graph publishes and sends it to the open pages; passes on stop, reset and requests."""

    def __init__(self) -> None:
        """Make the node and the server.

        Raises:
            InputError: the port is in use.
        """
        super().__init__("viewer")
        settings = self.declare_settings(ViewerSettings)
        # before there is a page
        self.check_names()
        self._robot: FiveBar | None = None
        self._preview: Preview | None = None
        self._commands: deque[Command] = deque()
        self._told: deque[str] = deque()
        self._frames = 0
        self._watched = False
        self._feed = SampleFeed(self, lambda: self._send({"restart": True}))
        self._states = GraphStates(
            self,
            self._send_states,
            lambda status: self._send({"goal": status}, GOAL_STATUS.name),
            advice_of_drives(settings.drives_interface),
        )
        self._goals = self.create_publisher(JointState, GOAL.name, qos_profile(GOAL.qos))
        self._stops = Triggers(self, STOPS, self._notice)
        self._resets = Triggers(self, RESETS, self._notice)
        ParameterQuery(self, GENERATOR, self._use)
        try:
            self._server = LiveServer(live_page(), settings.port, self._commands.append)
        except OSError as error:
            raise InputError(f"viewer: port: {settings.port}: cannot be used: {error.strerror}") from error
        print(f"view: {self._server.address}", flush=True)
        self.every(COMMAND_PERIOD, self._take_commands)
        self.every(1.0 / settings.frame_rate, self._send_frame)
        if settings.told_on_input:
            threading.Thread(target=self._listen, name="what became of the run", daemon=True).start()
        self._lonely = self.every(LONELY_AFTER, self._report_no_graph)

    def stop(self) -> None:
        """Notify the pages and end server and planning."""
        self._server.stop()
        if self._preview is not None:
            self._preview.close()

    def metrics(self) -> dict[str, object]:
        """Return how many frames have been made."""
        return {"frames": self._frames}

    def _use(self, values: dict[str, Any]) -> None:
        """Take over the generator's parameters and send the scene."""
        scenario = scenario_of(values)
        self._robot, modes = scenario.five_bar(), scenario.signs()
        self._preview = Preview(conditions_of(scenario, values["mode"] == REALTIME), modes)
        scene = live_scene(self._robot, list(modes), list(values["waypoints"]))
        self._send({**scene, "goals": scenario.scheme().takes_goals}, "scene")

    def _report_no_graph(self) -> None:
        """Say once where no other node is seen: the domain or the namespace may be another one's."""
        self._lonely.cancel()
        if {node["name"] for node in self._states.as_json()["nodes"]} <= {self.get_name()}:
            place = f"domain {self.context.get_domain_id()}, namespace {self.get_namespace()}"
            print(f"view: no node of a graph is seen in {place}; waiting for one", flush=True)

    def _listen(self) -> None:
        """Take what is told on standard input, a JSON object in a line."""
        self._told.extend(sys.stdin)

    def _take_commands(self) -> None:
        while self._told:
            self._states.ended = True
            self._send_states()
            self._send({"ended": ended_message(self._told.popleft())}, "ended")
            print("view: the pages have been told", flush=True)
        while self._commands:
            command = self._commands.popleft()
            if command.name == PLAN:
                self._plan(command)
            elif command.name == STOP:
                self._stops.call()
            elif command.name == MOVE:
                fields = {"x": command.x, "y": command.y, "assembly_mode": float(command.assembly)}
                self._goals.publish(goal_message(fields, new_request_id()))
            else:
                self._resets.call()
        answer = None if self._preview is None else self._preview.answer()
        if answer is not None:
            self._send(answer)

    def _plan(self, goal: Command) -> None:
        """Plan a motion from where the reference rests, without moving anything."""
        start = self._feed.reference()
        if self._preview is None or start is None:
            self._send(answer_to(goal, "the run has not begun"))
        elif self._preview.busy:
            self._send(answer_to(goal, "another request is being planned"))
        else:
            self._preview.ask(goal, start)

    def _notice(self, good: bool, text: str) -> None:
        self._send({"notice": {"good": good, "text": text}})

    def _send_frame(self) -> None:
        """Send the new samples to the open pages, and now and then the states of the nodes."""
        watched, before, self._watched = self._server.watched, self._watched, self._server.watched
        if not watched:
            return
        if not before:
            print("view: a page is open", flush=True)
        self._frames += 1
        self.note_answer()
        rows = [] if self._robot is None else self._feed.rows(self._robot)
        self._server.send_frame(json.dumps({"rows": {name: [row[name] for row in rows] for name in COLUMNS}}))
        if self._frames % STATES_EVERY == 0:
            self._send_states()

    def _send_states(self) -> None:
        self._send({"states": self._states.as_json()}, "states")

    def _send(self, content: dict[str, Any], greeting: str = "") -> None:
        self._server.send(json.dumps(content), greeting)


def main() -> None:
    """Run the node."""
    run_node(Viewer)


if __name__ == "__main__":
    main()
