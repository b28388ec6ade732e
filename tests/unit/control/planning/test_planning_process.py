# SPDX-License-Identifier: Apache-2.0
"""Planning beside the control loop: answers, refusals, a planner that dies, and that nothing is left behind."""

from __future__ import annotations

import math
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from fivebar_control.estimation.settings import Drives, EkfSettings, Sensing
from fivebar_control.laws.gains import UnifiedSettings
from fivebar_control.laws.mpc import MpcSettings
from fivebar_control.planning import order_planning
from fivebar_control.planning.order_planning import plan_order
from fivebar_control.planning.orders import Conditions, Planned, PlanningRequest, StopRequest
from fivebar_control.planning.planning_process import PlanningProcess
from fivebar_control.planning.planning_worker import NICENESS
from fivebar_control.planning.ride_through import HeldTorque
from fivebar_control.safety.settings import Area
from fivebar_description.loads import Loads
from fivebar_description.sensors import PassiveEncoder
from fivebar_description.tolerances import Tolerances

CONDITIONS = Conditions("dextar", 100, 2.0, 50.0)
NEAR = PlanningRequest((0.0, 0.15), (1, -1), (0.0, 0.14), 0, 0.0)
FAR = PlanningRequest((0.0, 0.15), (1, -1), (0.3, 0.15), 0, 0.0)
DEADLINE = 120.0
DIED = "the planning process has died"


def test_a_law_that_needs_the_whole_motion_is_told_it_with_the_answer() -> None:
    assert plan_order(CONDITIONS, NEAR).references == ()
    conditions = CONDITIONS._replace(controller="path")
    planned = plan_order(conditions, NEAR)
    path = planned.path()
    rows = [path.at(number / 100) for number in range(path.samples(100) + 1)]
    assert planned.references == tuple(value for row in rows for value in row)
    order = StopRequest(planned.segments, NEAR.working_mode, 0.02, 0.0, True)
    stopped = plan_order(conditions, order)
    assert stopped.stop is not None and stopped.stop.resumed is not None
    assert len(stopped.references) == 6 * (stopped.stop.stop.as_path().samples(100) + 1)
    assert stopped.references[:12] == planned.references[:12]
    assert stopped.resumed[:2] == pytest.approx(stopped.references[-6:-4], abs=1e-12)


@pytest.fixture
def planning() -> Iterator[PlanningProcess]:
    """One of its own, for tests that end its process."""
    process = PlanningProcess(CONDITIONS, gives_way=True)
    yield process
    process.close()


@pytest.fixture(scope="module")
def started() -> Iterator[PlanningProcess]:
    """One that was started beforehand, by a thread that had been bound to one processor after it was made."""
    process = PlanningProcess(CONDITIONS, gives_way=True)
    every = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(every)})
    try:
        loaded(process)
    finally:
        os.sched_setaffinity(0, every)
    yield process
    process.close()


def answer_of(planning: PlanningProcess) -> Planned:
    end = time.monotonic() + DEADLINE
    while (planned := planning.answer()) is None:
        assert time.monotonic() < end, "no answer"
        time.sleep(0.01)
    return planned


def loaded(planning: PlanningProcess) -> int:
    """Start the process and wait until it has loaded everything; return its id."""
    planning.start()
    end = time.monotonic() + DEADLINE
    while planning.loading():
        assert time.monotonic() < end, "still loading"
        time.sleep(0.01)
    assert planning.pid is not None
    return planning.pid


def wait_for_end(process: int) -> None:
    """Wait until a process of this id has ended, whether or not anybody has waited for it."""
    with suppress(ProcessLookupError):
        descriptor = os.pidfd_open(process)
        # a pidfd is readable once its process has ended
        assert select.select([descriptor], [], [], DEADLINE)[0]
        os.close(descriptor)


def assert_gives_way(process: int | None) -> None:
    assert process is not None
    lowest = 19  # however low the own one is already
    assert os.getpriority(os.PRIO_PROCESS, process) == min(os.getpriority(os.PRIO_PROCESS, 0) + NICENESS, lowest)
    # in a session of its own, which has a weight beside others where the kernel weighs sessions
    assert os.getsid(process) == process
    autogroup = Path(f"/proc/{process}/autogroup")
    assert not autogroup.exists() or autogroup.read_text().endswith(f"nice {NICENESS}\n")


def test_it_answers_one_request_after_the_other_in_the_process_started_beforehand(started: PlanningProcess) -> None:
    process = started.pid
    started.start()
    started.ask(NEAR)
    first = answer_of(started)
    assert first.refused == "" and first.course.waypoints == (NEAR.start, NEAR.goal)
    assert first.path().at(first.path().duration)[:2] == NEAR.goal
    started.ask(FAR)
    assert "out of reach" in answer_of(started).refused
    assert started.pid == process and not started.loading()
    assert started.answer() is None


def test_one_started_beforehand_gives_way_to_the_cycle_and_leaves_its_processors(started: PlanningProcess) -> None:
    assert_gives_way(started.pid)
    assert os.sched_getaffinity(started.pid or 0) == os.sched_getaffinity(0)


def test_in_lockstep_it_gives_way_to_nobody_since_time_waits_for_it() -> None:
    process = PlanningProcess(CONDITIONS)
    try:
        assert os.getpriority(os.PRIO_PROCESS, loaded(process)) == os.getpriority(os.PRIO_PROCESS, 0)
    finally:
        process.close()


def test_a_request_takes_the_place_of_the_one_under_way(started: PlanningProcess) -> None:
    started.ask(NEAR)
    started.ask(FAR)
    assert "out of reach" in answer_of(started).refused
    assert started.answer() is None
    started.ask(NEAR)
    started.forget()
    assert started.answer() is None
    started.ask(FAR)
    assert "out of reach" in answer_of(started).refused


def test_it_waits_for_an_answer_where_it_is_asked_to(started: PlanningProcess) -> None:
    assert started.pid is not None
    os.kill(started.pid, signal.SIGSTOP)
    started.ask(NEAR)
    begun = time.monotonic()
    assert started.answer(0.05) is None
    assert time.monotonic() - begun >= 0.05
    os.kill(started.pid, signal.SIGCONT)
    planned = started.answer(DEADLINE)
    assert planned is not None and planned.refused == ""


def test_an_error_of_the_planner_refuses_the_request(started: PlanningProcess) -> None:
    process = started.pid
    started.ask(NEAR._replace(working_mode=()))  # type: ignore[arg-type]
    assert answer_of(started).refused.startswith("planning failed: IndexError(")
    started.ask(NEAR)
    assert answer_of(started).refused == ""
    assert started.pid == process


def test_a_request_that_the_tolerances_do_not_allow_is_refused_with_what_would() -> None:
    sensing = Sensing(500, Drives(encoder_counts=20_000), EkfSettings(), Tolerances(length=4e-4))
    order = PlanningRequest((0.0, 0.12), (1, -1), (0.0, 0.05), 0, 0.8)
    conditions = CONDITIONS._replace(rate_hz=500, sensing=sensing)
    refused = plan_order(conditions, order).refused
    assert "predicted position error within the tolerances is 0.00" in refused
    assert "within the limits with a gyroscope on the distal link of leg 2" in refused
    assert "or an encoder on the passive joint of leg 1 (sensors: {passive_encoder: {leg: 1}})" in refused
    gyroscope = sensing._replace(settings=EkfSettings(gyro=True))
    assert plan_order(conditions._replace(sensing=gyroscope), order).refused == ""
    encoder = sensing._replace(passive=PassiveEncoder(1))
    assert plan_order(conditions._replace(sensing=encoder), order).refused == ""


def test_a_request_is_planned_for_the_gains_and_the_weight_of_the_robot() -> None:
    """With those of DexTAR the predicted error allows no less than 0.82 s."""
    order = PlanningRequest((0.0, 0.12), (1, -1), (0.0, 0.0), 0, 0.0)
    planned = plan_order(Conditions("motkin", 500, 0.186, 50.0), order)
    assert planned.refused == "" and sum(planned.durations) == pytest.approx(0.372, abs=0.05)


@pytest.mark.extra
def test_a_request_keeps_to_the_workspace_and_to_the_forbidden_postures() -> None:
    """Beyond both, the last node would stop the robot on its way."""
    across = PlanningRequest((0.0, 0.15), (1, -1), (0.0, 0.03), -1, 0.0)
    beyond = plan_order(CONDITIONS._replace(workspace=Area(-0.1, 0.1, 0.05, 0.2)), across).refused
    assert "goal: (0.0000, 0.0300) m is outside the workspace [-0.1, 0.1, 0.05, 0.2] m" in beyond
    assert plan_order(CONDITIONS._replace(workspace=Area(-0.1, 0.1, 0.0, 0.2)), across).refused == ""
    strip = (-1.0, 1.0, 0.05, 0.06, -math.pi, math.pi, -math.pi, math.pi)
    forbidden = plan_order(CONDITIONS._replace(rate_hz=500, forbidden=strip), across).refused
    assert "time to the forbidden posture '1' is 0 s" in forbidden


@pytest.mark.extra
def test_a_request_is_screened_with_the_law_that_follows_it() -> None:
    """The softer the law, the further the declared loads move the platform."""
    across = PlanningRequest((0.0, 0.15), (1, -1), (0.0, 0.03), -1, 0.9)
    conditions = CONDITIONS._replace(rate_hz=500, loads=Loads(push=0.3))
    assert plan_order(conditions._replace(law=UnifiedSettings()), across).refused == ""
    soft = plan_order(conditions._replace(law=UnifiedSettings(kp=100.0, kd=20.0)), across).refused
    assert "displacement by the declared loads" in soft
    looking_ahead = conditions._replace(controller="mpc", law=MpcSettings())
    assert plan_order(looking_ahead, across).refused == ""


def test_a_request_is_predicted_to_stay_where_nothing_stops_it() -> None:
    across = PlanningRequest((0.0, 0.15), (1, -1), (0.0, 0.03), -1, 0.5)
    assert plan_order(CONDITIONS._replace(rate_hz=500), across).refused == ""
    narrow = plan_order(CONDITIONS._replace(rate_hz=500, tracking_error_limit=1e-5), across).refused
    assert "predicted distance from the reference is" in narrow and "expected at most 1e-05 m" in narrow


def test_a_request_has_to_bear_the_time_for_which_the_torque_is_held(monkeypatch: pytest.MonkeyPatch) -> None:
    held = CONDITIONS._replace(held=0.03)
    assert plan_order(held, NEAR).refused == ""
    monkeypatch.setattr(order_planning, "longest_hold", lambda *motion: HeldTorque(0.014, 1.9e-3, 0.25))
    refused = plan_order(held, NEAR).refused
    assert "may be held for 20 ms, the motion bears 14 ms of it at 0.250 s" in refused
    assert plan_order(CONDITIONS, NEAR).refused == ""


@pytest.mark.extra
def test_a_planner_that_dies_refuses_the_request_and_is_replaced(planning: PlanningProcess) -> None:
    process = loaded(planning)
    os.kill(process, signal.SIGSTOP)
    planning.ask(NEAR)
    os.kill(process, signal.SIGKILL)
    assert answer_of(planning) == Planned(DIED)
    assert planning.pid is None and not planning.loading()
    planning.ask(NEAR)
    assert answer_of(planning).refused == ""
    idle = planning.pid
    assert_gives_way(idle)
    assert idle is not None
    os.kill(idle, signal.SIGKILL)
    wait_for_end(idle)
    planning.ask(FAR)
    assert "out of reach" in answer_of(planning).refused
    assert planning.pid != idle


def test_closing_ends_a_plan_under_way(planning: PlanningProcess) -> None:
    planning.ask(NEAR)
    process = planning.pid
    assert process is not None
    planning.close()
    assert not Path(f"/proc/{process}").exists()
    assert planning.pid is None and planning.answer() is None


PARENT = f"""
import time
from fivebar_control.planning.orders import Conditions, PlanningRequest
from fivebar_control.planning.planning_process import PlanningProcess
if __name__ == "__main__":
    planning = PlanningProcess(Conditions(*{tuple(CONDITIONS[:4])!r}))
    planning.ask(PlanningRequest(*{tuple(NEAR)!r}))
    while planning.answer() is None:
        time.sleep(0.01)
    print(planning.pid, flush=True)
    time.sleep({DEADLINE})
"""


@pytest.mark.extra
def test_it_outlives_no_parent() -> None:
    parent = subprocess.Popen([sys.executable, "-c", PARENT], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    orphan = int(parent.stdout.readline())
    parent.kill()
    parent.wait()
    wait_for_end(orphan)


@pytest.mark.extra
@pytest.mark.parametrize("push", [0.0, 1.0])
def test_what_requests_of_a_robot_with_loads_need_is_loaded_before_the_first(push: float) -> None:
    """The solver of the time law of least torque, 0.8 s, which requests without loads do not need."""
    process = PlanningProcess(CONDITIONS._replace(loads=Loads(push=push)))
    try:
        maps = Path(f"/proc/{loaded(process)}/maps").read_text(encoding="utf-8")
    finally:
        process.close()
    assert ("toppra" in maps) == (push > 0.0)
