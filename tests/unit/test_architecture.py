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

ROOT = Path(__file__).parents[2]
SRC = ROOT / "src"

MAY_IMPORT = {
    "fivebar_description": set(),
    "fivebar_control": {"fivebar_description"},
    "fivebar_sim": {"fivebar_description"},
    "fivebar_bringup": {"fivebar_description", "fivebar_control", "fivebar_sim"},
}
"""What each package may import besides itself."""

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


def modules() -> list[Path]:
    """Every module of the packages, and of the Python interface; neither setup.py nor launch files belong to one."""
    folders = [*(SRC / package / package for package in MAY_IMPORT), SRC / "fivebar_bringup" / "fivebar"]
    return sorted(path for folder in folders for path in folder.rglob("*.py"))


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
    assert {path.name for path in SRC.iterdir() if (path / "package.xml").is_file()} == set(MAY_IMPORT)
    assert len(modules()) > 40


def test_imports_run_one_way() -> None:
    """bringup -> {control, sim} -> description; control and sim are each other's check and never meet."""
    wrong = {}
    for path in modules():
        own = path.relative_to(SRC).parts[0]
        packages = {name.split(".")[0] for name in imported(path)}
        used = {package for package in packages if package.startswith("fivebar_")}
        wrong[name_of(path)] = used - MAY_IMPORT[own] - {own}
    assert not {name: packages for name, packages in wrong.items() if packages}


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
        path = SRC / parts[0] / Path(*parts[:end])
        if path.with_suffix(".py").is_file() or (path / "__init__.py").is_file():
            return ".".join(parts[:end])
    return ""


def imports_of_modules(types: bool) -> dict[str, set[str]]:
    """By the module, those of ours that it imports; `types` for what only type checkers import too."""
    return {
        ".".join(path.relative_to(SRC).with_suffix("").parts[1:]).removesuffix(".__init__"): {
            module_of(name) for name in imported(path, types) if name.startswith("fivebar_")
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
    assert len(parts) > 5
    orders = {folder: order_of(above) for folder, above in parts.items()}
    bringup, control = orders["fivebar_bringup"], orders["fivebar_control"]
    assert bringup.index("bag") < bringup.index("simulation") < bringup.index("recorded") < bringup.index("cli")
    assert control.index("model") < control.index("laws") < control.index("loop") < control.index("planning")
