# SPDX-License-Identifier: Apache-2.0
"""Makes the page of results in the documentation again, whole in some hours.

Every section is a question, a figure, a table and limits, and has its data as CSV. An interrupted script resumes when
it is started again. With --quick, rows of a larger sample that are in --out are left as they are.

`python docs/studies/make_result_pages.py --quick`
`python docs/studies/make_result_pages.py --only sweep,robustness --out docs/results`
`python docs/studies/make_result_pages.py --check --out docs/results`
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from fivebar_bringup.cli.printing import complain
from fivebar_bringup.cli.progress import progress_bar
from fivebar_description.errors import InputError
from fivebar_description.modules import load_part
from fivebar_studies.cli.study_options import chosen
from fivebar_studies.engine.executor import LocalProcesses
from result_pages.catalogue import PAGES, RUNS, whole_sample
from result_pages.making import ResultFiles, make_results
from result_pages.page import StudyRun


def main() -> None:
    """Make what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small samples, in some ten minutes")
    parser.add_argument("--only", help="some of the runs, separated by commas, by name or by study")
    parser.add_argument("--draw", action="store_true", help="run nothing: draw page and figures again from their data")
    parser.add_argument(
        "--check",
        action="store_true",
        help="exit with 1 if a run would come out otherwise now; of those that other code made, some cases are run",
    )
    parser.add_argument("--out", type=Path, default=Path("runs/results/pages"), help="where page and data are")
    parser.add_argument("--studies", type=Path, default=Path("runs/results"), help="where each study has its rows")
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)), help="processes")
    given = parser.parse_args()
    of_study = {name: load_part(run.study).name for name, run in RUNS.items()}
    known = (*RUNS, *dict.fromkeys(of_study.values()))
    wanted = {*RUNS} if given.only is None else {*chosen("--only", given.only, known)}
    runs = [run for name, run in RUNS.items() if not wanted.isdisjoint((name, of_study[name]))]
    files = ResultFiles(given.out, PAGES, whole_sample)
    if given.draw:
        print_paths(files.write(PAGES))
        return
    with LocalProcesses(given.jobs) as executor:
        if given.check:
            sys.exit(check(files, runs, executor))
        print_paths(make_results(files, runs, given.studies, given.quick, executor, progress_bar, complain))


def check(files: ResultFiles, runs: Sequence[StudyRun], executor: LocalProcesses) -> int:
    """Print which runs would come out otherwise now, and return the exit status."""
    outdated = 0
    for run in runs:
        with progress_bar(run.name) as told:
            reason = files.outdated(run, executor, told)
        if reason:
            outdated += 1
            print(f"{run.name}: {reason}", flush=True)
    if not outdated:
        print("all rows are those that the present code makes")
    return min(1, outdated)


def print_paths(written: Iterable[Path]) -> None:
    """Print what to look at."""
    print("\n".join(f"look at {path}" for path in written))


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        complain(str(error))
        sys.exit(2)
