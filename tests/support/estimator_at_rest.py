# SPDX-License-Identifier: Apache-2.0
"""The estimator's constants as tests choose them, and the memory of a robot that rests at home."""

from __future__ import annotations

from fivebar_control.estimation.constants import EstimatorModel, estimator_model
from fivebar_control.estimation.readings import EstimatorMemory, with_motors
from fivebar_control.estimation.settings import Drives, EkfSettings, Sensing
from fivebar_control.estimation.step import first_update, next_update
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.robot_file import load_robot
from fivebar_description.sensors import KnownSensors, PassiveEncoder

ROBOT, MODES, RATE_HZ = load_robot(), (1, -1), 500
HOME = (0.0, 0.15)
ANGLES = inverse_geometry(ROBOT, MODES, *HOME)
TIGHT = EkfSettings(gyro=True, camera=True)


def model_of(
    settings: EkfSettings = TIGHT,
    drives: Drives | None = None,
    passive: PassiveEncoder | None = None,
    known: KnownSensors | None = None,
) -> EstimatorModel:
    return estimator_model(
        ROBOT,
        MODES,
        Sensing(
            RATE_HZ,
            Drives() if drives is None else drives,
            settings,
            passive=PassiveEncoder(2, None) if passive is None else passive,
            known=KnownSensors() if known is None else known,
        ),
    )


def started(model: EstimatorModel, samples: int = 4) -> EstimatorMemory:
    """Return the memory of a robot at rest at home, its last motor readings still to be taken."""
    memory = first_update(model, 1, ANGLES.q11, ANGLES.q21)
    for sample in range(1, samples + 1):
        if sample > 1:
            memory = next_update(model, memory, memory.newest).memory
        memory = with_motors(memory, sample, 1, ANGLES.q11, ANGLES.q21, 0.0, 0.0)
    return memory
