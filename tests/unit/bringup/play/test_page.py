# SPDX-License-Identifier: Apache-2.0
"""The page of the documentation is the one that the present model and scripts make."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from fivebar_play.content import PUSH_TIME
from fivebar_play.page import data, rendered

PAGE = Path(__file__).parents[4] / "docs" / "play.html"
DATA = re.compile(r'(?<=id="play-data">).*?(?=</script>)', re.DOTALL)


RENEW = "docs/play.html is older than the model: make play"


def test_the_page_of_the_documentation_is_fresh() -> None:
    assert DATA.sub("", PAGE.read_text(encoding="utf-8")) == DATA.sub("", rendered({})), RENEW


@pytest.mark.extra
def test_its_data_are_fresh() -> None:
    """They are near, since libraries compute them in part."""
    found = DATA.search(PAGE.read_text(encoding="utf-8"))
    assert found is not None
    before, now = json.loads(found[0]), json.loads(json.dumps(data()))
    assert before["robot"] == now["robot"]
    assert before["scene"]["bounds"] == now["scene"]["bounds"]
    for old, new in zip(before["recorded"], now["recorded"], strict=True):
        assert (old["push"], old["columns"]) == (new["push"], new["columns"])
        assert places(old) == pytest.approx(places(new), abs=1e-6), RENEW


def places(run: dict[str, Any]) -> list[float]:
    """The platform (m) of a recorded run."""
    return [value for row in run["rows"] for value in row[:2]]


def test_the_page_pushes_as_long_as_it_says() -> None:
    assert f"const PUSH_TIME = {PUSH_TIME}," in PAGE.read_text(encoding="utf-8")
