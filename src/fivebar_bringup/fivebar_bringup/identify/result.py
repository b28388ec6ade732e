# SPDX-License-Identifier: Apache-2.0
"""The result of an identification beside the parameters that it started from."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

from fivebar_control.identification.equations import COLUMNS, PARAMETERS
from fivebar_control.identification.identification import Identification, parameter_values
from fivebar_control.identification.least_squares import CONFIDENCE
from fivebar_description.robot_file import CoggingHarmonic, Friction, Inertias, Mass, MotorCogging, RobotFile
from fivebar_description.strict_yaml import yaml_text

INTERVALS = f"{100.0 * CONFIDENCE:.0f} % intervals"

UNITS = dict(zip(PARAMETERS, ("kg m²", "kg m²", "kg", "Nm", "Nm", "Nm", "Nm"), strict=True))


BESIDE_SHOWN = (("f_v11", "Nm s/rad"), ("f_v21", "Nm s/rad"), ("passive", "Nm"))
"""Viscous friction of the motors, and Coulomb friction of each passive joint, in the order of `COLUMNS`."""


class IdentifiedParameter(NamedTuple):
    """One identified parameter with the half width of its interval and what it was before, in its unit."""

    name: str
    unit: str
    value: float
    half_width: float
    before: float

    @property
    def decimals(self) -> int:
        """Decimal places that show two digits of the interval."""
        return min(max(1 - math.floor(math.log10(self.half_width)), 0), 9) if self.half_width > 0.0 else 9

    def text(self) -> str:
        """Return value and interval."""
        value = round(self.value, self.decimals) + 0.0  # which takes the minus from a zero
        return f"{value:.{self.decimals}f} ± {self.half_width:.{self.decimals}f}"

    def change(self) -> str:
        """Return the change in percent, or in the unit where it was zero before."""
        if self.before == 0.0:
            return f"{self.value - self.before:+.4f} {self.unit}"
        return f"{100.0 * (self.value - self.before) / abs(self.before):+.2f} %"


class IdentificationResult(NamedTuple):
    """An identified robot: the initial robot file, the bag, its rate and length in samples, and the fit."""

    start: RobotFile
    bag: Path
    rate_hz: float
    samples: int
    identification: Identification

    def parameters(self) -> list[IdentifiedParameter]:
        """Return the parameters in the order of `PARAMETERS`."""
        before = parameter_values(self.start.five_bar())
        count = len(PARAMETERS)
        values, halves = self.identification.fit.values.tolist(), self.identification.fit.half_widths.tolist()
        return [
            IdentifiedParameter(name, UNITS[name], *figures)
            for name, *figures in zip(PARAMETERS, values[:count], halves[:count], before, strict=True)
        ]

    def beside(self) -> list[IdentifiedParameter]:
        """Return what is identified beside the parameters of the file, from nothing before: no controller uses it."""
        fit = self.identification.fit
        values, halves = fit.values.tolist(), fit.half_widths.tolist()
        rows = [
            IdentifiedParameter(name, unit, values[number], halves[number], 0.0)
            for number, (name, unit) in enumerate(BESIDE_SHOWN, start=len(PARAMETERS))
        ]
        return [
            *rows,
            IdentifiedParameter("constants", "motor 2 / motor 1", *self.identification.constants_ratio(), 1.0),
        ]

    def rows(self) -> list[tuple[str, str, str, str, str]]:
        """Return what is identified as the lines of a table: name, before, value and interval, unit, change."""
        return [
            *(
                (parameter.name, f"{parameter.before:g}", parameter.text(), parameter.unit, parameter.change())
                for parameter in self.parameters()
            ),
            *((parameter.name, "", parameter.text(), parameter.unit, "") for parameter in self.beside()),
        ]

    def cogging(self) -> MotorCogging:
        """Return the cogging that is seen, as the robot file has it."""
        numbers = iter(self.identification.fit.values[len(COLUMNS) :].tolist())
        of_motors = [
            tuple(
                CoggingHarmonic(periods=periods, cosine=round(next(numbers), 8), sine=round(next(numbers), 8))
                for periods in harmonics
            )
            for harmonics in self.identification.harmonics
        ]
        return MotorCogging(q11=of_motors[0], q21=of_motors[1])

    def robot_file(self) -> RobotFile:
        """Return the identified robot: what is not identified is that of the initial file."""
        value = {parameter.name: round(parameter.value, parameter.decimals + 1) for parameter in self.parameters()}
        grouped = self.start.grouped()
        forces, robot = self.start.forces, self.start.five_bar()
        if forces.tilt > 0.0:
            # they do not follow from grouped parameters
            forces = forces._replace(moment_1=robot.leg1.moment, moment_2=robot.leg2.moment)
        friction = {name: value[name] for name in ("f_s11", "f_s21", "f_off11", "f_off21")}
        return RobotFile(
            name=f"{self.start.name}_identified",
            lengths_m=self.start.lengths_m,
            inertias_kg_m2=Inertias(
                zz_11R=value["zz_11R"], zz_21R=value["zz_21R"], zz_12R=grouped.residual1, zz_22R=grouped.residual2
            ),
            mass_kg=Mass(m=value["m"] - forces.payload),
            friction=Friction(**friction, width_rad_s=self.start.friction.width_rad_s),
            cogging=self.cogging(),
            # beside all links, which the identified sums need not fit, the distal ones say nothing more
            distal_links=self.start.distal_links if self.start.proximal_links is None else None,
            tolerances=self.start.tolerances,
            loads=self.start.loads,
            forces=forces,
            sensors=self.start.sensors,
            imu=self.start.imu,
            passive_encoder=self.start.passive_encoder,
            camera=self.start.camera,
            transmission=self.start.transmission,
            drives=self.start.drives,
            tuning=self.start.tuning,
            home_m=self.start.home_m,
            forbidden=self.start.forbidden,
            elbows_pass=self.start.elbows_pass,
        )

    def encoder(self) -> str:
        """Return the resolution of the angle readings in words."""
        resolution = self.identification.cutoffs.resolution
        if resolution == 0.0:
            return "no counts"
        return f"{2.0 * math.pi / resolution:.0f} counts per revolution"

    def parameter_file(self) -> str:
        """Return the robot file as YAML, its intervals in a comment."""
        width = max(len(name) for name in PARAMETERS)
        lines = [f"Identified from {self.bag}, starting from {self.start.name}: {INTERVALS}"]
        lines += [
            f"  {parameter.name:<{width}}  {parameter.text()} {parameter.unit}" for parameter in self.parameters()
        ]
        lines += [f"  {parameter.name:<{width}}  {parameter.text()} {parameter.unit}" for parameter in self.beside()]
        lines.append(f"Lengths and width_rad_s are those of {self.start.name}, not identified.")
        # neither a path nor a name may end the comment
        lines = ["# " + "".join(letter if letter.isprintable() else "?" for letter in line) for line in lines]
        return "\n".join(lines) + "\n" + yaml_text(self.robot_file().model_dump(mode="json", exclude_none=True))

    def as_json(self) -> dict[str, Any]:
        """Return all results for a file."""
        fit, cutoffs = self.identification.fit, self.identification.cutoffs
        return {
            "robot": self.start.name,
            "bag": str(self.bag),
            "samples": self.samples,
            "rate_hz": self.rate_hz,
            "confidence": CONFIDENCE,
            "parameters": {
                parameter.name: {
                    "value": parameter.value,
                    "half_width": parameter.half_width,
                    "before": parameter.before,
                    "unit": parameter.unit,
                }
                for parameter in self.parameters()
            },
            "beside": {
                parameter.name: {"value": parameter.value, "half_width": parameter.half_width, "unit": parameter.unit}
                for parameter in self.beside()
            },
            "cogging": {
                f"q{motor}1": list(harmonics) for motor, harmonics in enumerate(self.identification.harmonics, start=1)
            },
            "condition_number": fit.condition,
            "encoder_resolution_rad": cutoffs.resolution or None,
            "angle_noise_rad": cutoffs.noise,
            "acceleration_rms_rad_s2": cutoffs.acceleration,
            "derivative_cutoff_hz": cutoffs.derivative_hz,
            "parallel_cutoff_hz": cutoffs.parallel_hz,
            "used_s": list(self.identification.used_s),
            "independent_rows": fit.independent,
            "residual_rms_nm": fit.deviations.tolist(),
            "misfit": list(self.identification.misfit),
        }
