# SPDX-License-Identifier: Apache-2.0
"""What MkDocs does not do by itself: formulas as MathML, and pages made of source files, commands and notebooks."""

from __future__ import annotations

import csv
import json
import posixpath
import re
import sys
from html import unescape
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from fivebar_bringup.reference.faults import faults_page
from fivebar_bringup.reference.settings_page import settings_page
from fivebar_bringup.reference.table_page import table_page

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
LINK = re.compile(r"\]\(((?:\.\./)+[^)#\s]+)(#[^)]*)?\)")
NOTEBOOK = re.compile(r"\]\((?!https?:)([^)#\s]+)\.ipynb")
COMMANDS = "reference/commands.md"
SETTINGS = "reference/settings.md"
FAULTS = "reference/faults.md"
RUN_TABLE = "reference/run_table.md"
RESULTS = "results/index.md"
SLIPS = "slips.md"
REDIRECTS = {
    "settings": "reference/settings",
    "unified": "laws#unified",
    "mpc": "laws#mpc",
    "lqr": "laws#lqr",
    "path": "laws#path",
    "choose": "laws",
    "refused": "motions#refused-with-exit-status-2",
    "forces": "motions#forces-that-act-all-the-time",
    "programs": "motions#programs",
    "answers": "faq",
    "glossary": "faq#words",
    "view": "running#replay",
    "mutants": "architecture",
    "transmissions": "identification#belts-and-gears",
    "imu": "estimation#a-gyroscope",
    "vision": "estimation#a-camera",
    "results/thesis": "results/index#what-of-the-thesis-is-reproduced",
    "results/faults": "results/index#how-large-may-each-fault-be",
    "results/crossing": "results/index#what-crossing-buys",
    "results/laws": "results/index#which-law",
    "results/sensors": "results/index#are-faults-of-sensors-noticed",
    "results/rigs": "results/index#success-on-robots-with-errors",
    "results/odds": "results/index#success-odds",
    "results/survived": "results/index#what-does-each-law-survive",
    "results/exact": "results/index#nearly-exact-robots",
    "results/comparison": "results/index#all-laws-on-the-same-motions",
}
"""Where a page is that was published under another name."""

FORMULA = re.compile(r'<(span|div) class="arithmatex">(.*?)</\1>', re.DOTALL)
TYPESETTING = (
    # brackets grow with the matrix that they alone enclose
    (re.compile(r"(<mo>&#x00028;</mo><mtable>.*?</mtable><mo>&#x00029;</mo>)"), r"<mrow>\1</mrow>"),
    # a sign after a bracket, a comma or an equals sign is no difference
    (re.compile(r"(<mo[^>]*>&#x000(?:28|2C|3D);</mo>)<mo>&#x02212;</mo>"), r'\1<mo form="prefix">&#x02212;</mo>'),
    (re.compile(r"(<mi>(?:sin|cos|tan|det|tanh)</mi>)"), r'\1<mspace width="0.17em"/>'),
)
"""What the converter leaves to a browser that does not do it."""

LANGUAGES = {".py": "python", ".yaml": "yaml", ".xml": "xml", ".json": "json", ".toml": "toml", ".rviz": "yaml"}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that are made of other files."""
    linked = set()
    for page in files.documentation_pages():
        folder = posixpath.dirname(page.src_uri)
        for target, _ in LINK.findall(page.content_string):
            if (path := outside(folder, target)) is not None:
                linked.add(path)
    for path in sorted(linked):
        files.append(File.generated(config, page_of(path), content=source_page(path)))
    for notebook in sorted((DOCS / "tutorials").glob("*.ipynb")):
        content = notebook_page(json.loads(notebook.read_text(encoding="utf-8")))
        files.append(File.generated(config, f"tutorials/{notebook.stem}.md", content=content))
    for published, name in REDIRECTS.items():
        files.append(File.generated(config, f"{published}.html", content=redirect(published, name)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let links to files of the repository and to notebooks lead to their pages; complete what is made of the code."""
    if page.file.src_uri == COMMANDS:
        markdown += commands_section()
    if page.file.src_uri == SETTINGS:
        markdown = settings_page()
    if page.file.src_uri == FAULTS:
        markdown = faults_page()
    if page.file.src_uri == RUN_TABLE:
        markdown = table_page()
    if page.file.src_uri == RESULTS:
        markdown = results_page()
    if page.file.src_uri == SLIPS:
        markdown += slips_section()
    markdown = NOTEBOOK.sub(r"](\1.md", markdown)
    folder = posixpath.dirname(page.file.src_uri)

    def replaced(found: re.Match[str]) -> str:
        path = outside(folder, found[1])
        return found[0] if path is None else f"]({posixpath.relpath(page_of(path), folder or '.')})"

    return LINK.sub(replaced, markdown)


def on_page_content(html: str, **_: Any) -> str:
    """Write every formula as MathML, which browsers draw by themselves."""

    def drawn(found: re.Match[str]) -> str:
        formula = unescape(found[2]).strip()
        mathml = convert(formula[2:-2].strip(), display="block" if formula.startswith(r"\[") else "inline")
        for pattern, replacement in TYPESETTING:
            mathml = pattern.sub(replacement, mathml)
        return mathml

    return FORMULA.sub(drawn, html)


def outside(folder: str, target: str) -> Path | None:
    """Return the file or folder of the repository, not of the site, that a link in a folder of docs leads to."""
    path = (DOCS / folder / target).resolve()
    if path.is_relative_to(DOCS):
        return None
    if not path.exists():
        raise PluginError(f"docs/{folder}: link to {target}, which does not exist")
    return path.relative_to(ROOT)


def page_of(path: Path) -> str:
    """Return where the page of a source file or folder is."""
    return f"source/{path.as_posix()}.md"


def source_page(path: Path) -> str:
    """Return a page that shows a file, or lists a folder."""
    full = ROOT / path
    if full.is_dir():
        listed = "\n".join(f"- `{one.name}`" for one in sorted(full.iterdir()) if one.suffix)
        return f"# {path.name}\n\nThe folder `{path}` of the repository:\n\n{listed}\n"
    text = full.read_text(encoding="utf-8")
    if path.suffix == ".md":
        return re.sub(r"\]\((?!https?:)[^)]*\)", "]", text)
    language = LANGUAGES.get(path.suffix, "text")
    return f"# {path.name}\n\nThe file `{path}` of the repository.\n\n````{language}\n{text}````\n"


def redirect(published: str, name: str) -> str:
    """Return a page that leads from a published name to the present one."""
    page, mark, heading = name.partition("#")
    target = posixpath.relpath(f"{page}.html", posixpath.dirname(published) or ".") + mark + heading
    return (
        f'<!doctype html>\n<meta charset="utf-8">\n<title>Moved</title>\n<link rel="canonical" href="{target}">\n'
        f'<meta http-equiv="refresh" content="0; url={target}">\n'
        f'<p>This page is now <a href="{target}">{target}</a>.</p>\n'
    )


def notebook_page(notebook: dict[str, Any]) -> str:
    """Return the cells of a notebook as a page; solutions of exercises are folded."""
    parts = []
    for cell in notebook["cells"]:
        text = "".join(cell["source"])
        shown = text if cell["cell_type"] == "markdown" else f"```python\n{text}\n```"
        if "solution" in cell["metadata"].get("tags", ()):
            shown = f'<details markdown="1">\n<summary>Solution</summary>\n\n{shown}\n\n</details>'
        parts.append(shown)
    return "\n\n".join(parts) + "\n"


def commands_section() -> str:
    """Return every command, its options and its example."""
    import typer

    from fivebar_bringup.cli.main import app

    group = typer.main.get_command(app)
    context = typer.Context(group, info_name="fivebar")
    parts = [""]
    for name in group.list_commands(context):
        command = group.get_command(context, name).help_filled()
        inner = typer.Context(command, info_name=name, parent=context)
        parts.append(f"## fivebar {name}\n\n{command.help}\n\n| argument or option | meaning |\n|---|---|")
        records = [
            parameter.get_help_record(inner) for parameter in command.get_params(inner) if parameter.name != "help"
        ]
        rows = [(one.replace("\\|", "|"), cell(text)) for one, text in filter(None, records)]
        parts.append("\n".join(f"| `{one}` | {text} |" for one, text in rows) + "\n")
    return "\n".join(parts)


def results_page() -> str:
    """Return all results with their tables."""
    sys.path.insert(0, str(DOCS / "studies"))
    from result_pages.catalogue import PAGES, whole_sample
    from result_pages.making import ResultFiles

    return ResultFiles(DOCS / "results", PAGES, whole_sample).whole()


def slips_section() -> str:
    """Return the slips of the thesis as a table."""
    with (DOCS / "slips.csv").open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    lines = (head, ["---"] * len(head), *([*row[:-1], f"`{row[-1]}`"] for row in rows))
    return "\n## All slips\n\n" + "".join(f"| {' | '.join(map(cell, line))} |\n" for line in lines)


def cell(text: str) -> str:
    """Return a help text as an entry of a table, in which a bar would begin another one."""
    return re.sub(r"\\?\|", r"\\|", text)
