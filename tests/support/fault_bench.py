"""The graph of an experiment with every node a process of its own, on drives that this process emulates and breaks."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from graph_probe import Bench, ChildProcess, Probe
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from std_srvs.srv import Trigger

from fivebar_bringup.graph import BRIDGE, EMULATED_ROBOT, RECORDER, Mode, crossing_graph
from fivebar_bringup.processes import ProcessSpec, Scheduling, processes
from fivebar_bringup.rehearsal import Rehearsal, write_drive_files
from fivebar_bringup.scenario import Scenario
from fivebar_description.interface import (
    DRIVES_STATE,
    FAULTS,
    JOINT_STATES,
    MOTOR_STATES,
    RUN_READY,
    RUN_STATUS,
    SAFETY_STATE,
    TORQUE_COMMAND,
    sample_of_stamp,
)
from fivebar_description.ros.messages import stamp_of
from fivebar_sim.drives.commands import obey
from fivebar_sim.drives.configuration import load_emulation
from fivebar_sim.drives.emulation import Emulation, open_bus

PRIORITY = 20
"""Under SCHED_FIFO where that is granted: what is tested are cycles of the clock, on a machine with other work."""

NOT_RUN = ("imu_listener", EMULATED_ROBOT)


class Torques(NamedTuple):
    """What both motors had from a moment (monotonic, s) on."""

    since: float
    first: float
    second: float

    @property
    def zero(self) -> bool:
        return self.first == self.second == 0.0


class EmulatedPair:
    """The emulated drives in a thread of this process, and what torque they gave when."""

    def __init__(self, file: Path) -> None:
        emulation = load_emulation(str(file))
        self._bus = open_bus(emulation.bus)
        self.emulation = Emulation(emulation, self._bus)
        self.log: list[Torques] = []
        self._orders: list[str] = []
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        with contextlib.suppress(PermissionError):
            os.sched_setscheduler(threading.get_native_id(), os.SCHED_FIFO, os.sched_param(PRIORITY))
        self.emulation.run(self._ending, self._between)

    def _between(self) -> None:
        while self._orders:
            obey(self.emulation, self._orders.pop(0))
        first, second = (drive.torque for drive in self.emulation.drives)
        if not self.log or (first, second) != self.log[-1][1:]:
            self.log.append(Torques(time.monotonic(), first, second))

    def order(self, *lines: str) -> None:
        """Have lines of the drives' protocol obeyed, and wait until they are."""
        self._orders.extend(lines)
        while self._orders:
            time.sleep(0.001)

    def at_rest(self) -> bool:
        return max(abs(self.emulation.plant.joint_velocities)) < 0.02

    def close(self) -> None:
        self._ending.set()
        self._thread.join()
        self._bus.shutdown()


class FaultBench:
    """The nodes, the drives, and a probe that breaks and mends them."""

    def __init__(self, bench: Bench, folder: Path, scenario: Scenario) -> None:
        self.bench, self.scenario = bench, scenario
        self.period = 1.0 / scenario.rate_hz
        self.bag = folder / "bag"
        files = write_drive_files(scenario, folder)
        self.drives = EmulatedPair(files.emulation)
        nodes = crossing_graph(scenario, Mode.REALTIME, self.bag, Rehearsal(files))
        specs = processes(nodes, Mode.REALTIME, scenario.rate_hz, Scheduling(PRIORITY), composed=False)
        self._specs = {spec.name: self._changed(spec) for spec in specs if spec.name not in NOT_RUN}
        self._folder = folder
        self.processes: dict[str, ChildProcess] = {}
        self.probe: Probe = bench.probe()
        self.probe.advertise(RUN_STATUS)
        self.probe.listen(FAULTS, SAFETY_STATE, DRIVES_STATE, MOTOR_STATES, JOINT_STATES, TORQUE_COMMAND)
        for name in self._specs:
            self.start(name)
        self.wait_ready(set(self._specs))
        self.change(Transition.TRANSITION_CONFIGURE)
        self.running = False

    def _changed(self, spec: ProcessSpec) -> ProcessSpec:
        """No end of the run, and a bridge that waits to be asked."""
        (node,) = spec.nodes
        changes = {
            "blender": {"last_sample": 0},
            BRIDGE: {"autostart": False},
            RECORDER: {"topics": [name for name in node.parameters.get("topics", ()) if name != "ground_truth"]},
        }.get(node.executable, {})
        return spec._replace(nodes=(node._replace(parameters={**node.parameters, **changes}),))

    def start(self, name: str) -> None:
        """Start a process of the graph, or start it again."""
        spec = self._specs[name]
        path = self._folder / f"{name}.yaml"
        path.write_text(spec.parameter_file(), encoding="utf-8")
        self.processes[name] = self.bench.run([sys.executable, *spec.command, "--ros-args", "--params-file", str(path)])

    def kill(self, name: str, number: signal.Signals = signal.SIGKILL) -> None:
        self.processes[name].send(number)

    def wait_ready(self, names: set[str], after: int = 0) -> None:
        ready = self.probe.got(RUN_READY)
        self.probe.wait_for(lambda: names <= {one.data for one in ready[after:]}, f"{names} ready", 60.0)

    def restart(self, name: str) -> None:
        """Start a killed process again and wait until it has joined."""
        after = len(self.probe.got(RUN_READY))
        self.start(name)
        self.wait_ready({name}, after)

    def change(self, transition: int) -> bool:
        request = ChangeState.Request(transition=Transition(id=transition))
        return bool(self.probe.call(ChangeState, f"/{BRIDGE}/change_state", request).success)

    def ask(self, node: str, service: str) -> Trigger.Response:
        return self.probe.call(Trigger, f"/{node}/{service}", Trigger.Request())

    def sample(self) -> int:
        """The newest sample that the controllers know of, -1 before the first."""
        states = self.probe.got(JOINT_STATES)
        return sample_of_stamp(stamp_of(states[-1]), self.scenario.rate_hz) or 0 if states else -1

    def begin(self) -> None:
        """Begin the motion anew, from home."""
        if self.running:
            assert self.change(Transition.TRANSITION_DEACTIVATE)
        self.drives.order("mend 1", "mend 2", "bus_on", "home")
        self.probe.got(JOINT_STATES).clear()
        self.running = False
        # once more where this process, which emulates the drives, has left them without an answer for two cycles
        self.probe.wait_for(self._activated, "an active bridge")
        self.running = True
        self.probe.wait_for(lambda: self.sample() > 0, "the first samples")

    def _activated(self) -> bool:
        return self.change(Transition.TRANSITION_ACTIVATE) or (self.ask(BRIDGE, "reset").success and False)

    def run_to(self, sample: int) -> bool:
        """Let the motion get to a sample; return whether it has, and was not stopped on the way."""
        self.probe.wait_for(lambda: self.sample() >= sample or self.stopped(), f"sample {sample}")
        return not self.stopped()

    def stopped(self) -> bool:
        told = self.probe.got(SAFETY_STATE)
        return bool(told) and told[-1].data != "ok"

    def faults(self) -> list[str]:
        return [one.data.partition(":")[0] for one in self.probe.got(FAULTS)]

    def wait_for_fault(self, known: int) -> str:
        """Return the name of the first fault after so many."""
        self.probe.wait_for(lambda: len(self.faults()) > known, "a fault")
        return self.faults()[known]

    def seconds_to_zero(self, since: float) -> float:
        """Return how long after a moment both motors had no torque for good."""
        self.probe.wait_for(lambda: self.drives.log[-1].zero, "no torque")
        last = self.drives.log[-1].since
        return max(0.0, last - since)

    def expect_no_torque_for(self, seconds: float) -> None:
        """Nothing enables by itself."""
        changes = len(self.drives.log)
        self.probe.spin_for(seconds)
        assert len(self.drives.log) == changes
        assert self.drives.log[-1].zero

    def wait_for_rest(self) -> None:
        self.probe.wait_for(self.drives.at_rest, "the robot at rest")

    def enable_drives(self) -> None:
        """Reset the bridge and enable the drives. This process, which emulates them, may leave them without an answer
        for two cycles while it calls; then again."""

        def enabled() -> bool:
            assert self.drives.log[-1].zero
            return self.ask(BRIDGE, "reset").success and self.ask(BRIDGE, "enable").success

        self.probe.wait_for(enabled, "drives that are enabled")

    def reset_blender(self) -> Trigger.Response:
        """Ask for a reset until the estimate, too, is at rest; return the last answer."""
        answers: list[Trigger.Response] = []

        def done() -> bool:
            self.probe.spin_for(2 * self.period)
            answers.append(self.ask("blender", "reset"))
            if "drives are stopped" in answers[-1].message:
                self.enable_drives()
            waits = ("still turn", "no sample", "drives are stopped", "tracking_lost", "over_speed")
            return answers[-1].success or not any(text in answers[-1].message for text in waits)

        self.probe.wait_for(done, "an answer other than 'not yet'")
        return answers[-1]

    def stop_recorder(self) -> None:
        """End the recording; the blender's last word is in it."""
        self.drives.order("mend 1", "mend 2", "bus_on")
        self.ask("blender", "emergency_stop")
        self.probe.wait_for(lambda: self.drives.log[-1].zero, "no torque")
        self.kill(RECORDER, signal.SIGINT)
        self.processes[RECORDER].wait()

    def close(self) -> None:
        for name in (BRIDGE, *(name for name in self.processes if name not in (BRIDGE, RECORDER)), RECORDER):
            process = self.processes[name]
            if process.status is None:
                process.send(signal.SIGINT)
                process.wait()
        self.drives.close()


@contextlib.contextmanager
def fault_bench(folder: Path, scenario: Scenario) -> Iterator[FaultBench]:
    """A bench that is closed whatever happens."""
    folder.mkdir(parents=True, exist_ok=True)
    with Bench(folder) as bench, ordered_priority():
        made = FaultBench(bench, folder, scenario)
        try:
            yield made
        finally:
            made.close()


@contextlib.contextmanager
def ordered_priority() -> Iterator[None]:
    """Run this thread, which holds Python's lock that the drives need, under the nodes' priority where granted."""
    me = threading.get_native_id()
    granted, interval = True, sys.getswitchinterval()
    sys.setswitchinterval(0.0005)
    try:
        os.sched_setscheduler(me, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except PermissionError:
        granted = False
    try:
        yield
    finally:
        sys.setswitchinterval(interval)
        if granted:
            os.sched_setscheduler(me, os.SCHED_OTHER, os.sched_param(0))
