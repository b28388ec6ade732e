# SPDX-License-Identifier: Apache-2.0
"""Who answers the questions of a commissioning: at a terminal, and by a file."""

from __future__ import annotations

import pytest

from fivebar_commission.person import PersonAtTerminal, PersonByFile, PersonLeft, PutAt
from fivebar_description.strict_yaml import InputError

MARK = PutAt(0.0, 0.1)


def at_terminal(*lines: str) -> tuple[PersonAtTerminal, list[str]]:
    """A person who types lines, and what is printed."""
    left, printed = [*lines], list[str]()
    return PersonAtTerminal(lambda: left.pop(0) if left else "", printed.append), printed


def test_a_person_is_asked_until_the_answer_is_yes_or_no() -> None:
    person, printed = at_terminal("perhaps\n", "YES\n", "no\n", "\n")
    assert person.agrees("a", "Ready?") is True
    assert person.agrees("b", "Sure?") is False
    person.does("c", "Put it there", MARK)
    assert person.asked == 3
    assert printed == [
        "Ready? [yes/no]",
        "'perhaps': expected yes, no, or stop",
        "Ready? [yes/no]",
        "Sure? [yes/no]",
        "Put it there [Enter when done]",
    ]


@pytest.mark.parametrize("lines", [(), ("stop\n",)], ids=["end_of_input", "stop"])
def test_the_end_of_the_input_and_stop_leave(lines: tuple[str, ...]) -> None:
    with pytest.raises(PersonLeft):
        at_terminal(*lines)[0].agrees("a", "Ready?")
    with pytest.raises(PersonLeft):
        at_terminal(*lines)[0].does("a", "Put it there", MARK)


def test_answers_by_their_keys_come_first_and_what_is_wrong_is_named() -> None:
    other, printed = at_terminal("no\n")
    person = PersonByFile({"a": True, "b": "done", "c": "stop", "d": "maybe"}, "answers.yaml", other)
    assert person.agrees("a", "Ready?") is True
    person.does("b", "Put it there", MARK)
    assert person.agrees("other", "Sure?") is False
    assert person.asked == 3
    assert printed == ["Sure? [yes/no]"]
    with pytest.raises(PersonLeft, match=r"answers\.yaml: c: stop"):
        person.agrees("c", "Ready?")
    with pytest.raises(InputError, match=r"answers\.yaml: d: 'maybe': expected yes, no or stop.*Ready\?"):
        person.agrees("d", "Ready?")
    with pytest.raises(InputError, match=r"answers\.yaml: e: no answer to: Ready\?"):
        PersonByFile({}, "answers.yaml", None).agrees("e", "Ready?")
