"""What is released: versions that agree, a citation, workflows and images that name what exists."""

from __future__ import annotations

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml
from pydantic import TypeAdapter

import fivebar
from fivebar_bringup.report.summary_schema import summary_schema

ROOT = Path(__file__).parents[2]
MANIFESTS = sorted(ROOT.glob("src/*/package.xml"))
WORKFLOWS = sorted(ROOT.glob(".github/workflows/*.yml"))
IMAGES = sorted(ROOT.glob("docker/Dockerfile*"))
SCHEMA = ROOT / "docs" / "reference" / "summary.schema.json"
PIP_LINE = re.compile(r"pip install .*?('pydantic.*)$", re.MULTILINE)


def test_all_packages_and_the_citation_have_one_version() -> None:
    versions = {ElementTree.parse(path).findtext("version") for path in MANIFESTS}
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert versions == {citation["version"]}
    assert {"cff-version", "title", "message", "authors"} <= citation.keys()
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## [{citation['version']}] - {citation['date-released']}\n" in changes


def pins(name: str) -> set[str]:
    lines = re.findall(r"^([^\s#]+==[^\s;]+)", (ROOT / name).read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[._]", "-", pin.partition("==")[0]).lower() + "==" + pin.partition("==")[2] for pin in lines}


def test_the_digests_are_those_of_the_locked_packages() -> None:
    assert pins("requirements.hashed.lock") == pins("requirements.lock"), "stale: make hashes"


def targets() -> set[str]:
    return set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_a_workflow_runs_what_there_is(path: Path) -> None:
    workflow = yaml.safe_load(path.read_text(encoding="utf-8"))
    # to YAML 1.1 the key `on` is a truth value
    assert {"name", True, "jobs", "permissions"} <= workflow.keys()
    for job in workflow["jobs"].values():
        assert set(job.get("needs", []) if isinstance(job.get("needs"), list) else {job.get("needs")} - {None}) <= set(
            workflow["jobs"]
        )
        for step in job["steps"]:
            assert ("run" in step) is not ("uses" in step)
            assert set(re.findall(r"\bmake ([a-z-]+)", step.get("run", ""))) <= targets()
            assert all((ROOT / file).is_file() for file in re.findall(r"-f (\S+)", step.get("run", "")))


def test_every_list_of_what_comes_from_pip_is_that_of_the_page() -> None:
    texts = [
        path.read_text("utf-8").replace("\\\n   ", "") for path in (ROOT / "docs/get_started.md", *WORKFLOWS, *IMAGES)
    ]
    lists = [found for text in texts for found in PIP_LINE.findall(text)]
    assert len(lists) == 3
    assert len(set(lists)) == 1


@pytest.mark.parametrize("path", IMAGES, ids=lambda path: path.name)
def test_an_image_copies_what_there_is(path: Path) -> None:
    copied = re.findall(r"^COPY (?!--from)(.+) \S+$", path.read_text(encoding="utf-8"), re.MULTILINE)
    admitted = {line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")}
    files = {file for line in copied for file in line.split()}
    assert files <= admitted
    assert all((ROOT / file).exists() for file in files)


def test_the_development_container_is_described() -> None:
    content = json.loads((ROOT / ".devcontainer" / "devcontainer.json").read_text(encoding="utf-8"))
    assert content["postCreateCommand"].removeprefix("make ") in targets()


def test_the_schema_of_a_summary_is_the_published_one() -> None:
    stale = "stale: .venv/bin/python -m fivebar_bringup.report.summary_schema > docs/reference/summary.schema.json"
    assert SCHEMA.read_text(encoding="utf-8") == summary_schema(), stale


def test_a_summary_fits_its_schema() -> None:
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    content = fivebar.simulate(fivebar.plan("dextar", goal=(0.0, 0.02))).summary.as_json()
    assert set(content) == set(schema["required"]) == set(schema["properties"])
    TypeAdapter(fivebar.Summary).validate_json(json.dumps(content), strict=True)
