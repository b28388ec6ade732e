# SPDX-License-Identifier: Apache-2.0
"""A private domain for each test, or for each module where its tests only look; and the motion of the defaults."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from graph_probe import Bench
from middle_motion import MiddleMotion


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    with Bench(tmp_path) as bench:
        yield bench


@pytest.fixture(scope="module")
def shared_bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    with Bench(tmp_path_factory.mktemp("bench")) as bench:
        yield bench


@pytest.fixture(scope="session")
def motion() -> MiddleMotion:
    return MiddleMotion()
