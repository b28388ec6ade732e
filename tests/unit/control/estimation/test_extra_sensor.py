# SPDX-License-Identifier: Apache-2.0
"""A sensor from another package: what is expected of it, how its section is refused, and its fault."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from estimator_at_rest import model_of, started
from linear_encoder import SENSOR, LinearEncoderSettings, deviation, expected_length, read_length

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.offline import simulate
from fivebar_control.compiling import bound
from fivebar_control.estimation.covariance import VX, VY, X, Y
from fivebar_control.estimation.extra_sensor import extra_taken
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.scenario.sensors import check_sensors
from fivebar_description.errors import InputError
from fivebar_description.extra_sensor import mounted
from fivebar_description.modules import modules_unopened
from fivebar_description.robot_file import load_robot

PLACED = LinearEncoderSettings(0.12, 0.28)
CONTENT = {
    "name": "with_linear_encoder",
    "controller": "unified",
    "waypoints": [[0.0, 0.15], [0.0, 0.02]],
    "estimator": "ekf",
    "plant": {"torque_limit": 10.0, "encoder_counts": 20000, "delay_samples": 1},
    "tolerances": {"length": 5e-5, "zero": 2e-4},
}


def test_the_expected_length_is_that_of_the_simulated_encoder_and_its_derivatives_are_its_differences() -> None:
    robot, (x, y), step = load_robot(), (0.02, 0.13), 1e-6
    exact = PLACED._replace(step=1e-9)
    found = expected_length(exact, robot, (1, -1), x, y, 0.0, 0.0)
    assert read_length(exact, robot, *inverse_geometry(robot, (1, -1), x, y), 0.0) == pytest.approx(
        found.value, abs=2e-9
    )
    for along, derivative in (((step, 0.0), found.by_x), ((0.0, step), found.by_y)):
        there, back = (
            expected_length(exact, robot, (1, -1), x + sign * along[0], y + sign * along[1], 0.0, 0.0).value
            for sign in (1.0, -1.0)
        )
        assert (there - back) / (2.0 * step) == pytest.approx(derivative, abs=1e-8)


def test_a_reading_moves_the_estimate_as_the_kalman_gain_of_its_direction_says() -> None:
    """Between two samples: by its moment it is that of the place where the platform has got by then."""
    model = model_of()._replace(extra=PLACED)
    belief = started(model).belief
    belief = belief._replace(
        estimate=belief.estimate._replace(vx=0.1, vy=-0.2), covariance=np.diag(np.full(len(belief.covariance), 1e-8))
    )
    lag, variance, off = 0.001, 4e-8, 1e-4
    x, y = belief.estimate.x + lag * 0.1, belief.estimate.y - lag * 0.2
    wanted = expected_length(PLACED, load_robot(), (1, -1), x, y, 0.0, 0.0)
    taken = bound(extra_taken, extra_expected=expected_length)(model, belief, wanted.value + off, lag, variance)
    row = np.zeros(len(belief.covariance))
    row[X], row[Y], row[VX], row[VY] = wanted.by_x, wanted.by_y, lag * wanted.by_x, lag * wanted.by_y
    total = 1e-8 * float(row @ row) + variance
    moved = np.array(taken.belief.estimate[:4]) - np.array(belief.estimate[:4])
    np.testing.assert_allclose(moved, 1e-8 * row[[X, Y, VX, VY]] * off / total, rtol=1e-6, atol=1e-15)
    assert taken.misfit == pytest.approx(off * off / total, rel=1e-9)


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ({"x": 0.1}, r"extra_sensor\.kind: None: expected my_package\.my_sensor:SENSOR"),
        ({"kind": "no such place"}, r"extra_sensor\.kind: 'no such place': expected my_package"),
        ({"kind": "no_such_module:SENSOR"}, "no_such_module:SENSOR: cannot be loaded"),
        ({"kind": "linear_encoder:NO_SENSOR"}, "expected a fivebar_description.extra_sensor.ExtraSensor, found float"),
        ({"kind": "linear_encoder:SENSOR", "z": 1.0}, r"extra_sensor\.z: unknown key"),
        ({"kind": "linear_encoder:SENSOR", "step": 0.0}, r"extra_sensor\.step"),
    ],
)
def test_a_section_that_names_no_sensor_or_does_not_fit_it_is_refused(section: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        mounted(section)


def test_without_an_estimator_nothing_would_read_it() -> None:
    content = {**CONTENT, "estimator": "none", "extra_sensor": {"kind": "linear_encoder:SENSOR"}}
    scenario = Scenario.model_validate(content)
    with pytest.raises(InputError, match="extra_sensor: only the estimator reads it"):
        check_sensors(scenario)


def test_a_scenario_that_is_only_read_names_it_without_importing_its_module() -> None:
    with modules_unopened():
        scenario = Scenario.model_validate({**CONTENT, "extra_sensor": {"kind": "no_such_module:SENSOR"}})
    assert scenario.extra_sensor == {"kind": "no_such_module:SENSOR"}
    with pytest.raises(InputError, match="no_such_module:SENSOR: where a scenario or a run is only read"):
        scenario.extra()


def test_readings_that_contradict_the_encoders_are_a_fault_that_names_the_sensor(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The encoder on the robot is fixed 10 mm from where the scenario says."""

    def elsewhere(settings: LinearEncoderSettings, *rest: Any) -> float:
        return read_length(settings._replace(x=settings.x + 0.01), *rest)

    monkeypatch.setattr("linear_encoder.SHIFTED", SENSOR._replace(read=elsewhere), raising=False)
    section = {"kind": "linear_encoder:SHIFTED", "x": 0.12, "y": 0.28}
    run = simulate(Scenario.model_validate({**CONTENT, "extra_sensor": section}))
    assert run.faults[0].startswith("estimate_inconsistent: at sample ")
    assert "the sensor of `extra_sensor` differs" in run.faults[0]


def test_its_deviation_holds_all_that_is_not_known_of_it() -> None:
    spread = math.sqrt((1e-6**2 + 2e-5**2) / 3.0 + 2e-6**2)
    assert deviation(LinearEncoderSettings()) == pytest.approx(spread, rel=1e-12)
