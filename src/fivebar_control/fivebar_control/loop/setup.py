"""The set-up of a control cycle before its first sample: steps of the laws, settings as numbers, initial memory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from fivebar_control.laws.law import Law, no_step, unchanged
from fivebar_control.laws.registry import ESTIMATE, SIGMOID, Controller, TunedController
from fivebar_control.laws.torque import ZERO
from fivebar_control.loop.cycle import CycleMemory, CycleSettings
from fivebar_control.model.state import Platform
from fivebar_control.safety.brake import Brake
from fivebar_control.safety.stages import Limits
from fivebar_description.parameters import FiveBar, with_floats
from fivebar_description.settings import as_numbers


def law_functions(controller: Controller) -> dict[str, Callable[..., Any]]:
    """Return what the closed loop calls of a controller's laws, by the names under which it knows these functions."""
    nominal, constraint = controller.nominal, controller.constraint
    return {
        "nominal_step": nominal.step,
        "constraint_step": no_step if constraint is None else constraint.step,
        "nominal_after_gap": nominal.after_gap,
        "constraint_after_gap": unchanged if constraint is None else constraint.after_gap,
    }


def first_memory(
    controller: Controller, settings: CycleSettings, references: Callable[[], Sequence[Platform]]
) -> CycleMemory:
    """Return the memory of a controller before the first sample.

    Args:
        controller: whose memory.
        settings: constants of its cycle.
        references: returns those of all samples, for a law that needs the whole plan.
    """

    def of_law(law: Law | None, numbers: Any) -> Any:
        if law is None:
            return None
        return law.first_memory(settings.robot, settings.mode1, settings.mode2, references, settings.period, numbers)

    nominal, constraint = (
        of_law(controller.nominal, settings.nominal),
        of_law(controller.constraint, settings.constraint),
    )
    return CycleMemory(nominal, constraint, ZERO, 0, 0)


def cycle_settings_of(
    robot: FiveBar,
    mode1: int,
    mode2: int,
    rate_hz: int,
    tuned: TunedController,
    zone_time: float,
    limits: Limits,
    brake: Brake,
) -> CycleSettings:
    """Return the constants of the control cycle.

    Args:
        robot, mode1, mode2: nominal robot and its working mode.
        rate_hz: sampling rate (Hz).
        tuned: controller.
        zone_time: for which sigma is meant to be 1 at a crossing (s).
        limits, brake: of the last node.
    """
    return CycleSettings(
        robot=with_floats(robot),
        mode1=int(mode1),
        mode2=int(mode2),
        period=1.0 / rate_hz,
        nominal=as_numbers(tuned.nominal.settings),
        constraint=None if tuned.constraint is None else as_numbers(tuned.constraint.settings),
        blended=tuned.controller.blended,
        weighted_in_time=tuned.controller.weighting == SIGMOID,
        zone_time=zone_time if tuned.controller.weighting == ESTIMATE else 0.0,
        limits=limits,
        brake=brake,
    )
