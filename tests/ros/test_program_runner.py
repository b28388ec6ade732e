# SPDX-License-Identifier: Apache-2.0
"""The program runner over ROS: takes a program on its topic, asks for its moves, and ends with what becomes of them."""

from __future__ import annotations

import json
from typing import Any

from graph_probe import RATE_HZ, Bench, Probe
from std_msgs.msg import String

from fivebar_description.interface import (
    ALL_WELL,
    GOAL,
    GOAL_STATUS,
    JOINT_STATES,
    JOINTS,
    PAYLOAD,
    PROGRAM,
    PROGRAM_STATUS,
    SAFETY_STATE,
    output_topic,
    sample_stamp_ns,
)
from fivebar_description.ros.messages import joint_state

STILL = (0.0,) * 4
WORK = "name: work\nsteps:\n- pick: 0.1\n- {move: [0, 0.1], mode: '+'}\n- set: gripper\n- move: [0, 0.12]\n"


class RestOfTheGraph:
    """Publishes samples, and answers requests as the trajectory generator does."""

    def __init__(self, probe: Probe) -> None:
        self.probe = probe
        probe.advertise(SAFETY_STATE, PROGRAM)
        # the pin's topic is there only with its program
        probe.listen(output_topic("gripper"), GOAL, PAYLOAD)
        probe.join("program_runner", [JOINT_STATES, GOAL_STATUS], [PROGRAM_STATUS])
        self._sample = 0

    def step_until(self, state: str, **wanted: Any) -> dict[str, Any]:
        """Go on from sample to sample until the program says so."""

        def told() -> dict[str, Any] | None:
            self._sample += 1
            stamp = sample_stamp_ns(self._sample, RATE_HZ)
            self.probe.publish(JOINT_STATES, joint_state(stamp, JOINTS, STILL, STILL, STILL))
            texts = self.probe.got(PROGRAM_STATUS)
            last: dict[str, Any] = json.loads(texts[-1].data) if texts else {}
            return last if last.items() >= {"state": state, **wanted}.items() else None

        return self.probe.wait_for(told, f"{state} {wanted}")

    def tell(self, state: str, **more: Any) -> None:
        request = self.probe.got(GOAL)[-1]
        status = {"state": state, "goal": list(request.position[:2]), "id": request.header.frame_id, **more}
        self.probe.publish(GOAL_STATUS, String(data=json.dumps(status)))


def test_a_program_on_the_topic_is_carried_out_until_a_fault(bench: Bench) -> None:
    bench.start("program_runner")
    graph = RestOfTheGraph(bench.probe())
    probe = graph.probe
    graph.step_until("idle")
    probe.publish(PROGRAM, String(data="name: work\nsteps:\n- jump: 1\n"))
    assert "/program: steps.0: {'jump': 1}: expected one of move" in graph.step_until("refused")["reason"]
    probe.publish(PROGRAM, String(data=WORK))
    graph.step_until("running", done=2, of=4)
    probe.wait_for(lambda: probe.got(GOAL), "the request")
    (asked,) = probe.got(GOAL)
    assert dict(zip(asked.name, asked.position, strict=True)) == {
        **{"x": 0.0, "y": 0.1, "assembly_mode": 1.0, "duration": 0.0, "torque_share": 1.0, "speed_share": 1.0}
    }
    assert [message.data for message in probe.got(PAYLOAD)] == [0.1]
    # the outcome of somebody else's request for the same point decides nothing, nor does what is none
    graph.tell("refused", id="another")
    graph.tell("refused", id=None)
    probe.publish(GOAL_STATUS, String(data="[" * 5000))
    graph.tell("arrived")
    graph.step_until("running", done=4, of=4)
    probe.wait_for(lambda: probe.got(output_topic("gripper")), "the pin")
    assert [message.data for message in probe.got(output_topic("gripper"))] == [True]
    probe.publish(SAFETY_STATE, String(data="tracking_lost: 60 mm"))
    ended = graph.step_until("stopped")
    assert (ended["step"], ended["line"]) == ("4", 6)
    assert ended["reason"] == "step 4 (line 6): tracking_lost: 60 mm"
    probe.publish(PROGRAM, String(data=WORK))
    assert "a fault stops the robot: tracking_lost" in graph.step_until("refused")["reason"]
    probe.publish(SAFETY_STATE, String(data=ALL_WELL))
    assert len(probe.got(GOAL)) == 2
