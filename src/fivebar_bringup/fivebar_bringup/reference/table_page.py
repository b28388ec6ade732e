# SPDX-License-Identifier: Apache-2.0
"""The page of the reference that lists the columns of a run's table.

`python -m fivebar_bringup.reference.table_page` prints it, and the documentation site has it.
"""

from __future__ import annotations

from fivebar_bringup.recorded.series import DERIVED
from fivebar_description.run_quantities import TORQUE_OF_NOMINAL, Quantity, quantities

HEAD = """\
# The table of a run

A run is one table: a row per sample, a column per quantity, in SI units, NaN where nothing is known.

```python
import fivebar

run = fivebar.load_run("runs/NAME")
run.to_dataframe()  # pandas and pyarrow: pip install 'fivebar[data]'
run.to_csv("run.csv")  # names in the first row, numbers in full precision
run.to_mat("run.mat")  # MATLAB and Octave: run.t, run.q11, ...; units.t, ...
run.to_parquet("run.parquet")
run.columns()  # numpy arrays by name
```

The torques, sigma and 1/cond(A) stand in the row of the measurement that they answer. A column of which nothing is
known in a run, such as the readings of a sensor that it does not have, is left out.

## What follows from the run

"""

RECORDED = """
## What was recorded

Each value as its message had it, in the row of the sample that the stamp names.

"""


def table_page() -> str:
    """Return the page as Markdown."""
    derived = [_row(quantity.columns, quantity.units, quantity.meaning) for quantity in DERIVED.values()]
    recorded = [
        _row(quantity.columns, quantity.units, quantity.meaning, _source(quantity))
        for quantity in quantities(TORQUE_OF_NOMINAL.topic)
    ]
    return (
        HEAD
        + "\n".join(["| columns | unit | what |", "|---|---|---|", *derived])
        + "\n"
        + RECORDED
        + "\n".join(["| columns | unit | what | topic, field |", "|---|---|---|---|", *recorded])
        + "\n"
    )


def _row(columns: tuple[str, ...], units: tuple[str, ...], *words: str) -> str:
    named = [(name, unit) for name, unit in zip(columns, units, strict=True) if name]
    names = " ".join(f"`{name}`" for name, _ in named)
    shown = ", ".join(dict.fromkeys(unit or "-" for _, unit in named))
    return f"| {names} | {shown} | {' | '.join(words)} |"


def _source(quantity: Quantity) -> str:
    if quantity.name == TORQUE_OF_NOMINAL.name:
        return f"that of the law, such as `{quantity.topic.name}`, {quantity.field}"
    return f"`{quantity.topic.name}`, {quantity.field}"


if __name__ == "__main__":
    print(table_page(), end="")
