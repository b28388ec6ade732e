# SPDX-License-Identifier: Apache-2.0
"""Finds a robot's elastic transmissions from a bag, and writes the robot file with the bandwidth that they allow."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from fivebar_bringup.identify.reading import find_bag, read_record, read_start
from fivebar_bringup.recorded.results import json_text, new_directory, write_results
from fivebar_control.identification.identification import NotIdentifiable
from fivebar_control.identification.least_squares import CONFIDENCE
from fivebar_control.identification.resonance import Resonance, find_resonance
from fivebar_control.laws.robot_sizes import LINK_SIDE, bandwidth_of, tuning_for
from fivebar_description.robot_file import RobotFile
from fivebar_description.strict_yaml import InputError, yaml_text

ROBOT_FILE, RESULTS = "tuned.yaml", "resonance.json"
"""The robot file with its tuning, for `robot:` in a scenario and every command with a ROBOT; and all results."""


class ResonanceResult(NamedTuple):
    """The findings from the bag of a chirp on a robot that a file describes."""

    start: RobotFile
    bag: Path
    resonance: Resonance

    @property
    def allowed(self) -> float:
        """Largest bandwidth (rad/s) of the unified law that feeds back an estimate from the motors' encoders."""
        return bandwidth_of(self.resonance.lowest)

    @property
    def allowed_on_links(self) -> float:
        """The same where it feeds back the links' own motion."""
        return bandwidth_of(self.resonance.lowest, LINK_SIDE)

    @property
    def lowered(self) -> bool:
        """Whether the robot's tuning has to change."""
        return self.robot_file().tuning != self.start.tuning

    def robot_file(self) -> RobotFile:
        """Return the initial file with the tuning that the transmissions allow."""
        tuning = tuning_for(self.start, self.resonance.lowest)
        return self.start.model_copy(update={"name": f"{self.start.name}_tuned", "tuning": tuning})

    def parameter_file(self) -> str:
        """Return the robot file as YAML, with what was measured in a comment."""
        lines = [f"Tuned for the transmissions that {self.bag} shows, starting from {self.start.name}:"]
        lines += [
            f"  leg {number}: {leg.frequency.value:.4g} ± {leg.frequency.half_width:.2g} Hz"
            for number, leg in enumerate(self.resonance.legs, start=1)
        ]
        lines.append(
            f"Bandwidth with speeds that are measured on the links: at most {self.allowed_on_links:.3g} rad/s."
        )
        # neither a path nor a name may end the comment
        lines = ["# " + "".join(letter if letter.isprintable() else "?" for letter in line) for line in lines]
        return "\n".join(lines) + "\n" + yaml_text(self.robot_file().model_dump(mode="json", exclude_none=True))

    def as_json(self) -> dict[str, Any]:
        """Return all results for a file."""
        resonance = self.resonance
        return {
            "robot": self.start.name,
            "bag": str(self.bag),
            "confidence": CONFIDENCE,
            "legs": [{name: value._asdict() for name, value in leg._asdict().items()} for leg in resonance.legs],
            "locked_hz": list(resonance.locked),
            "delay_s": resonance.delay._asdict(),
            "highest_hz": resonance.highest,
            "misfit": resonance.misfit,
            "amplitudes": resonance.amplitudes,
            "bandwidth_rad_s": {"motors": self.allowed, "links": self.allowed_on_links},
            "tuning": {key: value for key, value in self.robot_file().tuning._asdict().items() if value is not None},
        }


def resonance_of_bag(path: Path, robot: str | None = None, namespace: str | None = None) -> ResonanceResult:
    """Find the transmissions of the robot of a bag or of a run's directory.

    Raises:
        InputError: the bag, the robot or the motion is unsuitable, or no resonance is visible, by a `NoResonance`.
        BagError: the bag cannot be read or lacks a topic.
    """
    source = find_bag(path, namespace)
    start = read_start(source, robot)
    try:
        resonance = find_resonance(start.five_bar(), read_record(source, start))
    except NotIdentifiable as error:
        raise InputError(f"{source.bag}: {error}") from error
    return ResonanceResult(start, source.bag, resonance)


def write_resonance(result: ResonanceResult, out: Path | None) -> Path:
    """Write robot file and results into a new directory, and return the robot file.

    Raises:
        InputError: the directory cannot be used.
    """
    directory = new_directory(out, f"resonance-{result.start.name}")
    write_results(directory, {ROBOT_FILE: result.parameter_file(), RESULTS: json_text(result.as_json())}, {})
    return directory / ROBOT_FILE
