# SPDX-License-Identifier: Apache-2.0
"""Lets libFuzzer, by way of Atheris, run on one parser: target.py NAME INPUTS KEPT FOLDER; `run.py` calls it.

It changes inputs and keeps those that reach new lines of what is instrumented; JSON documents are changed as such.
"""

from __future__ import annotations

import json
import random
import sys
from pathlib import Path
from typing import Any

import atheris

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

# what reads input; a function that numba compiles must not be instrumented
with atheris.instrument_imports(
    include=[
        "fivebar_description.strict_yaml",
        "fivebar_description.run_plan",
        "fivebar_description.strict_yaml",
        "fivebar_live.commands",
        "fivebar_bringup.recorded.timing",
        "fivebar_bringup.runs",
        "fivebar_bringup.scenario",
        "fivebar_studies.benchmark.scoring",
        "fivebar_bringup.calibrate.reading",
        "fivebar_studies.engine.directory",
        "fivebar_studies.engine.table",
        "fivebar_studies.sweep.rows",
        "fivebar_control.hardware",
        "fivebar_motkin.board_file",
        "fivebar_control.planning.program",
        "fivebar_vision.calibration",
        "fivebar_motkin_emulation",
        "fivebar_sim.drives",
    ]
):
    from fuzzing import understand_or_refuse
    from parsers import PARSERS, Parser

SECONDS_EACH = 20
"""An input that takes longer is a defect."""

LONGEST = 600
"""Length (bytes) of an input, or that of the longest seed: long ones take long and find little more."""

SCALARS: list[Any] = [
    None,
    True,
    False,
    0,
    -1,
    1,
    2,
    500,
    0.5,
    -0.0,
    1e308,
    5e-324,
    1e-9,
    2**63,
    float("nan"),
    float("inf"),
]
WORDS = ["", "dextar", "../dextar", "os:path", "a.b:C", "null", "1e3", "on", "%s", "\x1b[0m", "\n", "²"]


def main(name: str, inputs: int, kept: Path, folder: Path) -> None:
    """Run so many inputs on a parser, which has a folder for its files; libFuzzer ends the process."""
    parser = PARSERS[name]
    corpus, seeds = kept / "corpus", kept / "seeds"
    for place in (corpus, seeds):
        place.mkdir(parents=True, exist_ok=True)
    for number, seed in enumerate(parser.seeds):
        (seeds / str(number)).write_bytes(seed)
    options = [
        f"-runs={inputs}",
        f"-max_len={max(LONGEST, *(len(seed) for seed in parser.seeds))}",
        f"-timeout={SECONDS_EACH}",
        f"-artifact_prefix={kept}/",
        "-rss_limit_mb=4096",
        "-verbosity=0",
        "-print_final_stats=1",
    ]
    run(parser, [*options, str(corpus), str(seeds)], folder)


def run(parser: Parser, options: list[str], folder: Path) -> None:
    """Start libFuzzer on a parser, with a folder for its files."""

    def once(content: bytes) -> None:
        understand_or_refuse(parser, content, folder)

    mutator = {"custom_mutator": changed_document} if parser.structured else {}
    atheris.Setup([sys.argv[0], *options], once, **mutator)
    atheris.Fuzz()


def changed_document(content: bytes, longest: int, seed: int) -> bytes:
    """Return a JSON document with one to three of its entries replaced, removed or added."""
    chance = random.Random(seed)
    try:
        document = json.loads(content)
    except ValueError:
        document = {}
    for _ in range(chance.randint(1, 3)):
        within = containers(document)
        if not within:
            document = {}
            continue
        inside = chance.choice(within)
        keys = list(inside) if isinstance(inside, dict) else list(range(len(inside)))
        kind = chance.choice(("replace", "remove", "add")) if keys else "add"
        if kind == "remove":
            del inside[chance.choice(keys)]
        elif kind == "replace":
            inside[chance.choice(keys)] = anything(chance)
        elif isinstance(inside, dict):
            inside[chance.choice(WORDS)] = anything(chance)
        else:
            inside.append(anything(chance))
    changed = json.dumps(document).encode()
    return changed if len(changed) <= longest else content


def containers(content: Any) -> list[Any]:
    """Return the objects and lists in a document, itself included."""
    inner = content.values() if isinstance(content, dict) else content if isinstance(content, list) else None
    return [] if inner is None else [content, *(one for value in inner for one in containers(value))]


def anything(chance: random.Random, deepest: int = 2) -> Any:
    """Return a random value."""
    kind = chance.randrange(6 if deepest else 4)
    if kind == 0:
        return chance.choice(WORDS)
    if kind == 1:
        return chance.uniform(-2.0, 2.0) * 10.0 ** chance.randint(-6, 6)
    if kind in (2, 3):
        return chance.choice(SCALARS)
    values = [anything(chance, deepest - 1) for _ in range(chance.randint(0, 3))]
    return values if kind == 4 else {chance.choice(WORDS): value for value in values}


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]), Path(sys.argv[4]))
