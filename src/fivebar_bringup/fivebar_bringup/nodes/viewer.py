"""Serves a page that shows a running graph: outside the control cycle, which never waits for it."""

from __future__ import annotations

import json
import struct
import time
from collections import deque
from typing import Annotated, Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.parameter import parameter_value_to_python
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fivebar_bringup.live.commands import PLAN, STOP, Command
from fivebar_bringup.live.page import live_page, live_scene
from fivebar_bringup.live.recovery import advice
from fivebar_bringup.live.samples import COLUMNS, Messages, Posture, row, thinned
from fivebar_bringup.live.server import LiveServer
from fivebar_bringup.nodes.diagnostics_listener import LEVELS
from fivebar_control.planning.motion_queue import PlanningRequest
from fivebar_control.planning.planning_process import PlanningProcess
from fivebar_control.ros.goal_conditions import conditions_of
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ALL_WELL,
    DRIVES_STATE,
    FAULTS,
    GOAL,
    GOAL_STATUS,
    JOINT_STATES,
    JOINTS,
    NANOSECONDS,
    REFERENCE,
    REFERENCE_NAMES,
    RUN_EPOCH,
    RUN_STATUS,
    SAFETY_STATE,
    START_STAMP_NS,
    SUPERVISOR_NAMES,
    SUPERVISOR_STATE,
    Topic,
)
from fivebar_description.parameters import FiveBar, load_robot
from fivebar_description.ros.messages import MessageError, read_fields
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.qos import best_effort, qos_profile
from fivebar_description.ros.run import run_node
from fivebar_description.run_plan import read_epoch
from fivebar_description.settings import Setting
from fivebar_description.strict_yaml import InputError

GENERATOR = "trajectory_generator"
"""The node whose parameters say which robot moves, and how requests are judged."""

STOPS = ("blender/emergency_stop", "dextar_bridge/emergency_stop")
RESETS = ("dextar_bridge/reset", "plant/reset", "blender/reset")
"""Services for the two buttons, in the order in which they are called; those that a graph lacks are left out."""

ASK_PERIOD = 0.1
"""Period (s) of asking for the generator's parameters, until it has answered."""

COMMAND_PERIOD = 0.02
"""Period (s) of looking for commands of pages."""

STATES_EVERY = 6
"""Frames from one list of the nodes' states to the next."""

QUEUE_DEPTH = 50

PATIENCE = NANOSECONDS // 4
"""How long (ns) a sample may wait for what answers it before it is shown without."""

STAMP = struct.Struct("<iI")
STAMP_PLACE = 4
"""Where a stamped message in little-endian CDR has its stamp: after the encapsulation."""


class ViewerSettings(NamedTuple):
    """Parameters of the viewer."""

    port: Annotated[
        int, Setting("Port on 127.0.0.1 of the live page, 0 for a free one.", at_least=0, at_most=65535)
    ] = 0
    frame_rate: Annotated[
        float, Setting("Frames that the live page gets in a second.", "Hz", at_least=1.0, at_most=60.0)
    ] = 30.0


class Viewer(GraphNode):
    """Collects what the graph publishes and sends it to the open pages; passes on stop, reset and requests."""

    def __init__(self) -> None:
        """Make the node and the server.

        Raises:
            InputError: the port is in use.
        """
        super().__init__("viewer")
        settings = self.declare_settings(ViewerSettings)
        self._robot: FiveBar | None = None
        self._values: dict[str, Any] = {}
        self._planning: PlanningProcess | None = None
        self._goal: Command | None = None
        self._commands: deque[Command] = deque()
        self._messages = {topic.name: Messages() for topic in (JOINT_STATES, REFERENCE, SUPERVISOR_STATE)}
        self._shown = self._newest = -1
        self._epoch_ns = START_STAMP_NS
        self._texts: dict[str, str] = {}
        self._faults: list[str] = []
        self._nodes: dict[str, tuple[float, str, str]] = {}
        self._frames = 0
        self._watched = False
        self._asked: Any = None
        for name in self._messages:
            self.create_subscription(JointState, name, self._keeper(name), best_effort(QUEUE_DEPTH), raw=True)
        for topic in (SAFETY_STATE, DRIVES_STATE, RUN_STATUS, GOAL_STATUS):
            self._follow(topic)
        self.create_subscription(String, RUN_EPOCH.name, self._on_epoch, qos_profile(RUN_EPOCH.qos))
        self.create_subscription(String, FAULTS.name, self._on_fault, qos_profile(FAULTS.qos))
        self.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, QUEUE_DEPTH)
        self._goals = self.create_publisher(JointState, GOAL.name, qos_profile(GOAL.qos))
        self._triggers = {name: self.create_client(Trigger, name) for name in (*STOPS, *RESETS)}
        self._list_names = self.create_client(ListParameters, f"{GENERATOR}/list_parameters")
        self._get_values = self.create_client(GetParameters, f"{GENERATOR}/get_parameters")
        try:
            self._server = LiveServer(live_page(), settings.port, self._commands.append)
        except OSError as error:
            raise InputError(f"viewer: port: {settings.port}: cannot be used: {error.strerror}") from error
        print(f"view: {self._server.address}", flush=True)
        self.every(ASK_PERIOD, self._ask)
        self.every(COMMAND_PERIOD, self._take_commands)
        self.every(1.0 / settings.frame_rate, self._send_frame)

    def stop(self) -> None:
        """Tell the pages and end server and planning."""
        self._server.stop()
        if self._planning is not None:
            self._planning.close()

    def metrics(self) -> dict[str, object]:
        """Return how many frames have been made."""
        return {"frames": self._frames}

    def _keeper(self, name: str) -> Any:
        messages = self._messages[name]

        def keep(data: bytes) -> None:
            seconds, nanoseconds = STAMP.unpack_from(data, STAMP_PLACE)
            stamp = seconds * NANOSECONDS + nanoseconds
            if stamp < self._shown - NANOSECONDS:
                self._begin_again()
            messages.put(stamp, data)

        return keep

    def _on_epoch(self, message: String) -> None:
        try:
            epoch_ns = read_epoch(message.data)
        except ValueError as error:
            self.drop(RUN_EPOCH, str(error))
            return
        # while no run is on, the samples of the last one are still shown
        if epoch_ns is not None and epoch_ns != self._epoch_ns:
            self._epoch_ns = epoch_ns
            self._begin_again()

    def _begin_again(self) -> None:
        """Forget the samples of the run before."""
        self._shown = self._newest = -1
        for messages in self._messages.values():
            messages.clear()
        self._server.send(json.dumps({"restart": True}))

    def _follow(self, topic: Topic) -> None:
        def note(message: String) -> None:
            self._texts[topic.name] = message.data
            if topic is GOAL_STATUS:
                self._server.send(json.dumps({"goal": _object(message.data)}), GOAL_STATUS.name)
            elif topic is not RUN_STATUS:
                self._send_states()

        self.create_subscription(String, topic.name, note, qos_profile(topic.qos))

    def _on_fault(self, message: String) -> None:
        self._faults.append(message.data)
        self._send_states()

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self._nodes[status.name] = (time.monotonic(), LEVELS.get(status.level, "stale"), status.message)

    def _ask(self) -> None:
        """Ask the generator for its parameters, step by step without waiting."""
        if self._robot is not None:
            return
        if self._asked is not None and not self._asked.done():
            return
        answer = None if self._asked is None else self._asked.result()
        if isinstance(answer, ListParameters.Response):
            self._names = list(answer.result.names)
            self._asked = self._get_values.call_async(GetParameters.Request(names=self._names))
        elif isinstance(answer, GetParameters.Response):
            self._asked = None
            values = [parameter_value_to_python(value) for value in answer.values]
            self._use(dict(zip(self._names, values, strict=True)))
        elif self._list_names.service_is_ready() and self._get_values.service_is_ready():
            self._asked = self._list_names.call_async(ListParameters.Request())

    def _use(self, values: dict[str, Any]) -> None:
        """Take over the generator's parameters and send the scene."""
        self._values = values
        self._robot = load_robot(values["robot"])
        scene = live_scene(self._robot, list(values["working_mode"]), list(values["waypoints"]))
        goals = bool(values.get("takes_goals"))
        self._server.send(json.dumps({**scene, "goals": goals}), "scene")

    def _take_commands(self) -> None:
        while self._commands:
            command = self._commands.popleft()
            if command.name == PLAN:
                self._plan(command)
            elif command.name == STOP:
                self._call(STOPS)
            elif command.name == "move":
                fields = {"x": command.x, "y": command.y, "assembly_mode": float(command.assembly)}
                self._goals.publish(JointState(name=list(fields), position=list(fields.values())))
            else:
                self._call(RESETS)
        if self._planning is not None and self._goal is not None:
            planned = self._planning.answer()
            if planned is not None:
                goal, self._goal = self._goal, None
                content = {"refused": planned.refused, "waypoints": planned.waypoints, "durations": planned.durations}
                self._server.send(json.dumps({"plan": {**content, "goal": goal._asdict()}}))

    def _plan(self, command: Command) -> None:
        """Plan a motion from where the reference rests, without moving anything."""
        rest = self._read(self._messages[REFERENCE.name].get(self._newest), REFERENCE_NAMES, "position")
        problem = ""
        if self._robot is None or rest is None:
            problem = "the run has not begun"
        elif self._goal is not None:
            problem = "another request is being planned"
        if problem:
            goal = command._asdict()
            self._server.send(
                json.dumps({"plan": {"refused": problem, "waypoints": [], "durations": [], "goal": goal}})
            )
            return
        assert rest is not None
        if self._planning is None:
            self._planning = PlanningProcess(conditions_of(self._values))
        mode1, mode2 = self._values["working_mode"][:2]
        self._goal = command
        self._planning.ask(
            PlanningRequest((rest[0], rest[1]), (mode1, mode2), (command.x, command.y), command.assembly, 0.0)
        )

    def _call(self, names: tuple[str, ...]) -> None:
        """Call the services that the graph has, and send what they answer once all have."""
        ready = [name for name in names if self._triggers[name].service_is_ready()]
        if not ready:
            self._notice(False, "no node of the graph offers this")
            return
        answers: dict[str, Trigger.Response] = {}

        def note(name: str, answer: Trigger.Response) -> None:
            answers[name] = answer
            if len(answers) == len(ready):
                good = all(answer.success for answer in answers.values())
                self._notice(good, "; ".join(f"{name}: {answers[name].message}" for name in ready))

        for name in ready:
            call = self._triggers[name].call_async(Trigger.Request())
            call.add_done_callback(lambda done, name=name: note(name, done.result()))

    def _notice(self, good: bool, text: str) -> None:
        self._server.send(json.dumps({"notice": {"good": good, "text": text}}))

    def _send_frame(self) -> None:
        """Send the new samples to the open pages, and now and then the states of the nodes."""
        watched, before, self._watched = self._server.watched, self._watched, self._server.watched
        if not watched:
            return
        if not before:
            print("view: a page is open", flush=True)
        self._frames += 1
        self.note_answer()
        rows = self._rows()
        content: dict[str, Any] = {"rows": {name: [one[name] for one in rows] for name in COLUMNS}}
        self._server.send_frame(json.dumps(content))
        if self._frames % STATES_EVERY == 0:
            self._send_states()

    def _rows(self) -> list[Any]:
        """Return rows of the samples since the last frame that the supervisor has answered, if it answers at all."""
        if self._robot is None:
            return []
        joints, supervisor = self._messages[JOINT_STATES.name], self._messages[SUPERVISOR_STATE.name]
        # what is older than sample 0 belongs to no run
        stamps = joints.after(max(self._shown, self._epoch_ns - 1))
        if not stamps:
            return []
        self._newest = stamps[-1]
        if supervisor.newest > self._newest - PATIENCE:
            stamps = [stamp for stamp in stamps if stamp <= supervisor.newest]
        rows = []
        for stamp in thinned(stamps):
            values = self._read(joints.get(stamp), JOINTS, "position", "effort")
            if values is None:
                continue
            torque = (values[4 + JOINTS.index(ACTIVE_JOINTS[0])], values[4 + JOINTS.index(ACTIVE_JOINTS[1])])
            sample = Posture((values[0], values[1], values[2], values[3]), torque)
            reference = self._read(self._messages[REFERENCE.name].get(stamp), REFERENCE_NAMES, "position")
            answer = self._read(supervisor.get(stamp), SUPERVISOR_NAMES, "position")
            place = None if reference is None else (reference[0], reference[1])
            weights = None if answer is None else (answer[0], answer[1])
            rows.append(row(self._robot, stamp - self._epoch_ns, sample, place, weights))
        if stamps:
            self._shown = stamps[-1]
        return rows

    def _read(self, data: bytes | None, names: tuple[str, ...], *fields: str) -> tuple[float, ...] | None:
        """Return the fields of a message one after the other, None where there is none or it is malformed."""
        if data is None:
            return None
        try:
            return sum(read_fields(deserialize_message(data, JointState), names, fields, allow_nan=True), ())
        except MessageError:
            return None

    def _send_states(self) -> None:
        now, space = time.monotonic(), self.get_namespace().rstrip("/") + "/"
        faults = [
            text for name in (SAFETY_STATE, DRIVES_STATE) if (text := self._texts.get(name.name, ALL_WELL)) != ALL_WELL
        ]
        states = {
            "nodes": [
                {"name": name.removeprefix(space), "level": level, "message": message, "age": round(now - at, 1)}
                for name, (at, level, message) in sorted(self._nodes.items())
                if name.startswith(space)
            ],
            "safety": self._texts.get(SAFETY_STATE.name),
            "drives": self._texts.get(DRIVES_STATE.name),
            "run": _object(self._texts.get(RUN_STATUS.name, "{}")),
            "faults": [{"text": text, **advice(text)._asdict()} for text in dict.fromkeys(faults)],
            "history": self._faults[-10:],
        }
        self._server.send(json.dumps({"states": states}), "states")


def _object(text: str) -> Any:
    """Return what a text of another node says, {} where it is no JSON."""
    try:
        return json.loads(text)
    except ValueError:
        return {}


def main() -> None:
    """Run the node."""
    run_node(Viewer)


if __name__ == "__main__":
    main()
