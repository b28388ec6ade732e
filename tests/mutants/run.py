# SPDX-License-Identifier: Apache-2.0
"""Changes the core one operator or number at a time and looks whether a unit test notices: `make mutants`.

Each mutant is one small change in the body of one function, made by Cosmic Ray's operators in a copy of the workspace.
The unit tests that `selection.toml` names for its module run until one fails. They run in a fork of a process that has
imported all that does not change, which takes most of the time of a short test run.

Usage: run.py [MODULE ...], a module as `laws/unified` or a folder as `laws`; all of `selection.toml` without any.
`--sample N` tries N mutants that are drawn at random from all of those, `--every N` each N-th of a module.
"""

from __future__ import annotations

import argparse
import ast
import itertools
import json
import multiprocessing
import os
import random
import resource
import shutil
import sys
import tempfile
import time
import tomllib
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import NamedTuple

import numba
import numpy
import pinocchio
import pydantic
import pytest
import ruamel.yaml
import scipy.optimize
import scipy.stats
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import MutationVisitor
from cosmic_ray.plugins import get_operator
from hypothesis import Phase, settings

IMPORTED_ONCE = (numba, numpy, pinocchio, pydantic, ruamel.yaml, scipy.optimize, scipy.stats)

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))

from mutant_selection import unmatched  # noqa: E402

CORE = Path("src/fivebar_control/fivebar_control")
PACKAGES = ("fivebar_description", "fivebar_control", "fivebar_sim", "fivebar_bringup")
RESULTS = ROOT / "runs" / "mutants.txt"

OPERATORS = (
    *(f"ReplaceBinaryOperator_{pair}" for pair in ("Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "Mod_Mul", "Pow_Mul")),
    *(f"ReplaceComparisonOperator_{pair}" for pair in ("Eq_NotEq", "NotEq_Eq", "Is_IsNot", "IsNot_Is")),
    *(f"ReplaceComparisonOperator_{pair}" for pair in ("Lt_LtE", "LtE_Lt", "Gt_GtE", "GtE_Gt")),
    *(f"ReplaceComparisonOperator_{pair}" for pair in ("Lt_Gt", "LtE_GtE", "Gt_Lt", "GtE_LtE")),
    "ReplaceUnaryOperator_Delete_USub",
    "ReplaceUnaryOperator_Delete_Not",
    "ReplaceAndWithOr",
    "ReplaceOrWithAnd",
    "ReplaceTrueWithFalse",
    "ReplaceFalseWithTrue",
    "ReplaceBreakWithContinue",
    "ReplaceContinueWithBreak",
    "AddNot",
    "NumberReplacer",
    "ZeroIterationForLoop",
)
"""Of Cosmic Ray's operators those that do not only exchange one mistake for another."""

CPU_LIMIT = 5.0
"""A mutant that takes so many times as long as the unchanged module, and 10 s, runs for ever: that is noticed, too."""

EXAMPLES = 50
"""Of each property: a quarter of what `make test` tries, since properties take most of the time."""


class Module(NamedTuple):
    """A module, as `laws/unified`, and the arguments of the test run that has to notice its mutants."""

    name: str
    arguments: tuple[str, ...]

    @property
    def path(self) -> Path:
        return CORE / f"{self.name}.py"


class Place(NamedTuple):
    """What one operator can change in a module: its number among all that it can."""

    module: Module
    operator: str
    occurrence: int


class Mutant(NamedTuple):
    """One change: the line, by which operator, the line's text before and after, and the whole text."""

    module: Module
    line: int
    operator: str
    before: str
    after: str
    text: str

    @property
    def place(self) -> str:
        return f"{self.module.name}:{self.line}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("modules", nargs="*", metavar="MODULE", help="such as laws/unified, or a folder: laws")
    parser.add_argument("--jobs", type=int, default=2, help="mutants at a time (default: 2)")
    parser.add_argument(
        "--every", type=int, default=1, metavar="N", help="a sample: only every N-th mutant of a module"
    )
    parser.add_argument("--sample", type=int, metavar="N", help="N mutants at random, each as likely as any other")
    parser.add_argument("--seed", type=int, default=0, help="of that sample; more of the same seed begin alike")
    options = parser.parse_args()
    with open(Path(__file__).with_name("selection.toml"), "rb") as file:
        selection = tomllib.load(file)
    least = selection["run"]["least"]
    if wrong := unmatched(selection):
        print(f"selection.toml: expected the unit tests of every module and no others: {', '.join(wrong)}")
        return 2
    modules = chosen(selection, options.modules)
    judged: list[tuple[Mutant, bool]] = []
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        workspace = copied(ROOT, Path(folder) / "unchanged")
        places = [place for module in modules for place in list(places_of(workspace, module))[:: options.every]]
        if options.sample is not None:
            random.Random(options.seed).shuffle(places)
        made = (mutant for place in places if (mutant := mutant_of(workspace, place)) is not None)
        mutants = list(itertools.islice(made, options.sample))
        drawn = "" if options.sample is None else f" of {len(places)}, drawn with seed {options.seed}"
        print(f"{len(mutants)} mutants{drawn}, in {len(modules)} modules", flush=True)
        limits = {}
        for module in dict.fromkeys(mutant.module for mutant in mutants):
            code, seconds = tested(workspace, module, CPU_LIMIT * 1e3, measured=True)
            if code != 0:
                print(f"{module.name}: its tests fail without any change: pytest {' '.join(module.arguments)}")
                return 2
            limits[module] = 10.0 + CPU_LIMIT * seconds
        print("their tests pass on the unchanged modules", flush=True)
        with multiprocessing.get_context("fork").Pool(options.jobs, begin, (workspace, limits)) as pool:
            for number, (mutant, noticed) in enumerate(pool.imap(judge, mutants), start=1):
                judged.append((mutant, noticed))
                keep(judged)
                if options.sample is None:
                    found = [pair for pair in judged if pair[0].module == mutant.module]
                    if number == len(mutants) or mutants[number].module != mutant.module:
                        print(row(mutant.module.name, found), flush=True)
                elif not noticed or number % 25 == 0:
                    missed = "" if noticed else f", not {mutant.place}"
                    print(row(f"the first {number}", judged) + missed, flush=True)
    if options.sample is not None:
        for module in modules:
            if found := [pair for pair in judged if pair[0].module == module]:
                print(row(module.name, found))
        print(f"95 % interval of the share of all mutants (Clopper and Pearson): {interval(judged)}")
    print(row("all", judged))
    print(f"those not noticed: {RESULTS.relative_to(ROOT)}")
    return 0 if sum(noticed for _, noticed in judged) >= least * len(judged) else 1


def interval(judged: list[tuple[Mutant, bool]]) -> str:
    """Return in per cent between what the share of noticed mutants is, where these were drawn at random."""
    found = scipy.stats.binomtest(sum(noticed for _, noticed in judged), len(judged)).proportion_ci(0.95, "exact")
    return f"{100.0 * found.low:.1f} to {100.0 * found.high:.1f} %"


def row(name: str, judged: list[tuple[Mutant, bool]]) -> str:
    """Return how many mutants were noticed, in words and per cent."""
    noticed = sum(noticed for _, noticed in judged)
    return f"{name:28}{noticed:5} of {len(judged):5} noticed, {100.0 * noticed / max(len(judged), 1):5.1f} %"


def keep(judged: list[tuple[Mutant, bool]]) -> None:
    """Write down the mutants that were not noticed, with the line before and after."""
    RESULTS.parent.mkdir(exist_ok=True)
    with open(RESULTS, "w", encoding="utf-8") as file:
        for mutant in sorted(mutant for mutant, noticed in judged if not noticed):
            print(f"{mutant.module.path}:{mutant.line}: {mutant.operator}", file=file)
            print(f"    - {mutant.before}\n    + {mutant.after}", file=file)


def chosen(selection: dict[str, dict[str, list[str]]], names: list[str]) -> list[Module]:
    """Return the modules of the selection that are asked for, all without a name."""
    without = " or ".join(selection["run"]["without"])
    found = [
        Module(f"{folder}/{name}", (*(f"tests/unit/{file}" for file in files), "-k", f"not ({without})"))
        for folder, section in selection.items()
        if folder not in ("run", "excluded")
        for name, files in section.items()
    ]
    known = {module.name for module in found} | {module.name.split("/")[0] for module in found}
    for name in names:
        if name not in known:
            raise SystemExit(f"{name}: expected one of {', '.join(sorted(known))}")
    return [module for module in found if not names or {module.name, module.name.split("/")[0]} & set(names)]


def copied(original: Path, workspace: Path) -> Path:
    """Copy what the tests need of a workspace into a new folder and return that."""
    for folder in ("src", "tests"):
        shutil.copytree(original / folder, workspace / folder, ignore=shutil.ignore_patterns("*.egg-info"))
    shutil.copy2(original / "pyproject.toml", workspace)
    return workspace


def places_of(workspace: Path, module: Module) -> Iterator[Place]:
    """Return what can be changed in the functions of a module. What is outside of them is settings."""
    source = (workspace / module.path).read_text(encoding="utf-8")
    bodies = [
        range(node.body[0].lineno, (node.end_lineno or 0) + 1)
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.FunctionDef)
    ]
    nodes = list(ast_nodes(get_ast(source)))
    for name in OPERATORS:
        operator = get_operator(f"core/{name}")()
        positions = [position for node in nodes for position in operator.mutation_positions(node)]
        for occurrence, ((line, _), _) in enumerate(positions):
            if any(line in body for body in bodies):
                yield Place(module, name, occurrence)


def mutant_of(workspace: Path, place: Place) -> Mutant | None:
    """Return the mutant of a place, None where that does not compile."""
    source = (workspace / place.module.path).read_text(encoding="utf-8")
    text = MutationVisitor.mutate_code(source, get_operator(f"core/{place.operator}")(), place.occurrence)
    if text is None or text == source:
        return None
    try:
        compile(text, place.module.name, "exec")
    except SyntaxError:
        return None
    lines, changed = source.splitlines(), text.splitlines()
    at = next(number for number, pair in enumerate(zip(lines, changed, strict=False)) if pair[0] != pair[1])
    return Mutant(place.module, at + 1, place.operator, lines[at].strip(), changed[at].strip(), text)


_workspace = Path()
"""Of this process of the pool."""
_limits: dict[Module, float] = {}
"""CPU time (s) after which a mutant of a module is stopped."""


def begin(unchanged: Path, limits: dict[Module, float]) -> None:
    global _workspace, _limits
    _limits = limits
    _workspace = copied(unchanged, unchanged.with_name(str(os.getpid())))


def judge(mutant: Mutant) -> tuple[Mutant, bool]:
    """Return a mutant and whether its tests fail."""
    path = _workspace / mutant.module.path
    unchanged = path.read_text(encoding="utf-8")
    path.write_text(mutant.text, encoding="utf-8")
    try:
        code, _ = tested(_workspace, mutant.module, _limits[mutant.module])
    finally:
        path.write_text(unchanged, encoding="utf-8")
    # 1 is a test that fails; 2 and 4 are a module or a conftest that cannot be imported
    if code >= 0 and code not in (0, 1, 2, 4):
        raise RuntimeError(f"{mutant.place}: pytest ended with {code}")
    return mutant, code != 0


class Quick:
    """A plugin of pytest's: a test that fails is to be found soon.

    Whether a property fails is all that counts, not the simplest example that it fails for. The tests that took least
    time on the unchanged module come first.
    """

    def __init__(self, times: Path, measured: bool) -> None:
        self._path, self._measured = times, measured
        self._times: dict[str, float] = {}

    def pytest_collection(self) -> None:
        quick = {"phases": (Phase.explicit, Phase.generate), "max_examples": EXAMPLES}
        settings.register_profile("mutants", settings.default, **quick)
        settings.load_profile("mutants")

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        if not self._measured:
            times = json.loads(self._path.read_text(encoding="utf-8"))
            items.sort(key=lambda item: times[item.nodeid])

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        start = time.process_time()
        try:
            return (yield)
        finally:
            self._times[item.nodeid] = time.process_time() - start

    def pytest_sessionfinish(self) -> None:
        if self._measured:
            self._path.write_text(json.dumps(self._times), encoding="utf-8")


def tested(workspace: Path, module: Module, limit: float, measured: bool = False) -> tuple[int, float]:
    """Return pytest's exit code for a module's tests, negative where it was stopped, and the CPU time (s) it took.

    The time of each test is `measured` once, on the unchanged module.
    """
    times = workspace.with_name(f"{module.name.replace('/', '.')}.json")
    child = os.fork()
    if child == 0:
        code = 70
        try:
            resource.setrlimit(resource.RLIMIT_CPU, (int(limit) + 1, int(limit) + 2))
            quiet = os.open(os.devnull, os.O_WRONLY)
            os.dup2(quiet, 1)
            os.dup2(quiet, 2)
            os.chdir(workspace)
            # only what does not change is kept compiled: a changed file may be as long and as new as the one before it
            sys.dont_write_bytecode = workspace == _workspace
            os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"
            sys.path[:0] = [str(workspace / "src" / package) for package in PACKAGES]
            options = ("-x", "-q", "-p", "no:cacheprovider", "--rootdir", str(workspace))
            code = int(pytest.main([*options, *module.arguments], [Quick(times, measured)]))
        finally:
            os._exit(code)
    _, status, usage = os.wait4(child, 0)
    return os.waitstatus_to_exitcode(status), usage.ru_utime + usage.ru_stime


if __name__ == "__main__":
    sys.exit(main())
