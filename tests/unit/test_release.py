# SPDX-License-Identifier: Apache-2.0
"""What is released: versions that agree, a citation, workflows and images that name what exists."""

from __future__ import annotations

import ast
import importlib
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml
from pydantic import TypeAdapter

import fivebar
from fivebar_bringup.reference.summary_schema import summary_schema

ROOT = Path(__file__).parents[2]
MANIFESTS = sorted(ROOT.glob("src/*/package.xml"))
WORKFLOWS = sorted(ROOT.glob(".github/workflows/*.yml"))
IMAGES = sorted(ROOT.glob("docker/Dockerfile*"))
SCHEMA = ROOT / "docs" / "reference" / "summary.schema.json"
ACTION = re.compile(r"[\w-]+/[\w-]+@[0-9a-f]{40}")
DISTRIBUTIONS = {
    "PIL": "pillow",
    "can": "python-can",
    "cv2": "opencv-python-headless",
    "motkin_pcb": "motkin-pcb",
    "mujoco": "mujoco-core",
    "pinocchio": "pin",
    "ruamel": "ruamel.yaml",
    "yaml": "pyyaml",
    "annotated_types": "annotated-types",
}
"""The distribution of a module, where their names differ."""

sys.path.append(str(ROOT / "packaging"))
requirements = importlib.import_module("requirements")
check_environment = importlib.import_module("check_environment")
spdx = importlib.import_module("spdx")


def test_all_packages_and_the_citation_have_one_version() -> None:
    versions = {ElementTree.parse(path).findtext("version") for path in MANIFESTS}
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert versions == {citation["version"]}
    assert {"cff-version", "title", "message", "authors"} <= citation.keys()
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## [{citation['version']}] - {citation['date-released']}\n" in changes


def make(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["make", *words], cwd=folder, capture_output=True, text=True, check=False)


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    for path in (ROOT / "Makefile", ROOT / "CITATION.cff", ROOT / "CHANGELOG.md", *MANIFESTS):
        copy = tmp_path / path.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, copy)
    return tmp_path


def test_nothing_is_published_with_an_address_that_is_a_placeholder(copied: Path) -> None:
    refused = make(copied, "publishable")
    assert refused.returncode == 2
    assert refused.stderr.count("@example.org") == refused.stderr.count("//example.org") == len(MANIFESTS)
    for path in MANIFESTS:
        copy = copied / path.relative_to(ROOT)
        copy.write_text(copy.read_text(encoding="utf-8").replace("example.org", "fivebar.dev"), encoding="utf-8")
    assert make(copied, "publishable").returncode == 0


def test_the_release_workflow_publishes_nothing_that_is_not_publishable() -> None:
    steps = yaml.safe_load((ROOT / ".github" / "workflows" / "release.yml").read_text(encoding="utf-8"))["jobs"]
    commands = [step.get("run", "") for step in steps["wheels"]["steps"]]
    assert commands.index("make publishable") < commands.index("make dist")
    assert "wheels" in steps["publish"]["needs"]


def test_a_version_is_set_everywhere_and_dated_in_the_changelog(copied: Path) -> None:
    assert make(copied, "version", "NEW=9.8.7").returncode == 0
    versions = {ElementTree.parse(copied / path.relative_to(ROOT)).findtext("version") for path in MANIFESTS}
    citation = yaml.safe_load((copied / "CITATION.cff").read_text(encoding="utf-8"))
    assert versions == {citation["version"]} == {"9.8.7"}
    changes = (copied / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## [Unreleased]\n\n## [9.8.7] - {citation['date-released']}\n" in changes
    assert make(copied, "version", "NEW=2").returncode == 2


@pytest.mark.parametrize(
    ("text", "licensed"),
    [
        ('"""Doc."""\n', '# SPDX-{}\n"""Doc."""\n'),
        ("#!/bin/sh\nset -e\n", "#!/bin/sh\n# SPDX-{}\nset -e\n"),
        ("", "# SPDX-{}\n"),
        ("# SPDX-{}\nx = 1\n# SPDX-{}\n", "# SPDX-{}\nx = 1\n"),
    ],
)
def test_a_source_file_gets_its_licence_once(text: str, licensed: str) -> None:
    tag = "License-Identifier: Apache-2.0"
    text, licensed = text.replace("{}", tag), licensed.replace("{}", tag)
    assert spdx.with_license(text, "#") == licensed
    assert spdx.with_license(licensed, "#") == licensed


def pins(name: str) -> set[str]:
    lines = re.findall(r"^([^\s#]+==[^\s;]+)", (ROOT / name).read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[._]", "-", pin.partition("==")[0]).lower() + "==" + pin.partition("==")[2] for pin in lines}


def test_the_digests_are_those_of_the_locked_packages() -> None:
    assert pins("requirements.hashed.lock") == pins("requirements.lock"), "stale: make hashes"
    assert pins("packaging/runtime.lock") <= pins("requirements.lock")


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


def asked_by(package: Path) -> list[str]:
    """Return what setup.py asks for."""
    tree = ast.parse((package / "setup.py").read_text(encoding="utf-8"))
    (value,) = (
        node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "NEEDED"
    )
    return list(ast.literal_eval(value))


def imported_by(package: Path) -> set[str]:
    """Return the modules, by their first names, that the code of a package imports."""
    found = set()
    for path in package.glob("fivebar*/**/*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                found.add(node.module.partition(".")[0])
    return found


def lowest_versions(section: str) -> dict[str, str]:
    """Return the lowest version of each requirement that does not depend on the version of Python."""
    asked = [one for one in requirements.section(section) if ";" not in one]
    return {requirements.name_of(one): requirements.lowest_of(one) for one in asked}


def test_manifest_setup_and_requirements_ask_for_the_same() -> None:
    runtime, tests = lowest_versions("runtime"), lowest_versions("tests")
    keys = {key: name for name, key in requirements.ROSDEP_KEYS.items()}
    used = set()
    for manifest in MANIFESTS:
        package = manifest.parent
        asked = asked_by(package)
        names = {requirements.name_of(one) for one in asked}
        assert set(asked) == {one for one in requirements.section("runtime") if requirements.name_of(one) in names}
        imported = {DISTRIBUTIONS.get(module, module) for module in imported_by(package)} & runtime.keys()
        assert imported <= names, f"{package.name}: imports {sorted(imported - names)} without asking for it"
        used |= names
        for tag, known in (("exec_depend", runtime), ("test_depend", tests)):
            declared = {
                keys[str(node.text)]: node.get("version_gte")
                for node in ElementTree.parse(manifest).iter(tag)
                if node.text in keys
            }
            assert declared == {name: known[name] for name in declared}, manifest
            if tag == "exec_depend":
                assert declared.keys() == names & requirements.ROSDEP_KEYS.keys(), manifest
    assert used == runtime.keys()


INSTALLED_BY = {path.parent.name: path.parents[1].name for path in ROOT.glob("src/*/*/__init__.py")}
"""By our import packages, the ROS packages that install them."""


def test_packages_of_ros_are_declared() -> None:
    known = {
        *sys.stdlib_module_names,
        *DISTRIBUTIONS,
        "pydantic_core",
        "pandas",
        "pyarrow",
        "gymnasium",
        "moteus",
        "fivebar",
    }
    known |= {requirements.name_of(one) for one in requirements.section("runtime")}
    home = {
        package.parent.name: manifest.parent.name
        for manifest in MANIFESTS
        for package in manifest.parent.glob("*/__init__.py")
    }
    for manifest in MANIFESTS:
        declared = {node.text for node in ElementTree.parse(manifest).iter("exec_depend")}
        foreign = {home.get(module, module) for module in imported_by(manifest.parent)} - known - {manifest.parent.name}
        assert foreign <= declared, f"{manifest}: imports {sorted(foreign - declared)}"


def test_rosdep_is_asked_for_nothing_from_pip() -> None:
    """Ubuntu refuses pip outside of an environment (PEP 668), and with it every key that stands for pip."""
    for manifest in MANIFESTS:
        for node in ElementTree.parse(manifest).iter():
            if node.tag.endswith("_depend") and str(node.text).startswith(("python", "canopen")):
                assert node.text in requirements.ROSDEP_KEYS.values(), manifest


def test_what_runs_has_a_lowest_version_that_is_locked() -> None:
    for lock in sorted((ROOT / "packaging").glob("lowest-*.lock")):
        python = check_environment.numbers(lock.stem.removeprefix("lowest-"))
        locked = dict(pin.split("==") for pin in pins(f"packaging/{lock.name}"))
        asked = [*requirements.section("runtime"), *requirements.section("tests")]
        for one in (one for one in asked if requirements.applies(one, python)):
            lowest, name = requirements.lowest_of(one), requirements.name_of(one)
            assert lowest, f"requirements.in: {name}: has no lowest version"
            found = locked[name.replace(".", "-")]
            least = check_environment.numbers(lowest)
            locked_at = check_environment.numbers(found)
            assert locked_at >= least, (lock.name, name)
            # apt has some in versions without a wheel; what only pip has is tested in the version that is named
            if python == (3, 11) and name not in requirements.ROSDEP_KEYS:
                assert locked_at[: len(least)] == least, (lock.name, name)


def test_the_environment_beside_apt_leaves_apts_packages_alone() -> None:
    beside = {pin.partition("==")[0] for pin in pins("packaging/jazzy.lock")}
    runtime = {requirements.name_of(one).replace(".", "-") for one in requirements.section("runtime")}
    apt = {name.replace(".", "-") for name in requirements.ROSDEP_KEYS}
    assert not beside & apt
    assert runtime - apt <= beside
    assert not any(name.startswith("ros-") for name in beside)


def test_an_environment_that_is_too_old_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    assert [check_environment.complaint(one) for one in requirements.section("runtime")] == [None] * len(
        requirements.section("runtime")
    )
    monkeypatch.setattr(check_environment, "version", lambda name: "1.10.14")
    assert str(check_environment.complaint("pydantic>=2.13")).startswith(
        "pydantic: expected 2.13 or later, found 1.10.14"
    )
    assert "key python3-numpy" in str(check_environment.complaint("numpy>=1.24"))


def test_actions_images_and_packages_are_pinned_by_their_digests() -> None:
    for path in WORKFLOWS:
        workflow = yaml.safe_load(path.read_text(encoding="utf-8"))
        for job in workflow["jobs"].values():
            assert all(ACTION.fullmatch(step["uses"]) for step in job["steps"] if "uses" in step), path
            assert re.search(r"@sha256:[0-9a-f]{64}$", job.get("container", "@sha256:" + "0" * 64)), path
    for path in IMAGES:
        text = path.read_text(encoding="utf-8")
        assert all("@sha256:" in line for line in re.findall(r"^FROM (.*)$", text, re.MULTILINE)), path
        assert re.findall(r"^USER (\S+)$", text, re.MULTILINE)[-1:] == ["fivebar"], path
    for path in (*WORKFLOWS, *IMAGES, ROOT / "packaging" / "jazzy.sh"):
        text = path.read_text(encoding="utf-8").replace("\\\n", " ")
        for words in re.findall(r"pip install (.*?)(?:&&|$)", text, re.MULTILINE):
            assert "--require-hashes" in words or "--no-index" in words, (path, words)
        assert "--break-system-packages" not in text


@pytest.mark.parametrize("path", IMAGES, ids=lambda path: path.name)
def test_an_image_copies_what_there_is(path: Path) -> None:
    copied = re.findall(r"^COPY (?!--from)(?:--chown=\S+ )?(.+) \S+$", path.read_text(encoding="utf-8"), re.MULTILINE)
    admitted = {line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")}
    files = {file for line in copied for file in line.split()}
    assert files <= admitted
    assert all((ROOT / file).exists() for file in files)


def test_the_development_container_is_described() -> None:
    content = json.loads((ROOT / ".devcontainer" / "devcontainer.json").read_text(encoding="utf-8"))
    assert content["postCreateCommand"].removeprefix("make ") in targets()


def test_the_schema_of_a_summary_is_the_published_one() -> None:
    stale = "stale: .venv/bin/python -m fivebar_bringup.reference.summary_schema > docs/reference/summary.schema.json"
    assert SCHEMA.read_text(encoding="utf-8") == summary_schema(), stale


def test_a_summary_fits_its_schema() -> None:
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    content = fivebar.simulate(fivebar.plan("dextar", goal=(0.0, 0.02))).summary.as_dict()
    assert set(content) == set(schema["required"]) == set(schema["properties"])
    TypeAdapter(fivebar.Summary).validate_json(json.dumps(content), strict=True)
