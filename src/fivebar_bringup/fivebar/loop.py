# SPDX-License-Identifier: Apache-2.0
"""Controller and simulated robot as objects, for loops of one's own."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from fivebar.motion import Motion, load_scenario
from fivebar.robot import Posture
from fivebar_bringup.motions.request import ASSEMBLY_MODES
from fivebar_bringup.runs.admission import refuse_unfit
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.offline import plant_parts
from fivebar_control.controller.motion_controller import ControlOutput, MotionController
from fivebar_control.fault import Fault
from fivebar_control.scenario.stopping import stop_cycles
from fivebar_description.readings import SensorReadings
from fivebar_sim.simulated_plant import SimulatedPlant


class Controller:
    """The controller of a motion: `step` answers the readings of each sample with a torque.

    It is the law, the estimator and the guard of the motion's scenario, as in the node graph. It moves nothing and
    keeps no time: call `step` once a period, and apply the torque.

    Examples:
        >>> import fivebar
        >>> motion = fivebar.plan("dextar", goal=(0.0, 0.02), assembly_mode="-")
        >>> control, plant = fivebar.Controller(motion), fivebar.Plant(motion)
        >>> readings = plant.reset()
        >>> while not control.finished:
        ...     command = control.step(readings)
        ...     readings = plant.step(command.torque)
        >>> control.fault is None, round(command.estimate.y, 4)
        (True, 0.02)
    """

    def __init__(self, motion: Motion | Scenario | str | Path, *, compiled: bool = False) -> None:
        """Make the controller of a motion, a scenario, or the name or path of one, which is screened first.

        Args:
            motion: to be made.
            compiled: whether law, guard and filter are machine code, for fast loops. The torques are the same. The
                first one of a law in an installation compiles for a minute; later ones load the code in seconds.

        Raises:
            InputError: there is no such scenario, or its law cannot be compiled.
            PlanRefused: the screen refuses the scenario's motion, and it does not say `force: true`.
        """
        scenario = load_scenario(motion)
        if not isinstance(motion, Motion):
            refuse_unfit(scenario)
        kind: type[MotionController] = MotionController
        if compiled:
            # numba takes most of a second to import
            from fivebar_control.controller.compiled_controller import CompiledController as kind
        self._control = kind(scenario, stop_cycles(scenario))

    def step(self, readings: SensorReadings | None = None) -> ControlOutput:
        """Answer a sample.

        The same time again gets the same answer. Where samples are lost, the last torque is held, and after too many
        of them the fault `state_stale` is latched.

        Args:
            readings: of the sample; None for a lost one.

        Raises:
            InputError: readings are malformed, or not those that the scenario's controller needs; the time is that of
                no sample or goes back; the robot does not rest where the motion starts.
        """
        return self._control.step(readings)

    def reset(self) -> None:
        """Begin the motion again, with a robot at rest where it starts; a latched fault is cleared."""
        self._control.reset()

    def clear(self) -> None:
        """Clear a latched fault whose cause is gone; the robot is held where it rests, until `goto` or `reset`.

        Raises:
            StillFaulty: the cause is still there, the robot moves, or only a new beginning clears the fault.
        """
        self._control.clear()

    @property
    def finished(self) -> bool:
        """Whether the motion's last sample has been answered; from then on the robot is held where it ends."""
        return self._control.finished

    @property
    def fault(self) -> Fault | None:
        """The latched fault, None while the robot may move."""
        return self._control.fault

    @property
    def period(self) -> float:
        """Time from one sample to the next (s)."""
        return self._control.period

    def begin(self, posture: Posture) -> None:
        """Begin with a robot that rests in another posture, and hold it there until `goto`; clears a latched fault.

        Raises:
            InputError: the posture is not in the working mode of the scenario, or the estimator cannot begin there.
        """
        self._control.begin_at((posture.q11, posture.q12, posture.q21, posture.q22))

    def goto(
        self,
        goal: tuple[float, float],
        *,
        assembly_mode: Literal["+", "-"] | None = None,
        duration: float | None = None,
        via: Sequence[tuple[float, float]] = (),
        blend_radius: float | Sequence[float] = 0.0,
    ) -> None:
        """Plan another motion from where the robot rests, as a request to a running graph, and begin it.

        Args:
            goal: where the platform shall rest (m).
            assembly_mode: at the goal, the sign of det A, by default the one that the goal has.
            duration: of the whole motion (s), by default comfortably within the limits.
            via: points on the way (m), in straight lines.
            blend_radius: within which the corners there are rounded (m); 0 for rests. One for all or each.

        Raises:
            PlanRefused: the robot moves, a fault is latched, the law takes no requests, or no motion is feasible.

        Examples:
            >>> import fivebar
            >>> control = fivebar.Controller("unified_middle")
            >>> control.goto((0.0, 0.1))
            Traceback (most recent call last):
                ...
            fivebar_control.planning.motion_queue.GoalRefused: the robot is moving for another 2.00 s
        """
        # here, because a single motion needs none
        from fivebar_control.planning.motion_queue import Goal

        radii = [blend_radius] * len(via) if isinstance(blend_radius, float | int) else blend_radius
        assembly = 0 if assembly_mode is None else ASSEMBLY_MODES[assembly_mode]
        self._control.request(
            Goal(*goal, assembly, duration=duration or 0.0, via=tuple(via), blend_radius=tuple(map(float, radii)))
        )


class Plant(SimulatedPlant):
    """The simulated robot of a motion's scenario with its effects and sensors: `step` takes a torque.

    Examples:
        >>> import fivebar
        >>> plant = fivebar.Plant("gyro_middle", seed=3)
        >>> readings = plant.reset()
        >>> readings.joint_angles is None, len(readings.motor_angles)
        (True, 2)
    """

    def __init__(
        self,
        motion: Motion | Scenario | str | Path,
        *,
        seed: int | None = None,
        engine: Literal["pinocchio", "mujoco"] | None = None,
    ) -> None:
        """Make the robot of a motion, a scenario, or the name or path of one.

        Args:
            motion: whose robot.
            seed: of all its random errors, by default the scenario's.
            engine: what moves it, by default the scenario's.

        Raises:
            InputError: there is no such scenario, the engine lacks an effect, or its package is not installed.
        """
        changes: dict[str, Any] = {"seed": seed, "engine": engine}
        plant = {key: value for key, value in changes.items() if value is not None}
        scenario = load_scenario(motion, **({"plant": plant} if plant else {}))
        super().__init__(*plant_parts(scenario))
