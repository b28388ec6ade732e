# SPDX-License-Identifier: Apache-2.0
"""Runs: simulated here, or read from the directory of an earlier one."""

from __future__ import annotations

import json
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from fivebar.motion import Motion, load_scenario
from fivebar.picture import Drawing
from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.recorded.outcome import RunOutcome
from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_bringup.recorded.series import RunSeries
from fivebar_bringup.recorded.summary import Summary
from fivebar_bringup.recorded.table_files import data_frame, write_csv, write_mat, write_parquet
from fivebar_bringup.report.analysis import RunAnalysis
from fivebar_bringup.report.outcome_words import outcome_details
from fivebar_bringup.report.report import read_analysis
from fivebar_bringup.runs.admission import refuse_unfit
from fivebar_bringup.runs.offline import run_offline
from fivebar_bringup.scenario import Scenario
from fivebar_description.errors import InputError
from fivebar_description.suggestion import expected_one_of


class Run(NamedTuple):
    """A finished run.

    Attributes:
        analysis: scenario, plan, robot, series and summary.
    """

    analysis: RunAnalysis

    @property
    def scenario(self) -> Scenario:
        """The scenario that was run, with every default."""
        return self.analysis.scenario

    @property
    def summary(self) -> Summary:
        """Metrics of the run, as in summary.json."""
        return self.analysis.summary

    @property
    def outcome(self) -> RunOutcome:
        """The outcome of the run, as in summary.json: succeeded, off_reference, stopped, refused or interrupted."""
        return self.summary.outcome

    @property
    def series(self) -> RunSeries:
        """The run as arrays over its samples."""
        return self.analysis.series

    def __str__(self) -> str:
        """Return the outcome, with the largest distance from the reference, rounded up, and what went wrong.

        Examples:
            >>> import fivebar
            >>> print(fivebar.simulate("unified_middle"))
            succeeded, at most 0.04 mm from the reference, tolerance 2 mm
        """
        return f"{self.outcome}{outcome_details(self.summary)}"

    def __repr__(self) -> str:
        """Return which run it is, beside its outcome; `summary` and `series` have the figures.

        Examples:
            >>> import fivebar
            >>> fivebar.simulate("unified_middle")
            <Run unified_middle: succeeded, at most 0.04 mm from the reference, tolerance 2 mm>
        """
        return f"<Run {self.scenario.name}: {self}>"

    def columns(self) -> dict[str, FloatArray]:
        """Return the run as columns by name, each [n] in SI units, a value per sample, NaN where nothing is known.

        [The table of a run](run_table.md) says what each column is.

        Examples:
            >>> import fivebar
            >>> columns = fivebar.simulate(fivebar.plan("dextar", goal=(0.0, 0.02))).columns()
            >>> columns["t"].size, "tau1_command" in columns
            (271, True)
        """
        return self.series.columns()

    def to_dataframe(self) -> Any:
        """Return the columns as a `pandas.DataFrame`; its `attrs["units"]` has their units.

        Raises:
            InputError: pandas is not installed (`pip install 'fivebar[data]'`).

        Examples:
            >>> import fivebar
            >>> table = fivebar.simulate("middle").to_dataframe()
            >>> round(float(table.sigma.max()), 3), table.attrs["units"]["tau1"]
            (1.0, 'Nm')
        """
        return data_frame(self.columns())

    def to_csv(self, path: str | Path) -> None:
        """Write the columns as CSV: names in the first row, numbers in full precision, nothing where none is known.

        Raises:
            InputError: the file cannot be written.
        """
        write_csv(self.columns(), Path(path))

    def to_mat(self, path: str | Path) -> None:
        """Write the columns for MATLAB and Octave: a structure `run` of column vectors, and their `units`.

        Raises:
            InputError: the file cannot be written.
        """
        write_mat(self.columns(), Path(path))

    def to_parquet(self, path: str | Path) -> None:
        """Write the columns as Parquet, with the unit of each in its metadata.

        Raises:
            InputError: pyarrow is not installed (`pip install 'fivebar[data]'`), or the file cannot be written.
        """
        write_parquet(self.columns(), Path(path))

    def plot(self, name: str = "hero") -> Drawing:
        """Draw the run: the robot on its way beside torques and weight, or another figure of its report.

        Args:
            name: "hero", "path", "torques", "tracking", "vhc_error", "supervisor", "criterion", "acceleration", or
                "cycles" of a run in real time.

        Raises:
            InputError: there is no such figure; proposes the one that may be meant.

        Examples:
            >>> import fivebar
            >>> picture = fivebar.simulate("middle").plot("torques")
            >>> len(picture.figure.axes)
            2
        """
        # here, because matplotlib takes as long to load as all the rest
        from fivebar_bringup.pages.style import house_style
        from fivebar_bringup.report.gallery import DRAW

        if name not in DRAW:
            raise InputError(f"{name!r}: {expected_one_of(name, tuple(DRAW))}")
        with house_style():
            return Drawing(DRAW[name](self.analysis), name)

    def _repr_html_(self) -> str:
        rows = (
            f"<tr><th>{escape(key)}</th><td>{escape(json.dumps(value))}</td></tr>"
            for key, value in self.summary.as_dict().items()
        )
        return f"<table>{''.join(rows)}</table>"


def simulate(motion: Motion | Scenario | str | Path, out: str | Path | None = None) -> Run:
    """Run a motion in this process, without ROS: the controllers and the plant of `fivebar simulate`.

    Args:
        motion: a planned motion, a scenario, or the name or path of one. A scenario is screened first.
        out: new or empty directory for bag, summary and page; by default nothing is kept but the result.

    Raises:
        InputError: there is no such scenario, or the directory cannot be used.
        PlanRefused: the screen refuses the scenario's motion, and it does not say `force: true`.

    Examples:
        >>> import fivebar
        >>> run = fivebar.simulate("unified_middle")
        >>> run.outcome.value, run.summary.tracking_error_peak_m < 3.4e-5
        ('succeeded', True)
    """
    if isinstance(motion, Motion):
        scenario = motion.scenario
    else:
        scenario = motion if isinstance(motion, Scenario) else load_scenario(motion)
        refuse_unfit(scenario)
    if out is not None:
        return load_run(run_offline(scenario, Path(out), _unreported)[0].path)
    with TemporaryDirectory() as folder:
        return load_run(run_offline(scenario, Path(folder, "run"), _unreported, with_page=False)[0].path)


def load_run(directory: str | Path) -> Run:
    """Read a run from its directory, such as one of `fivebar run`.

    Raises:
        InputError: the directory does not hold a run.
        BagError: its bag cannot be read or does not hold a run of the scenario.
    """
    return Run(read_analysis(RunDirectory(Path(directory))))


def _unreported(done: int, total: int) -> None:
    """Take the progress of a run, which takes less than a second."""
