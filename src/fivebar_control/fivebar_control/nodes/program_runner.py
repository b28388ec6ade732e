# SPDX-License-Identifier: Apache-2.0
"""Carries out programs: requests their moves on `goal` one after the other, switches pins, publishes the payload."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Float64, String

from fivebar_control.planning.program import (
    Action,
    Carry,
    Follow,
    LoadedProgram,
    Move,
    SetOutput,
    goal_fields_of,
    load_program,
    read_program,
)
from fivebar_control.planning.program_run import ProgramRun, ProgramState
from fivebar_control.planning.timed_points import TimedPoints
from fivebar_control.planning.trajectory_file import TrajectoryFile, points_in
from fivebar_control.ros.node_settings import ProgramSettings
from fivebar_control.ros.trajectory_requests import trajectory_message
from fivebar_control.scenario.motion_file import MotionFile
from fivebar_description.interface import (
    ALL_WELL,
    GOAL,
    GOAL_STATUS,
    GOAL_TRAJECTORY,
    JOINT_STATES,
    PAYLOAD,
    PROGRAM,
    PROGRAM_STATUS,
    SAFETY_STATE,
    output_topic,
)
from fivebar_description.joint_sample import MessageError
from fivebar_description.outside_text import LONGEST_TEXT, one_line
from fivebar_description.ros.file_parameters import FileParameters
from fivebar_description.ros.messages import (
    best_effort,
    checked_stamp,
    goal_message,
    new_request_id,
    received_joint_state,
)
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.process_topics import Sender
from fivebar_description.ros.run import run_node
from fivebar_description.ros.run_agreement import RunAgreement
from fivebar_description.status_texts import read_goal_status
from fivebar_description.strict_yaml import InputError

PERIOD = 0.02
"""Period (s) on the steady clock at which the runner checks what is due; the time that counts is that of the robot."""

ON_TOPIC = "/program"
"""Name in errors of a program that came on the topic."""


class ProgramRunner(GraphNode):
    """Carries out one program at a time: the one of its parameter, and those that come on `program`."""

    def __init__(self) -> None:
        """Make the node.

        Raises:
            InputError: the program cannot be read.
        """
        super().__init__("program_runner")
        settings = self.declare_settings(ProgramSettings)
        self._rate_hz = FileParameters(self, MotionFile, ("rate_hz",)).file.rate_hz
        self._run = RunAgreement(self, self._rate_hz, {})
        self._begin_sample = settings.begin_sample
        self._newest: bytes | None = None
        self._asked = ""
        self._program: ProgramRun | None = None
        self._published = ""
        self._fault = ALL_WELL
        self._outputs_by_pin: dict[str, Sender] = {}
        self._files: dict[str, TimedPoints] = {}
        """Points of the files that the program follows, by their paths."""
        self._goal, self._trajectory = self.advertise(GOAL), self.advertise(GOAL_TRAJECTORY)
        self._payload = self.advertise(PAYLOAD)
        self._status = self.advertise(PROGRAM_STATUS)
        self.listen(GOAL_STATUS, self.reading(GOAL_STATUS, read_goal_status, self._on_goal_status))
        self.listen(SAFETY_STATE, self._on_safety_state, awaited=False)
        self.listen(PROGRAM, self._on_program, awaited=False)
        self.create_subscription(JointState, JOINT_STATES.name, self._keep, best_effort(1), raw=True)
        if settings.program:
            self._begin(load_program(Path(settings.program)), settings.begin)
        self._publish_status()
        self.every(PERIOD, self._advance)

    def _begin(self, loaded: LoadedProgram, done: int) -> None:
        actions = (instruction.action for instruction in loaded.instructions)
        names = {action.file for action in actions if isinstance(action, Follow)}
        self._files = {name: points_in(TrajectoryFile.at(name)) for name in names}
        self._program = ProgramRun(loaded.program.name, loaded.instructions, done)
        # subscribers have until then to find the pins
        for pin in loaded.pins:
            if pin not in self._outputs_by_pin:
                self._outputs_by_pin[pin] = self.advertise(output_topic(pin))

    def _keep(self, message: bytes) -> None:
        self._newest = message

    def _sample(self) -> int | None:
        """Return the sample of the newest joint states, None before the first."""
        if self._newest is None or not self._run.holds:
            return None
        try:
            return self._run.sample(checked_stamp(received_joint_state(self._newest)))
        except MessageError as error:
            self._newest = None
            self.drop(JOINT_STATES, str(error))
            return None

    def _advance(self) -> None:
        """Carry out what is due."""
        program = self._program
        if program is None or program.state is not ProgramState.RUNNING:
            return
        sample = self._sample()
        if sample is None or sample < self._begin_sample or not self._heard():
            return
        for action in program.due(sample / self._rate_hz):
            self._do(action)
            self._publish_status()
        self._publish_status()

    def _heard(self) -> bool:
        """Return whether whoever answers requests hears them: what is published before that is lost."""
        answered_by = {
            (publisher.node_namespace, publisher.node_name)
            for publisher in self.get_publishers_info_by_topic(GOAL_STATUS.name)
        }
        topics = (GOAL, GOAL_TRAJECTORY) if self._files else (GOAL,)
        subscriptions = (self.get_subscriptions_info_by_topic(topic.name) for topic in topics)
        heard_by = (
            {(listener.node_namespace, listener.node_name) for listener in listeners} for listeners in subscriptions
        )
        return all(nodes & answered_by for nodes in heard_by)

    def _do(self, action: Action) -> None:
        if isinstance(action, Move):
            self._asked = new_request_id()
            self._goal.publish(goal_message(goal_fields_of(action), self._asked))
        elif isinstance(action, Follow):
            self._asked = new_request_id()
            self._trajectory.publish(trajectory_message(self._files[action.file], self._asked))
        elif isinstance(action, Carry):
            self._payload.publish(Float64(data=action.payload))
        elif isinstance(action, SetOutput):
            self._outputs_by_pin[action.pin].publish(Bool(data=action.on))

    def _on_goal_status(self, status: dict[str, Any]) -> None:
        if self._program is not None and status.get("id") == self._asked:
            self._program.on_goal(status)
            self._publish_status()

    def _on_safety_state(self, message: String) -> None:
        self._fault = one_line(message.data)
        if self._program is not None and self._fault != ALL_WELL:
            self._program.stop(self._fault)
            self._publish_status()

    def _on_program(self, message: String) -> None:
        """Carry out a program; an empty text ends the one that runs, after what is under way."""
        running = self._program is not None and self._program.state is ProgramState.RUNNING
        if self._program is not None and running and not message.data.strip():
            self._program.end_after_this("ended by an empty text on the topic program")
            return
        try:
            if running:
                raise InputError(f"{ON_TOPIC}: another program runs: expected it to end first, as by an empty text")
            if self._fault != ALL_WELL:
                raise InputError(f"{ON_TOPIC}: a fault stops the robot: {self._fault}: reset it first")
            if len(message.data) > LONGEST_TEXT:
                raise InputError(f"{ON_TOPIC}: {len(message.data)} characters: expected at most {LONGEST_TEXT}")
            self._begin(read_program(message.data, ON_TOPIC), 0)
        except InputError as error:
            self.drop(PROGRAM, str(error))
            status = {"state": ProgramState.REFUSED, "reason": one_line(str(error)), "pid": os.getpid()}
            self._status.publish(String(data=json.dumps(status)))
            return
        self._publish_status()

    def _publish_status(self) -> None:
        """Publish how far the program has come, where that has changed."""
        status = {"state": ProgramState.IDLE} if self._program is None else self._program.status()
        text = json.dumps({**status, "pid": os.getpid()})
        if text != self._published:
            self._published = text
            self._status.publish(String(data=text))


def main() -> None:
    """Run the node."""
    run_node(ProgramRunner)


if __name__ == "__main__":
    main()
