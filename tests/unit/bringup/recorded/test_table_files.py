# SPDX-License-Identifier: Apache-2.0
"""The table of a run as a file: other programs read the numbers that the run has, bit for bit."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet
import pytest
from scipy.io import loadmat

import fivebar
from fivebar_bringup.extras import how_to_install
from fivebar_bringup.recorded.series import UNITS


@pytest.fixture(scope="module")
def run() -> fivebar.Run:
    return fivebar.simulate(fivebar.plan("dextar", goal=(0.0, 0.02), assembly_mode="-", fastest=True))


def test_the_frame_has_every_column_and_its_unit(run: fivebar.Run) -> None:
    frame, series = run.to_dataframe(), run.series
    assert list(frame) == list(run.columns())
    assert np.array_equal(frame.tau2, series.torque_applied[:, 1])
    assert np.array_equal(frame.error_y, frame.y - frame.yd)
    # a robot that is measured exactly: what acts in a period is what answered the sample before
    assert np.array_equal(frame.tau1_command[:-1], frame.tau1[1:])
    assert frame.attrs["units"] == {name: UNITS[name] for name in frame}
    assert frame.attrs["units"]["vx"] == "m/s"


def test_what_a_run_does_not_have_is_left_out(run: fivebar.Run) -> None:
    assert not {"passive_angle", "q11_true", "tau1_constraint", "estimate_error"} & set(run.columns())


def test_csv_holds_every_digit(run: fivebar.Run, tmp_path: Path) -> None:
    run.to_csv(tmp_path / "run.csv")
    # not all parsers of pandas are exact, Python's is
    read = pd.read_csv(tmp_path / "run.csv", dtype=str).astype(float)
    pd.testing.assert_frame_equal(read, run.to_dataframe(), check_exact=True, check_dtype=False)


def test_matlab_gets_a_structure_of_columns(run: fivebar.Run, tmp_path: Path) -> None:
    run.to_mat(tmp_path / "run.mat")
    content = loadmat(tmp_path / "run.mat")
    columns = run.columns()
    assert content["run"].dtype.names == tuple(columns)
    for name, values in columns.items():
        assert np.array_equal(content["run"][name][0, 0][:, 0], values, equal_nan=True), name
    assert content["units"]["q11"][0, 0] == "rad"


def test_parquet_holds_numbers_and_units(run: fivebar.Run, tmp_path: Path) -> None:
    run.to_parquet(tmp_path / "run.parquet")
    pd.testing.assert_frame_equal(pd.read_parquet(tmp_path / "run.parquet"), run.to_dataframe(), check_exact=True)
    schema = pyarrow.parquet.read_schema(tmp_path / "run.parquet")
    assert schema.field("tau1").metadata == {b"unit": b"Nm"}


def test_a_place_that_cannot_be_written_is_refused_in_one_line(run: fivebar.Run, tmp_path: Path) -> None:
    for write in (run.to_csv, run.to_mat, run.to_parquet):
        with pytest.raises(fivebar.InputError, match=r"missing/run: cannot be used .*No such file"):
            write(tmp_path / "missing" / "run")


def test_without_pandas_the_error_says_what_to_install(run: fivebar.Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(fivebar.InputError, match="pandas is not installed: make extras"):
        run.to_dataframe()


def test_an_extra_is_installed_by_make_in_a_clone_and_by_pip_elsewhere(tmp_path: Path) -> None:
    assert how_to_install("cluster", tmp_path) == "pip install 'fivebar[cluster]'"
    (tmp_path / "Makefile").touch()
    assert how_to_install("cluster", tmp_path) == "make extras"
