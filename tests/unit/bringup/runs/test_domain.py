# SPDX-License-Identifier: Apache-2.0
"""A domain is reserved on the whole machine, whoever the users are and whatever their environment says."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

from fivebar_bringup.runs import domain as domains
from fivebar_bringup.runs.domain import PRIVATE_DOMAINS, held_domains, private_domain
from fivebar_description.strict_yaml import InputError

OTHER_USER = 65534

RESERVE = (
    "import os, sys\n"
    "from fivebar_bringup.runs.domain import private_domain\n"
    "if len(sys.argv) > 1:\n"
    "    os.setuid(int(sys.argv[1]))\n"
    "with private_domain() as domain:\n"
    "    print(domain, flush=True)\n"
    "    sys.stdin.read()\n"
)


class OtherRun:
    """A process that reserves a domain and keeps it until the end of the context."""

    def __init__(self, environment: dict[str, str], user: int | None = None) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", RESERVE, *([] if user is None else [str(user)])],
            env={**os.environ, **environment}, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip
        assert self._process.stdout is not None
        self.domain = int(self._process.stdout.readline())

    def __enter__(self) -> OtherRun:
        return self

    def __exit__(self, *exception: object) -> None:
        self._process.kill()
        self._process.communicate()


def test_runs_with_other_temporary_folders_get_other_domains(tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
    environments = [
        {"TMPDIR": str(tmp_path / name), "XDG_RUNTIME_DIR": str(tmp_path / name)} for name in ("one", "two")
    ]
    with private_domain() as own, OtherRun(environments[0]) as first, OtherRun(environments[1]) as second:
        assert len({own, first.domain, second.domain}) == 3
        assert {own, first.domain, second.domain} <= set(held_domains())
    assert not {own, first.domain, second.domain} & set(held_domains())


@pytest.mark.skipif(os.getuid() != 0, reason="only root may start a process of another user")
def test_a_run_of_another_user_gets_another_domain_and_is_not_taken_for_an_own_one() -> None:
    with OtherRun({"HOME": "/"}, OTHER_USER) as other, private_domain() as own:
        assert own != other.domain
        assert own in held_domains()
        assert other.domain not in held_domains()


def test_a_domain_in_which_a_process_takes_part_is_left_alone() -> None:
    """Such as that of a node started by hand, or of a run whose launcher was killed: nobody has reserved it."""
    with private_domain() as free:
        pass
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as participant:
        participant.bind(("127.0.0.1", 7410 + 250 * free))
        with private_domain() as chosen:
            assert chosen != free


def test_nothing_is_written_where_others_may_have_planted_links(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Root's file behind a link in a folder that anybody can make keeps its content."""
    valuable = tmp_path / "valuable"
    valuable.write_text("content", encoding="utf-8")
    planted = tmp_path / f"fivebar-domains-{os.getuid()}"
    planted.mkdir(mode=0o777)
    for domain in PRIVATE_DOMAINS:
        (planted / str(domain)).symlink_to(valuable)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with private_domain():
        held_domains()
    assert valuable.read_text(encoding="utf-8") == "content"
    assert sorted(path.name for path in tmp_path.iterdir()) == [planted.name, "valuable"]


def test_no_domain_is_free(monkeypatch: pytest.MonkeyPatch) -> None:
    with ExitStack() as stack:
        monkeypatch.setattr(domains, "PRIVATE_DOMAINS", range(98, 100))
        for domain in domains.PRIVATE_DOMAINS:
            stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)).bind(("", 7402 + 250 * domain))
        with pytest.raises(InputError, match="no free DDS domain between 98 and 99"), private_domain():
            pass
