# SPDX-License-Identifier: Apache-2.0
"""Laws that are compiled at first use are begun by different cases."""

from __future__ import annotations

from fivebar_studies.engine.turns import in_turns


def test_each_case_begins_with_another_law_and_returns_all_in_their_order() -> None:
    laws, begun = tuple("abcdefg"), []
    for case in range(4):
        tried: list[str] = []
        assert in_turns(lambda law, tried=tried: (tried.append(law), law.upper())[1], laws, case) == list("ABCDEFG")
        begun.append(tried[0])
        assert sorted(tried) == list(laws)
    # the first two are half of all apart, so that two processes meet late
    assert begun == ["a", "e", "b", "f"]
    assert in_turns(str.upper, (), 3) == []
