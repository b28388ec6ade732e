"""The plan of a run: nodes wait for it, compare their own parameters with it, and refuse to answer on a difference."""

from __future__ import annotations

from graph_probe import Bench
from middle_motion import MiddleMotion

from fivebar_description.interface import JOINT_STATES, REFERENCE, RUN_PLAN, SUPERVISOR_STATE
from fivebar_description.run_plan import read_plan


def test_a_node_answers_only_what_its_plan_agrees_with(bench: Bench, motion: MiddleMotion) -> None:
    process = bench.start("supervisor")
    probe = bench.probe()
    probe.publish_plan(zone_epsilon=0.02)
    probe.listen(SUPERVISOR_STATE)
    probe.advertise(JOINT_STATES)

    def refused() -> bool:
        probe.publish(JOINT_STATES, motion.joint_states_message(0))
        status, values = probe.health("/supervisor")
        return status.message.startswith("plan_differs") and values["dropped"] == "0"

    probe.wait_for(refused, "the supervisor says what differs")
    assert not probe.got(SUPERVISOR_STATE)
    errors = [line for line in process.stderr.splitlines() if "[ERROR]" in line]
    assert len(errors) == 1
    assert "zone_epsilon: 0.05 here, 0.02 in the plan" in errors[0]
    # the same node with a plan that agrees, as of a trajectory generator that was started again
    bench.start("trajectory_generator")
    probe.listen(RUN_PLAN)
    probe.wait_for(lambda: any(read_plan(one.data).values.get("waypoints") for one in probe.got(RUN_PLAN)), "its plan")
    probe.ask([(JOINT_STATES, motion.joint_states_message(0))], [SUPERVISOR_STATE], 0)


def test_the_plan_names_whatever_nodes_share(bench: Bench, motion: MiddleMotion) -> None:
    bench.start("trajectory_generator")
    other = bench.start("ctc_controller", waypoints=[0.0, 0.15, 0.0, 0.03, 0.0, 0.15])
    same = bench.start("vhc_controller")
    probe = bench.probe()
    probe.advertise(JOINT_STATES)
    probe.listen(REFERENCE, RUN_PLAN)
    probe.wait_for(lambda: "refuses" in other.stderr and probe.got(RUN_PLAN), "the other motion is found")
    plan = read_plan(probe.got(RUN_PLAN)[0].data)
    assert {"rate_hz", "robot", "working_mode", "waypoints", "segment_durations", "zone_epsilon"} <= set(plan.values)
    assert "waypoints: [0.0, 0.15, 0.0, 0.03, 0.0, 0.15] here, [0.0, 0.15, 0.0, 0.02, 0.0, 0.15]" in other.stderr
    assert "refuses" not in same.stderr
