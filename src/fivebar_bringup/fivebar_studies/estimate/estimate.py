# SPDX-License-Identifier: Apache-2.0
"""Estimates a bag again, with the recorded settings and with others."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from fivebar_bringup.identify.reading import find_bag
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.units import error_of
from fivebar_control.estimation.homing import HomingContradicted
from fivebar_description.modules import modules_unopened
from fivebar_description.strict_yaml import InputError
from fivebar_studies.estimate.changes import SECTIONS, changed_scenario
from fivebar_studies.estimate.record import read_estimator_record
from fivebar_studies.estimate.replay import Replay, estimated_again, with_payloads_as_taken
from fivebar_studies.estimate.sensor_mounting import refuse_sensors_otherwise


class EstimationComparison(NamedTuple):
    """A bag estimated with the recorded settings and with others, the same ones where nothing was changed."""

    bag: Path
    recorded: Scenario
    changed: Scenario
    before: Replay
    after: Replay

    def changes(self) -> list[tuple[str, str, str]]:
        """Return name, recorded and new value of every setting that differs."""
        return [
            (f"{section}.{name}", str(was), str(now))
            for section in SECTIONS
            for (name, was), now in zip(
                getattr(self.recorded, section)._asdict().items(), getattr(self.changed, section), strict=True
            )
            if was != now
        ]

    def rows(self) -> list[tuple[str, str, str]]:
        """Return the figures: name, with the recorded settings, with the others."""
        before, after = self.before.as_json(), self.after.as_json()
        kinds = (
            ("innovations of the encoders, mean square (1 expected)", "innovations_encoders", ""),
            ("its largest value in a sample", "innovations_encoders_max", ""),
            ("innovations of the gyroscope, mean square (1 expected)", "innovations_gyro", ""),
            ("its largest value in a sample", "innovations_gyro_max", ""),
            ("innovations of the passive joint's encoder, mean square (1 expected)", "innovations_elbow", ""),
            ("its largest value in a sample", "innovations_elbow_max", ""),
            ("NEES of the position (2 expected)", "nees_position", ""),
            ("NEES of the velocity (2 expected)", "nees_velocity", ""),
            ("largest distance from the exact position", "estimate_error_max_m", "m"),
            ("largest distance from the recorded estimate", "difference_max_m", "m"),
        )
        rows = [(words, _text(before[name], unit), _text(after[name], unit)) for words, name, unit in kinds]
        rows.append(
            ("equal to the recorded estimate, bit for bit", _yes(before["identical"]), _yes(after["identical"]))
        )
        return [*rows, ("fault", before["fault"] or "none", after["fault"] or "none")]

    def as_json(self) -> dict[str, Any]:
        """Return the result as plain values."""
        return {
            "bag": str(self.bag),
            "changes": {name: {"recorded": was, "changed": now} for name, was, now in self.changes()},
            "recorded": self.before.as_json(),
            "changed": self.after.as_json(),
        }


def _text(value: float | None, unit: str) -> str:
    if value is None:
        return "–"
    return error_of(value, unit) if unit else f"{value:.3g}"


def _yes(same: bool) -> str:
    return "yes" if same else "no"


@modules_unopened()
def estimate_bag(
    path: Path,
    file: Path | None,
    settings: Sequence[str],
    scenario: Path | None = None,
    namespace: str | None = None,
) -> EstimationComparison:
    """Estimate a bag, or that of a run's directory, with the recorded settings and with others.

    Args:
        path: of the bag or the run.
        file: YAML with sections `ekf` and `tolerances`, if any.
        settings: single ones, `KEY=VALUE`.
        scenario: of a bag that lies in no run.
        namespace: of the topics, None for the one that the bag has.

    Raises:
        InputError: bag, scenario or settings are unsuitable, or a sensor is mounted, signed or scaled otherwise than
            the scenario says.
        BagError: the bag cannot be read or lacks a topic.
    """
    source = find_bag(path, namespace)
    if source.run is None and scenario is None:
        raise InputError(f"--scenario: expected that of the recorded run: {source.bag} lies in no run")
    if source.run is not None and scenario is not None:
        raise InputError(f"--scenario: {scenario}: expected none: {source.bag} lies in a run, which has its own")
    recorded = source.run.read_scenario() if source.run is not None else load_scenario(str(scenario))
    if not recorded.estimated:
        raise InputError(f"{source.bag}: was recorded with estimator none: expected a run with estimator ekf")
    changed = changed_scenario(recorded, file, settings)
    record = read_estimator_record(source, recorded)
    try:
        record = with_payloads_as_taken(record, recorded, source.bag)
        before = estimated_again(record, recorded, source.bag)
    except HomingContradicted as error:
        refuse_sensors_otherwise(record, recorded, source.bag, None)
        raise error
    refuse_sensors_otherwise(record, recorded, source.bag, before)
    after = before if changed == recorded else estimated_again(record, changed, source.bag)
    return EstimationComparison(source.bag, recorded, changed, before, after)
