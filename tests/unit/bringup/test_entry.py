"""The entry point of the `fivebar` command: an interrupt while it loads."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

INTERRUPTED = """
import os, signal, sys

class Interrupting:
    def find_spec(self, name, path, target=None):
        if name == "fivebar_bringup.cli.main":
            os.kill(os.getpid(), signal.SIGINT)

signal.signal(signal.SIGINT, signal.{handler})
sys.meta_path.insert(0, Interrupting())
sys.argv = ["fivebar", "--help"]
from fivebar_bringup.cli.entry import main
main()
"""


@pytest.mark.parametrize(
    ("handler", "status", "shown"), [("default_int_handler", -signal.SIGINT, False), ("SIG_IGN", 0, True)]
)
def test_an_interrupt_while_the_command_loads_ends_it_without_a_traceback_unless_it_is_ignored(
    handler: str, status: int, shown: bool
) -> None:
    command = [sys.executable, "-c", INTERRUPTED.format(handler=handler)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stderr) == (status, "")
    assert ("crossing" in done.stdout) == shown
