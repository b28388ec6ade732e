# SPDX-License-Identifier: Apache-2.0
"""A run's table as a file for other programs: CSV, MATLAB and Parquet."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.extras import library
from fivebar_bringup.recorded.results import write_results
from fivebar_bringup.recorded.series import UNITS

Columns = Mapping[str, FloatArray]
"""Columns by name, [n] each."""


def data_frame(columns: Columns) -> Any:
    """Return columns as a `pandas.DataFrame`, whose `attrs["units"]` has their units.

    Raises:
        InputError: pandas is not installed.
    """
    frame = library("pandas").DataFrame(dict(columns))
    frame.attrs["units"] = _units(columns)
    return frame


def write_csv(columns: Columns, path: Path) -> None:
    """Write columns as CSV: a row of names, then a row per sample; numbers in full precision, nothing for NaN.

    Raises:
        InputError: the file cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in np.column_stack(list(columns.values())).tolist():
        writer.writerow(["" if value != value else repr(value) for value in row])
    _write(path, text.getvalue().encode())


def write_mat(columns: Columns, path: Path) -> None:
    """Write columns for MATLAB and Octave: a structure `run` of column vectors, and `units` with their units.

    Raises:
        InputError: the file cannot be written.
    """
    # here, because it takes longer to load than all the rest
    from scipy.io import savemat

    content = io.BytesIO()
    savemat(content, {"run": dict(columns), "units": _units(columns)}, oned_as="column", long_field_names=True)
    _write(path, content.getvalue())


def write_parquet(columns: Columns, path: Path) -> None:
    """Write columns as Parquet, with their units in the metadata of each.

    Raises:
        InputError: pyarrow is not installed, or the file cannot be written.
    """
    arrow, parquet = library("pyarrow"), library("pyarrow.parquet")
    fields = [arrow.field(name, arrow.float64(), metadata={"unit": UNITS[name]}) for name in columns]
    content = io.BytesIO()
    parquet.write_table(arrow.table(list(columns.values()), schema=arrow.schema(fields)), content)
    _write(path, content.getvalue())


def _units(columns: Columns) -> dict[str, str]:
    return {name: UNITS[name] for name in columns}


def _write(path: Path, content: bytes) -> None:
    write_results(path.parent, {path.name: content})
