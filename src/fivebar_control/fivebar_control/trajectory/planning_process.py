"""Plans requests in a process of its own, so that a node in real time never waits for a plan.

Parent and child exchange one line of JSON each way per order, over the child's standard input and output. The child
ends when its input does, so it outlives no parent, however that ends.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from contextlib import suppress
from typing import Any, NamedTuple

from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.trajectory.limits import limits_of
from fivebar_control.trajectory.motion_queue import Order
from fivebar_control.trajectory.path import Path
from fivebar_control.trajectory.planner import PlanRefused
from fivebar_control.trajectory.transfer import Speed, plan_transfer
from fivebar_description.parameters import load_robot
from fivebar_description.strict_yaml import InputError


class Conditions(NamedTuple):
    """What orders are planned for: robot (name or path), rate (Hz), torque (Nm) and speed (rad/s) of both motors."""

    robot: str
    rate_hz: int
    torque_limit: float
    motor_speed: float


class Planned(NamedTuple):
    """The answer to an order: waypoints (m) and durations (s), or the reason why there is no motion."""

    waypoints: tuple[tuple[float, float], ...]
    durations: tuple[float, ...]
    refused: str

    def path(self) -> Path:
        """Return the motion."""
        return Path.through(self.waypoints, self.durations)


class PlanningProcess:
    """Takes one order at a time and gives its answer when it is ready."""

    def __init__(self, conditions: Conditions) -> None:
        """Do not start a process before there is an order."""
        self._conditions = conditions
        self._process: subprocess.Popen[bytes] | None = None
        self._heard = b""

    def ask(self, order: Order) -> None:
        """Hand in an order; returns at once."""
        process = self._running()
        assert process.stdin is not None
        with suppress(BrokenPipeError):
            process.stdin.write(json.dumps([self._conditions, order]).encode() + b"\n")
            process.stdin.flush()

    def answer(self) -> Planned | None:
        """Return the answer, None while it is not ready; returns at once."""
        process = self._process
        if process is None:
            return None
        assert process.stdout is not None
        while chunk := _available(process.stdout.fileno()):
            self._heard += chunk
        line, newline, rest = self._heard.partition(b"\n")
        if newline:
            self._heard = rest
            waypoints, durations, refused = json.loads(line)
            return Planned(tuple((x, y) for x, y in waypoints), tuple(durations), refused)
        if process.poll() is not None:
            self._process = None
            return Planned((), (), f"the planning process ended with status {process.returncode}")
        return None

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def _running(self) -> subprocess.Popen[bytes]:
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, "-m", __name__], stdin=subprocess.PIPE, stdout=subprocess.PIPE
            )
            assert self._process.stdout is not None
            os.set_blocking(self._process.stdout.fileno(), False)
            self._heard = b""
        return self._process


def _available(descriptor: int) -> bytes:
    try:
        return os.read(descriptor, 65_536)
    except BlockingIOError:
        return b""


def plan_order(conditions: Conditions, order: Order) -> Planned:
    """Plan an order for the law without switching, the only one that follows requests."""
    follower = default_tuning(CONTROLLERS["unified"])
    try:
        transfer = plan_transfer(
            load_robot(conditions.robot),
            order.working_mode,
            order.start,
            order.goal,
            order.assembly or None,
            conditions.rate_hz,
            follower,
            limits_of(follower, conditions.torque_limit, conditions.motor_speed),
            order.duration or Speed.COMFORTABLE,
        )
    except (PlanRefused, InputError) as refusal:
        return Planned((), (), str(refusal))
    return Planned(transfer.waypoints, transfer.durations, "")


def main() -> None:
    """Answer orders until there are no more."""
    # an interrupt is for the parent, who then ends this process
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(OSError):
        # the parent may have the priority of a control loop, which planning must not have
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    for line in sys.stdin:
        content: list[Any] = json.loads(line)
        start, working_mode, goal, assembly, duration = content[1]
        order = Order(tuple(start), tuple(working_mode), tuple(goal), assembly, duration)
        print(json.dumps(plan_order(Conditions(*content[0]), order)), flush=True)


if __name__ == "__main__":
    main()
