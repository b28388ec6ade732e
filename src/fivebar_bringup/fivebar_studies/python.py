# SPDX-License-Identifier: Apache-2.0
"""Studies: thousands of simulated crossings, as tables."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from fivebar_bringup.extras import library
from fivebar_description.errors import InputError
from fivebar_studies.engine.executor import Executor, LocalProcesses
from fivebar_studies.engine.running import further_rows, run_study, silent


def sweep(
    cases: int | None = None,
    seed: int | None = None,
    controllers: Sequence[str] | None = None,
    rig: str | None = None,
    robot: str | None = None,
    out: str | Path | None = None,
    executor: Any = None,
) -> Any:
    """Simulate random crossings, as `fivebar sweep` does, and return their rows as a `pandas.DataFrame`.

    [Random crossings](../sweeps.md) says what is drawn. `attrs["descriptions"]` of the table says what each column is.
    The rows depend on neither executor nor interruptions.

    Args:
        cases: crossings that the screen judges feasible for `unified`, or else for the first controller, after which it
            ends; by default 2000.
        seed: of all cases, by default 1.
        controllers: that make each crossing, laws of your own as `"my_package.my_law:LAW"`; by default all that are
            compiled.
        rig: whose robots are drawn, by default none.
        robot: a shipped robot or a robot file in place of a rig, by default DexTAR; robots are drawn as its file
            declares.
        out: new or empty directory for rows, results and page, or that of a sweep to resume; by default nothing is
            kept but the result.
        executor: number of processes to use, or a `distributed.Client` of a Dask cluster; by default this process.
            A script that uses processes needs `if __name__ == "__main__":`.

    Raises:
        InputError: a setting or the directory cannot be used, the cluster has gone, or pandas is not installed
            (`pip install 'fivebar[data]'`).

    Examples:
        >>> import fivebar
        >>> table = fivebar.sweep(cases=1, rig="ideal", controllers=["unified"])
        >>> bool(table[table.status == "feasible"].success.all())
        True
    """
    # here, because it loads what all laws need
    from fivebar_studies.rigs.declared import robots_drawn
    from fivebar_studies.sweep.sweep import SWEEP

    arguments = {
        "cases": cases,
        "seed": seed,
        "controllers": None if controllers is None else tuple(controllers),
        "rig": rig,
        **({} if robot is None else robots_drawn(robot)),
    }
    with _executor(executor) as chosen:
        if out is not None:
            rows = run_study(SWEEP, arguments, Path(out), chosen).rows
        else:
            chunks = further_rows(SWEEP, SWEEP.settings_with(arguments), [], chosen, silent)
            rows = [row for chunk in chunks for row in chunk]
    return SWEEP.table.frame(rows)


def _executor(executor: Any) -> AbstractContextManager[Executor]:
    if executor is None or isinstance(executor, int):
        return LocalProcesses(executor or 1)
    # here, because Dask is an extra
    from fivebar_studies.engine.cluster import cluster_of

    if not isinstance(executor, library("distributed", "cluster").Client):
        raise InputError(f"executor: {executor!r}: expected a number of processes or a distributed.Client")
    # by a client of its own, which decodes no pickled objects
    return cluster_of(executor.scheduler.address, security=executor.security)
