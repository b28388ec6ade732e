"""The robot's two drives as a lifecycle node: publishes what the motors measure, passes torque on, stops when in doubt.

configure opens the bus and sets up the drives, which stay without power; activate enables both at zero torque;
deactivate commands zero torque first, then switches them off; cleanup lets them go and closes the bus. A fault, of the
drives or of any other node, is latched: zero torque and a quick stop, until ~/reset and ~/enable.
"""

from __future__ import annotations

import functools
import time
import traceback
from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.lifecycle import LifecycleNodeMixin, LifecycleState, TransitionCallbackReturn
from rclpy.timer import Timer
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fivebar_control.fault import Fault
from fivebar_control.hardware.command_watch import CommandWatch
from fivebar_control.hardware.configuration import load_drives
from fivebar_control.hardware.drive_bus import ZERO, Cycle, DriveBus
from fivebar_control.hardware.fault import DriveError
from fivebar_control.ros.node_settings import BridgeSettings
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ALL_WELL,
    CONTROL_QOS,
    DRIVES_STATE,
    FAULTS,
    MOTOR_STATES,
    RUN_READY,
    TORQUE_COMMAND,
    sample_of_stamp,
    sample_stamp_ns,
)
from fivebar_description.ros.messages import MessageError, joint_state, read_fields, stamp_of
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.qos import qos_profile
from fivebar_description.ros.run import run_node
from fivebar_description.strict_yaml import InputError

REPEAT_PERIOD = 0.1
"""Time (s) between two publications of sample 0 while nobody has answered it."""

LATE_PERIODS = 1.5
"""A cycle that begins later than so many periods after the last one counts as an overrun."""

Transition = Callable[["DextarBridge", LifecycleState], TransitionCallbackReturn]

SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


def _told(transition: Transition) -> Transition:
    """Log what breaks a transition: rclpy goes on to on_error without a word."""

    @functools.wraps(transition)
    def run(self: DextarBridge, state: LifecycleState) -> TransitionCallbackReturn:
        try:
            return transition(self, state)
        except Exception:
            self.get_logger().error(f"{transition.__name__} has failed:\n{traceback.format_exc()}")
            raise

    return run


class DextarBridge(LifecycleNodeMixin, GraphNode):
    """The bridge between the graph and the drives.

    While active it exchanges with the drives on the steady clock. Sample 0 is published again and again, at zero
    torque, until it is answered: a run begins where the robot stands. The command that answers sample k is written at
    once and acts from sample k + 1 on.
    """

    def __init__(self) -> None:
        """Make the node, unconfigured."""
        GraphNode.__init__(self, "dextar_bridge")
        settings = self.declare_settings(BridgeSettings)
        self._drives = load_drives(settings.drives)
        self._rate_hz = settings.rate_hz
        if self._rate_hz != self._drives.rate_hz:
            raise InputError(
                f"dextar_bridge: parameter rate_hz: {self._rate_hz}: expected {self._drives.rate_hz}, which is"
                f" sync_period_us {self._drives.sync_period_us} of {settings.drives}"
            )
        self._enable_timeout = settings.enable_timeout_s
        self._watch = CommandWatch(settings.command_timeout_ms / 1e3, self._rate_hz)
        self._bus: DriveBus | None = None
        self._timer: Timer | None = None
        self._active = False
        self._fault: Fault | None = None
        self._sample = 0
        self._written = False
        self._overruns = self._incomplete = 0
        self._ticked = self._published = 0.0
        LifecycleNodeMixin.__init__(self)
        self._states = self.advertise(MOTOR_STATES)
        self._faults = self.advertise(FAULTS)
        self._state = self.advertise(DRIVES_STATE)
        self._told = ""
        self._tell_state()
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.create_service(Trigger, "~/enable", self._on_enable)
        self.create_service(Trigger, "~/emergency_stop", self._on_emergency_stop)
        self.listen(TORQUE_COMMAND, self._on_command)
        # volatile on this side: faults of the past are the business of whoever reset them
        self.listen(FAULTS._replace(qos=CONTROL_QOS), self._on_fault)
        if settings.autostart:
            self._awaited = set(settings.wait_for_nodes)
            # not awaited for this node's own readiness, which others may wait for
            self.create_subscription(String, RUN_READY.name, self._on_ready, qos_profile(RUN_READY.qos))
            self._start_timer = self.every(REPEAT_PERIOD, self._autostart)

    def _on_ready(self, message: String) -> None:
        self._awaited.discard(message.data)

    def _autostart(self) -> None:
        if self._awaited:
            return
        self._start_timer.cancel()
        if self.trigger_configure() == SUCCESS:
            self.trigger_activate()

    def _LifecycleNodeMixin__change_state(self, transition_id: int) -> TransitionCallbackReturn:
        """Refuse a transition that does not exist in the present state; rclpy would let it end the node."""
        try:
            made: TransitionCallbackReturn = super()._LifecycleNodeMixin__change_state(transition_id)
        except rclpy_implementation.RCLError as error:
            self.get_logger().error(f"transition {transition_id} refused: {' '.join(str(error).split())}")
            return FAILURE
        return made

    @_told
    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Open the bus and set up both drives; they stay without power."""
        bus = None
        try:
            bus = DriveBus(self._drives)
            bus.set_up()
        except DriveError as error:
            if bus is not None:
                bus.close()
            self._latch(error.fault)
            return FAILURE
        self._fault = None
        self._tell_state()
        self._bus = bus
        for note in bus.notes:
            self.get_logger().info(f"not in the drive: {note}")
        self._run_every(self._drives.master.heartbeat_ms / 2e3, bus.tend)
        return SUCCESS

    @_told
    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Enable both drives at zero torque and begin at sample 0."""
        bus = self._open_bus()
        if self._fault is not None:
            self.get_logger().error(f"not activated: reset {self._fault.name} first")
            return FAILURE
        try:
            bus.enable(self._enable_timeout)
        except DriveError as error:
            self._latch(error.fault)
            return FAILURE
        self._watch.begin()
        self._sample = 0
        self._written = False
        self._ticked = time.monotonic()
        self._published = 0.0
        self._active = True
        self._tell_state()
        self._run_every(1.0 / self._rate_hz, self._tick)
        return SUCCESS

    @_told
    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Command zero torque, then switch both drives off."""
        self._power_off()
        self._run_every(self._drives.master.heartbeat_ms / 2e3, self._open_bus().tend)
        return SUCCESS

    @_told
    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Let the drives go and close the bus."""
        self._close()
        self._fault = None
        self._tell_state()
        return SUCCESS

    @_told
    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Do all that is left to be done, from any state."""
        self._close()
        return SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """After an exception in a transition: power off, close, start again from unconfigured."""
        self._close()
        return SUCCESS

    def stop(self) -> None:
        """Leave the drives without torque and power as the last thing."""
        self._close()

    def health(self) -> tuple[bytes, str]:
        """Return an error while a fault is latched, a warning for frames and samples that were not used."""
        if self._fault is not None:
            return DiagnosticStatus.ERROR, str(self._fault)
        if self._bus is not None and (any(self._bus.counters) or self._overruns or self._incomplete):
            unknown, malformed, unreadable = self._bus.counters
            return DiagnosticStatus.WARN, (
                f"frames not used: {unknown} unknown, {malformed} malformed, {unreadable} unreadable;"
                f" {self._incomplete} samples without answer, {self._overruns} overruns"
            )
        return super().health()

    def _open_bus(self) -> DriveBus:
        assert self._bus is not None, "the lifecycle lets nobody come here before configure"
        return self._bus

    def _run_every(self, period: float, callback: Callable[[], None]) -> None:
        """Replace the timer: heartbeats while inactive, cycles while active, nothing else."""
        self._cancel_timer()
        self._timer = self.every(period, callback)

    def _cancel_timer(self) -> None:
        if self._timer is not None:
            self.destroy_timer(self._timer)
            self._timer = None

    def _power_off(self) -> None:
        bus = self._open_bus()
        self._active = False
        # before the samples cease, so that nobody takes their end for a fault
        self._tell_state()
        self._cancel_timer()
        try:
            bus.disable(self._enable_timeout)
        except DriveError as error:
            bus.switch_off()
            self._latch(error.fault)

    def _close(self) -> None:
        if self._bus is None:
            return
        if self._active:
            self._power_off()
        self._cancel_timer()
        self._bus.release()
        self._bus.close()
        self._bus = None

    def _tick(self) -> None:
        """One cycle: see to the torque, exchange, publish."""
        if not self._active:
            # the timer's last call may have waited behind the transition that has ended it
            return
        bus, now = self._open_bus(), time.monotonic()
        self._overruns += now - self._ticked > LATE_PERIODS / self._rate_hz
        self._ticked = now
        stale = self._watch.fault(self._sample, now)
        if stale is not None:
            self._latch(stale)
        if self._fault is not None:
            bus.write(ZERO)
        elif not self._written:
            bus.write(self._watch.torques)
        self._written = False
        cycle = bus.exchange()
        if cycle.fault is not None:
            self._latch(cycle.fault)
        if self._watch.answered >= 0:
            self._sample += 1
            self._publish(cycle)
        elif now - self._published >= REPEAT_PERIOD:
            self._published = now
            self._publish(cycle)

    def _publish(self, cycle: Cycle) -> None:
        """Publish a sample, unless a drive has not answered: figures that were not measured are not made up."""
        first, second = cycle.readings
        if first is None or second is None:
            self._incomplete += 1
            return
        self.note_answer()
        self._states.publish(
            joint_state(
                sample_stamp_ns(self._sample, self._rate_hz),
                ACTIVE_JOINTS,
                (first.position, second.position),
                (first.velocity, second.velocity),
                (first.torque, second.torque),
            )
        )

    def _on_command(self, message: JointState) -> None:
        try:
            ((tau1, tau2),) = read_fields(message, ACTIVE_JOINTS, ("effort",))
        except MessageError as error:
            self.drop(TORQUE_COMMAND, str(error))
            return
        sample = sample_of_stamp(stamp_of(message), self._rate_hz)
        if not self._active or sample is None or not self._watch.accepts(sample, self._sample):
            self.drop(TORQUE_COMMAND, f"stamp of sample {sample}, expected that of sample {self._sample}")
            return
        self._watch.take(sample, (tau1, tau2), time.monotonic())
        if self._fault is None:
            self._open_bus().write((tau1, tau2))
            self._written = True

    def _latch(self, fault: Fault, own: bool = True) -> None:
        """Stop the drives and remember why; tell it where nobody else has."""
        if self._fault is not None:
            return
        self._fault = fault
        if self._active:
            self._open_bus().quick_stop()
        if own:
            self._faults.publish(String(data=str(fault)))
        self._tell_state()
        self.get_logger().error(f"zero torque and quick stop: {fault}")

    def _on_fault(self, message: String) -> None:
        """Stop the drives for another node's fault; one's own comes back too and changes nothing."""
        if self._active:
            self._latch(Fault.from_text(message.data), own=False)

    def _tell_state(self) -> None:
        """Publish on drives/state whether a torque would be obeyed, and why not."""
        if self._fault is not None:
            text = str(self._fault)
        elif not self._active:
            text = "drives_off: dextar_bridge is not active"
        elif not self._open_bus().enabled:
            text = "drives_off: dextar_bridge/enable switches them on"
        else:
            text = ALL_WELL
        if text != self._told:
            self._told = text
            self._state.publish(String(data=text))

    def _on_emergency_stop(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self._bus is not None:
            self._bus.switch_off()
        self._latch(Fault("emergency_stop", "asked for by service"))
        response.success = self._bus is not None
        response.message = "power off asked of both drives" if response.success else "not configured: nothing to stop"
        return response

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        fault, bus = self._fault, self._bus
        response.success = True
        response.message = f"cleared {fault}" if fault is not None else "no fault was latched"
        if bus is not None:
            try:
                bus.reset(self._enable_timeout)
            except DriveError as error:
                response.success = False
                response.message = f"still there: {error.fault}"
                return response
            if self._active and not bus.enabled:
                response.message += "; the drives are off, dextar_bridge/enable switches them on"
        self._fault = None
        self._watch.pardon(self._sample, time.monotonic())
        self._tell_state()
        return response

    def _on_enable(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = False
        if not self._active or self._bus is None:
            response.message = "not active: activate the node instead"
        elif self._fault is not None:
            response.message = f"reset first: {self._fault}"
        else:
            try:
                self._bus.enable(self._enable_timeout)
                response.success = True
                response.message = "both drives are enabled"
            except DriveError as error:
                self._latch(error.fault)
                response.message = str(error.fault)
            self._watch.pardon(self._sample, time.monotonic())
            self._tell_state()
        return response


def main() -> None:
    """Run the node."""
    run_node(DextarBridge)


if __name__ == "__main__":
    main()
