# SPDX-License-Identifier: Apache-2.0
"""The rules of the house that no single module can keep: which way imports run, where ROS is, what is documented."""

from __future__ import annotations

import ast
import functools
import graphlib
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer

from fivebar_bringup.cli.main import app
from fivebar_description import optional
from fivebar_description.errors import InputError
from fivebar_description.optional import (
    CAMERA_PARTS,
    COMMANDS,
    LIVE_PAGE,
    MUJOCO_CHECK,
    MUJOCO_MODEL,
    MUJOCO_PLANT,
    PACKAGE_OF,
    PYTHON,
    SENSORS,
    OptionalPart,
    confirm_package,
    optional_part,
    registered,
)

ROOT = Path(__file__).parents[2]
SRC = ROOT / "src"

CORE = {
    "fivebar_description": set[str](),
    "fivebar_control": {"fivebar_description"},
    "fivebar_sim": {"fivebar_description"},
    "fivebar_bringup": {"fivebar_description", "fivebar_control", "fivebar_sim"},
    "fivebar": {"fivebar_description", "fivebar_control", "fivebar_sim", "fivebar_bringup"},
}
"""The import packages without which no robot crosses, and what each may import besides itself."""

CONTROLLING = {
    "fivebar_moteus": set[str](),
    "fivebar_motkin": {"fivebar_motkin_description"},
    "fivebar_odrive": set[str](),
    "fivebar_vision": {"fivebar_optics"},
}
"""Others in fivebar_control, and what each may import besides itself, fivebar_control and fivebar_description."""

SIMULATED = {
    "fivebar_camera": {"fivebar_optics"},
    "fivebar_moteus_emulation": set[str](),
    "fivebar_motkin_emulation": {"fivebar_motkin_description"},
    "fivebar_mujoco": set[str](),
    "fivebar_odrive_emulation": set[str](),
}
"""Others in fivebar_sim, and what each may import besides itself, fivebar_sim and fivebar_description."""

OPTIONAL = {
    "fivebar_studies": set[str](),
    "fivebar_camera_runs": {"fivebar_camera", "fivebar_vision", "fivebar_optics"},
    "fivebar_gym": {"fivebar_studies"},
    "fivebar_live": set[str](),
    "fivebar_play": set[str](),
    "fivebar_commission": {"fivebar_studies", "fivebar_odrive_emulation"},
    "fivebar_vendor_drives": {*CONTROLLING, *SIMULATED} - {"fivebar_camera", "fivebar_mujoco", "fivebar_vision"},
}
"""Others in fivebar_bringup, and what each may import besides itself and the core."""

MAY_IMPORT = CORE | {
    "fivebar_optics": {"fivebar_description"},
    "fivebar_motkin_description": {"fivebar_description"},
    **{name: others | {"fivebar_description", "fivebar_control"} for name, others in CONTROLLING.items()},
    **{name: others | {"fivebar_description", "fivebar_sim"} for name, others in SIMULATED.items()},
    **{name: others | (CORE.keys() - {"fivebar"}) for name, others in OPTIONAL.items()},
}

CAMERA = {part for part in vars(optional).values() if isinstance(part, OptionalPart) and part.group == SENSORS}
"""What the core finds of a camera by name."""

ROS_PREFIXES = (
    "rclpy",
    "rcl_interfaces",
    "rosidl",
    "ament",
    "rpyutils",
    "builtin_interfaces",
    "unique_identifier_msgs",
)
ROS_SUFFIXES = ("_msgs", "_srvs", "_interfaces")


def folder_of(package: str) -> Path:
    """The folder of an import package, in the ROS package that has it."""
    (found,) = SRC.glob(f"*/{package}/__init__.py")
    return found.parent


def modules() -> list[Path]:
    """Every module of the import packages; neither setup.py nor launch files belong to one."""
    return sorted(path for package in MAY_IMPORT for path in folder_of(package).rglob("*.py"))


def scripts() -> list[Path]:
    """Every script that reproduces a table or figure of a page, and every benchmark; none is part of a package."""
    found = sorted(path for folder in ("docs/studies", "bench") for path in (ROOT / folder).glob("*.py"))
    assert len(found) > 30
    return found


def name_of(path: Path) -> str:
    return str(path.relative_to(SRC if path.is_relative_to(SRC) else ROOT))


@functools.cache
def syntax_tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@functools.cache
def imported(path: Path, types: bool = True) -> tuple[str, ...]:
    """Full names of everything that a module imports, wherever in its text the import stands; `types` for types too."""
    return tuple(_imported(path, types))


def _imported(path: Path, types: bool) -> Iterator[str]:
    inside = path.relative_to(SRC).parts[1:-1]
    nodes = [*ast.walk(syntax_tree(path))]
    for_types = {
        inner
        for node in nodes
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        for inner in ast.walk(node)
    }
    for node in nodes if types else [node for node in nodes if node not in for_types]:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = ".".join(inside[: len(inside) - node.level + 1]) if node.level else ""
            module = ".".join(part for part in (above, node.module) if part)
            yield from (f"{module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if called in ("import_module", "__import__"):
                yield str(node.args[0].value)


def is_ros(name: str) -> bool:
    package = name.split(".")[0]
    return package.startswith(ROS_PREFIXES) or package.endswith(ROS_SUFFIXES)


def may_use_ros(path: Path) -> bool:
    parts = path.relative_to(SRC).parts
    return bool({"nodes", "ros"}.intersection(parts[2:-1]))


def test_the_packages_are_the_ones_of_the_house() -> None:
    assert {path.name for path in SRC.iterdir() if (path / "package.xml").is_file()} == CORE.keys() - {"fivebar"}
    assert {path.parent.name for path in SRC.glob("*/*/__init__.py")} == MAY_IMPORT.keys()
    assert len(modules()) > 40


def test_imports_run_one_way() -> None:
    """bringup -> {control, sim} -> description; control and sim are each other's check and never meet.

    Optional packages import the core, and the core none of them, not even within a function: it finds what they
    register. Only types may be named.
    """
    wrong = {}
    for path in modules():
        own = path.relative_to(SRC).parts[1]
        packages = {name.split(".")[0] for name in imported(path, types=own != "fivebar")}
        used = {package for package in packages if package.startswith("fivebar")}
        wrong[name_of(path)] = used - MAY_IMPORT[own] - {own}
    assert not {name: packages for name, packages in wrong.items() if packages}


NAMED_BY_ITS_CHECKS = ("fivebar_description.plausibility", "fivebar_description.robot_file")
"""The checks that a robot file makes of itself name its type."""


def test_no_modules_import_each_other_in_a_circle() -> None:
    """Not even for types: who reads one of them need not read the others first."""
    paths = {".".join(path.relative_to(SRC).with_suffix("").parts[1:]): path for path in modules()}
    imports: dict[str, set[str]] = {}
    for name, path in paths.items():
        found = imported(path)
        targets = {one for full in found for one in (full, full.rpartition(".")[0]) if one in paths and one != name}
        imports[name] = targets - {NAMED_BY_ITS_CHECKS[1]} if name == NAMED_BY_ITS_CHECKS[0] else targets
    assert sum(map(len, imports.values())) > 2000
    graphlib.TopologicalSorter(imports).prepare()


def test_what_the_core_names_of_optional_packages_is_there() -> None:
    """What it finds by name alone: the package of each command and part, and what setup.py registers."""
    assert set(PACKAGE_OF.values()) | {LIVE_PAGE.package} <= OPTIONAL.keys()
    assert {entry.name for entry in registered(SENSORS)} == {part.name for part in CAMERA}
    assert {part.package for part in CAMERA} == {part.package for part in CAMERA_PARTS}
    assert all(callable(optional_part(part, "it")) and part.package in MAY_IMPORT for part in CAMERA)
    for entry in registered(COMMANDS):
        entry.load()
    callbacks = {name: declared.callback for name, declared in typer.main.get_group(app).commands.items()}
    packages = {name: callback.__module__.partition(".")[0] for name, callback in callbacks.items() if callback}
    assert {name: package for name, package in packages.items() if package != "fivebar_bringup"} == PACKAGE_OF
    for part in (LIVE_PAGE, MUJOCO_PLANT, MUJOCO_CHECK, MUJOCO_MODEL, OptionalPart(PYTHON, "sweep", "fivebar_studies")):
        assert callable(optional_part(part, "it"))
    with pytest.raises(InputError, match="it: needs the package fivebar_missing, which is not installed: pip install"):
        optional_part(OptionalPart(PYTHON, "other", "fivebar_missing"), "it")
    with pytest.raises(InputError, match="it: needs the package fivebar_missing, which is not installed"):
        confirm_package("fivebar_missing.kinds:DRIVES", "it")
    # what somebody else's module lacks, its import says
    confirm_package("my_missing.kinds:DRIVES", "it")


def test_ros_stays_in_the_nodes_and_in_the_folders_named_ros() -> None:
    """Everything else is plain Python. What runs the graph (in bringup) may import nodes, never ROS itself."""
    dressed = tuple(f"{package}.{folder}." for package in MAY_IMPORT for folder in ("nodes", "ros"))
    wrong = {}
    for path in (one for one in modules() if not may_use_ros(one)):
        forbidden = () if path.relative_to(SRC).parts[0] == "fivebar_bringup" else dressed
        found = [name for name in imported(path) if is_ros(name) or f"{name}.".startswith(forbidden)]
        wrong[name_of(path)] = found
    assert len(wrong) > 400
    assert not {name: found for name, found in wrong.items() if found}


BELOW_THE_LAWS = {"model", "laws", "fault", "compiling"}
"""What the laws may import of their package: neither plans nor nodes, so that a law is known by its inputs alone."""


def layers_under(folder: str) -> dict[str, set[str]]:
    """By the module of a folder of control, the folders and modules of control that it imports."""
    return {
        path.name: {name.split(".")[1] for name in imported(path) if name.startswith("fivebar_control.")}
        for path in (SRC / "fivebar_control/fivebar_control" / folder).glob("*.py")
    }


def test_laws_stand_on_the_model_alone() -> None:
    used = layers_under("laws")
    assert len(used) > 10
    assert not {name: inside for name, inside in used.items() if not inside <= BELOW_THE_LAWS}


ABOVE_THE_LOOP = {"planning", "ros", "nodes"}
"""What laws, plans and the control cycle do not know of: who searches and judges motions runs them, not they it."""


@pytest.mark.parametrize("layer", ["model", "laws", "safety", "trajectory", "estimation", "loop"])
def test_the_control_cycle_stands_below_the_planning(layer: str) -> None:
    assert not {name: inside for name, inside in layers_under(layer).items() if inside & ABOVE_THE_LOOP}


PLAIN_IMPORTS = """
import importlib, sys

class NoRos:
    def find_spec(self, name, path=None, target=None):
        package = name.split(".")[0]
        if package.startswith(("rclpy", "rosidl")) or package.endswith(("_msgs", "_srvs", "_interfaces")):
            raise ImportError(f"{name} is ROS")

sys.meta_path.insert(0, NoRos())
for name in sys.argv[1:]:
    importlib.import_module(name)
"""


def test_laws_plant_and_offline_runner_need_no_ros() -> None:
    """Import them where every import of ROS fails."""
    plain = [path for path in modules() if not may_use_ros(path) and "fivebar_bringup" not in path.parts]
    wanted = [".".join(path.relative_to(SRC).with_suffix("").parts[1:]).removesuffix(".__init__") for path in plain]
    command = [
        sys.executable,
        "-c",
        PLAIN_IMPORTS,
        *wanted,
        "fivebar_bringup.simulation.offline",
        "fivebar_bringup.scenario",
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr


HIDDEN = """
import sys

class Hiding:
    def __init__(self, found, hidden):
        self.found, self.hidden = found, hidden

    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in self.hidden:
            return None
        specs = (finder.find_spec(name, path, target) for finder in self.found if hasattr(finder, "find_spec"))
        return next((spec for spec in specs if spec is not None), None)

hidden, sys.argv = sys.argv[1].split(","), ["fivebar", *sys.argv[2:]]
sys.meta_path[:] = [Hiding([*sys.meta_path], hidden)]
from fivebar_bringup.cli.entry import main
main()
"""


def in_the_core(*words: str) -> tuple[int, str]:
    """Return exit status and errors of a command where neither optional packages nor their libraries are found."""
    hidden = ",".join([*(MAY_IMPORT.keys() - CORE.keys()), "cv2", "mujoco"])
    command = [sys.executable, "-c", HIDDEN, hidden, *words]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    return done.returncode, done.stderr


def test_the_core_crosses_without_optional_packages_and_refuses_a_camera_by_name(tmp_path: Path) -> None:
    status, errors = in_the_core("simulate", "middle", "--no-page", "--out", str(tmp_path / "run"))
    assert status == 0, errors
    status, errors = in_the_core("simulate", "camera_slow", "--out", str(tmp_path / "seen"))
    (line,) = errors.splitlines()
    assert status == 2 and "camera.on: True: needs the package fivebar_camera_runs, which is not installed" in line
    assert not (tmp_path / "seen").exists()


def test_a_class_name_stands_for_one_class() -> None:
    """So that a name in a docstring, a traceback or a search is never ambiguous.

    The Python interface is left out: its plain words, such as Robot, are for those who see no other class.
    """
    where: dict[str, list[str]] = {}
    plain = [one for one in modules() if "fivebar" not in one.relative_to(SRC).parts]
    for path in (*plain, *scripts()):
        for node in ast.walk(syntax_tree(path)):
            if isinstance(node, ast.ClassDef):
                where.setdefault(node.name, []).append(name_of(path))
    assert not {name: paths for name, paths in where.items() if len(paths) > 1}


def undocumented(tree: ast.Module) -> Iterator[str]:
    """Names of the module, classes, functions and methods that people call and that say nothing about themselves."""
    if not ast.get_docstring(tree):
        yield "the module"

    def visit(body: list[ast.stmt], prefix: str) -> Iterator[str]:
        for node in body:
            if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
                if node.name.startswith("_"):
                    continue
                overload = any(ast.unparse(decorator).endswith("overload") for decorator in node.decorator_list)
                if not overload and not ast.get_docstring(node):
                    yield prefix + node.name
                if isinstance(node, ast.ClassDef):
                    yield from visit(node.body, f"{prefix}{node.name}.")
            elif isinstance(node, ast.If | ast.Try | ast.With):
                yield from visit(node.body, prefix)

    yield from visit(tree.body, "")


def test_everything_public_says_what_it_is() -> None:
    paths = (path for path in (*modules(), *scripts()) if syntax_tree(path).body)
    silent = {name_of(path): [*undocumented(syntax_tree(path))] for path in paths}
    assert not {name: found for name, found in silent.items() if found}


def module_of(name: str) -> str:
    """The module or package that an imported name belongs to, as a dotted name; "" where it is none of ours."""
    parts = name.split(".")
    for end in range(len(parts), 0, -1):
        path = folder_of(parts[0]).parent / Path(*parts[:end])
        if path.with_suffix(".py").is_file() or (path / "__init__.py").is_file():
            return ".".join(parts[:end])
    return ""


def imports_of_modules(types: bool) -> dict[str, set[str]]:
    """By the module, those of ours that it imports; `types` for what only type checkers import too."""
    return {
        ".".join(path.relative_to(SRC).with_suffix("").parts[1:]).removesuffix(".__init__"): {
            module_of(name) for name in imported(path, types) if name.split(".")[0] in MAY_IMPORT
        }
        - {""}
        for path in modules()
        if "fivebar" not in path.relative_to(SRC).parts
    }


def order_of(above: dict[str, set[str]]) -> list[str]:
    """Some things in an order in which each stands on earlier ones alone."""
    try:
        return list(graphlib.TopologicalSorter(above).static_order())
    except graphlib.CycleError as error:
        pytest.fail(f"these import each other: {' -> '.join(reversed(error.args[1]))}")


def test_modules_import_one_way() -> None:
    assert len(order_of({name: used - {name} for name, used in imports_of_modules(types=False).items()})) > 400


def test_folders_import_one_way() -> None:
    """Between any two parts of one folder, each with all that is in it: so a reader knows which stands on which."""
    parts: dict[str, dict[str, set[str]]] = {}
    for name, used in imports_of_modules(types=True).items():
        for other in used:
            one, two = name.split("."), other.split(".")
            shared = next((n for n, pair in enumerate(zip(one, two, strict=False)) if pair[0] != pair[1]), 0)
            # two modules side by side may name each other's types
            if shared and max(len(one), len(two)) > shared + 1:
                inside = parts.setdefault(".".join(one[:shared]), {})
                inside.setdefault(one[shared], set()).add(two[shared])
    assert len(parts) > 4
    orders = {folder: order_of(above) for folder, above in parts.items()}
    bringup, control = orders["fivebar_bringup"], orders["fivebar_control"]
    assert bringup.index("bag") < bringup.index("simulation") < bringup.index("recorded") < bringup.index("cli")
    assert control.index("model") < control.index("laws") < control.index("loop") < control.index("planning")
