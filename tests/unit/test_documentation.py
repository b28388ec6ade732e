# SPDX-License-Identifier: Apache-2.0
"""The pages: every command in them exists with its options, and the tutorials print what they say."""

from __future__ import annotations

import ast
import contextlib
import doctest
import io
import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer
from doc_blocks import blocks

from fivebar_bringup.cli.main import app
from fivebar_description.scenario_file import shipped_scenarios

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
TUTORIALS = sorted((DOCS / "tutorials").glob("*.md"))
NOTEBOOKS = sorted((DOCS / "tutorials").glob("*.ipynb"))
PLACEHOLDER = re.compile(r"\b(SCENARIO|BAG|NAME|DIR|FILE|[XY])\b|\.\.\.|…")
"""What stands for a value in a command that only shows its form."""


def commands(page: Path) -> list[list[str]]:
    """Return the words after `fivebar` of every command in the shell blocks of a page."""
    found = []
    for block in blocks(page):
        if block.language == "sh":
            for line in block.text.replace("\\\n", " ").splitlines():
                words = shlex.split(line.removeprefix("ros2 run fivebar_bringup "), comments=True)
                if words and words[0].rpartition("/")[2] == "fivebar":
                    found.append(words[1:])
    return found


def problem_of(group: Any, words: list[str]) -> str | None:
    """What is wrong with the words of a command: an option that it has not, or a scenario that is not shipped."""
    words = words[: words.index(">")] if ">" in words else words
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            name, command, rest = group.resolve_command(typer.Context(group), words)
            scenario = command.make_context(name, rest).params.get("scenario")
    except typer.Exit:
        return None
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    known = not scenario or scenario.endswith(".yaml") or scenario in shipped_scenarios()
    return None if known else f"unknown scenario {scenario}"


def test_every_command_is_one_with_its_options() -> None:
    group: Any = typer.main.get_command(app)
    written = [
        (str(page.relative_to(ROOT)), words)
        for page in PAGES
        for words in commands(page)
        if not any(PLACEHOLDER.search(word) for word in words)
    ]
    assert len(written) > 90
    assert not [(page, words, problem) for page, words in written if (problem := problem_of(group, words))]


def test_every_script_is_one_of_a_page_with_its_options() -> None:
    """Each study has its command in a page, with options that it has, and in its own words; others are of no use."""
    paths = (path for folder in (DOCS / "studies", ROOT / "bench") for path in folder.glob("*.py"))
    scripts = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in paths}
    written = [
        (page.name, *found)
        for page in PAGES
        for found in re.findall(r"python ((?:docs|bench)/[\w/]+\.py)([^`\n]*)", page.read_text(encoding="utf-8"))
    ]
    named = {script for _, script, _ in written}
    # what has no `main` is imported by others
    studies = {name for name, text in scripts.items() if name.startswith("docs/") and "def main(" in text}
    assert not named - set(scripts)
    assert len(studies) > 15 and not studies - named
    assert not [name for name in studies if "sys.argv[" in scripts[name]], "expected argparse, which knows --help"
    options = [(page, script, option) for page, script, rest in written for option in re.findall(r"--[\w-]+", rest)]
    assert len(options) > 3
    assert not [(page, script, one) for page, script, one in options if f'"{one}"' not in scripts[script]]
    assert not [name for name in studies if f"python {name}" not in scripts[name].split('"""')[1]]


def test_every_page_has_its_place_on_the_site() -> None:
    configuration = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    placed = set(re.findall(r"^ +- .*?: (\S+\.md)$", configuration, re.MULTILINE))
    made = {f"tutorials/{path.stem}.md" for path in NOTEBOOKS}
    assert placed - made == {page.relative_to(DOCS).as_posix() for page in PAGES[1:]}


def test_links_of_the_pages_lead_somewhere_in_a_clone() -> None:
    links = [
        (page, target)
        for page in {*PAGES, *ROOT.glob("*.md"), *(ROOT / "src").rglob("*.md"), *(ROOT / "tests").rglob("*.md")}
        for target in re.findall(r"\]\(([^)\s#]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
        if not re.match(r"[a-z]+:", target)
    ]
    assert len(links) > 300
    assert not [(page, target) for page, target in links if not (page.parent / target).exists()]


def output_of(words: list[str]) -> str:
    """Return what a command prints, run in this process."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), pytest.raises(SystemExit):
        app(words, prog_name="fivebar")
    return printed.getvalue()


@pytest.mark.extra
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_prints_what_it_says(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    names: dict[str, object] = {}
    printed = ""
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    for block in blocks(page):
        if block.file:
            Path(block.file).write_text(block.text, encoding="utf-8")
        elif block.language == "sh":
            assert all(line.startswith("fivebar ") for line in block.text.splitlines())
            printed = "".join(output_of(shlex.split(line)[1:]) for line in block.text.splitlines())
        elif block.language == "python":
            with contextlib.redirect_stdout(io.StringIO()) as caught:
                exec(compile(block.text, page.name, "exec"), names)
            printed = caught.getvalue()
        elif block.language == "text":
            assert doctest.OutputChecker().check_output(block.text, printed, flags), f"{block.text}\nis not\n{printed}"


@pytest.mark.extra
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_in_jupyter(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    manager = pytest.importorskip("jupyter_client.manager").KernelManager
    # the kernel of this environment, which is registered nowhere
    manager.kernel_cmd = [sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    notebook = nbformat.read(path, as_version=4)
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    pictures, said = NOTEBOOK_SHOWS[path.stem]
    assert sum("image/png" in output.get("data", {}) for output in outputs) == pictures
    assert said in "".join(output.get("text", "") for output in outputs)


NOTEBOOK_SHOWS = {
    "read_a_bag": (2, "sensor_msgs/msg/JointState"),
    "sweep_a_gain": (1, "as in the table: True"),
    "lecture": (2, "lecture_law:LAW  succeeded, at most 0.21 mm"),
}
"""Pictures of each notebook, and what it prints among others."""


def test_every_exercise_of_the_lecture_has_a_hidden_solution() -> None:
    notebook = json.loads((DOCS / "tutorials" / "lecture.ipynb").read_text(encoding="utf-8"))
    exercises = [cell for cell in notebook["cells"] if any("**Exercise " in line for line in cell["source"])]
    solutions = [cell["metadata"] for cell in notebook["cells"] if "solution" in cell["metadata"].get("tags", ())]
    assert len(exercises) == len(solutions) == 7
    assert all(metadata["jupyter"]["source_hidden"] for metadata in solutions)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_kept_without_its_outputs(path: Path) -> None:
    notebook = json.loads(path.read_text(encoding="utf-8"))
    assert not any(cell.get("outputs") for cell in notebook["cells"])


@pytest.mark.extra
def test_the_site_builds_and_loads_nothing_from_elsewhere(tmp_path: Path) -> None:
    pytest.importorskip("mkdocs")
    built = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", tmp_path],
        cwd=ROOT, capture_output=True, text=True, check=False, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
    )  # fmt: skip
    assert (built.returncode, built.stderr) == (0, "")
    pages = [page.read_text(encoding="utf-8") for page in tmp_path.rglob("*.html")]
    assert len(pages) > 30
    loaded = re.compile(r'<(?:script|link|img|iframe)[^>]*(?:src|href)="(?:https?:)?//')
    assert not [page[:200] for page in pages if loaded.search(page)]
    theory = (tmp_path / "theory.html").read_text(encoding="utf-8")
    assert theory.count("<math ") > 100
    assert "arithmatex" not in theory


HISTORY = re.compile(
    r"(?<!is )(?<!are )(?<!be )\bused to\b|\bno longer\b(?! than)|\bof (then|now|before|today|that day)\b"
    r"|\bas before\b|\bformerly\b|\bpreviously\b"
    r"|\bsince then\b|\bearlier (version|seed)|\b(in|until|since) version\b|(?<!--)\bseeds? \d"
    r"|\b(January|February|March|April|May|June|July|August|September|October|November|December) 20\d\d\b"
    r"|\b20\d\d-\d\d-\d\d\b"
)
MOST_WORDS = 35


def sentences(page: Path) -> list[str]:
    """Return the sentences of a page, without code, tables and headings; a formula counts as one word."""
    text = re.sub(r"^ *```.*?^ *```$", "\n", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"\$[^$]+\$", "formula", re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text))
    text = re.sub(r"^ *(\||#|<|---).*$", "\n", text, flags=re.MULTILINE)
    parts = re.split(r"\n\s*\n|\n(?= *(?:[-*]|\d+\.) )", text)
    end = re.compile(r"(?<=[.!?])[*)]*\s+(?=[A-Z`*\[(])")
    return [one for part in parts for one in end.split(" ".join(part.split())) if one]


def test_pages_are_read_without_effort() -> None:
    """No history, and no sentence that has to be read twice for length or beginning."""
    found = []
    for page in PAGES:
        name = page.name if page.parent == ROOT else page.relative_to(DOCS).as_posix()
        text = page.read_text(encoding="utf-8")
        found += [f"{name}: history: {text[one.start() - 30 : one.end() + 30]!r}" for one in HISTORY.finditer(text)]
        for one in sentences(page):
            if len(one.split()) > MOST_WORDS:
                found.append(f"{name}: {len(one.split())} words: {one}")
            if re.match(r"[-*0-9. ]*(Of|What|Whose|By which|Those that)\b", one) and not one.endswith("?"):
                found.append(f"{name}: begins so that it has to be read twice: {one}")
    assert not found, "\n".join(found)


def docstrings(path: Path) -> list[tuple[int, str]]:
    """Return the docstrings of a module, of what it defines, and under its constants, with their lines."""
    return [
        (node.lineno, node.value.value)
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    ]


def test_docstrings_begin_with_what_a_thing_is_or_does() -> None:
    riddle = re.compile(r"(Of|What|Whatever|Whose|Which|That|Those|By)\b")
    paths = sorted(path for folder in (ROOT / "src", DOCS / "studies", ROOT / "bench") for path in folder.rglob("*.py"))
    found = [(path, line, text) for path in paths for line, text in docstrings(path)]
    assert len(found) > 4000
    assert not [f"{path.name}:{line}: {text[:60]}" for path, line, text in found if riddle.match(text)]
