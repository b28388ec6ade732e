"""An executable of a package: signals have an outcome before the libraries of its program are loaded."""

from __future__ import annotations

import os
import signal
import sys
from importlib import import_module
from types import FrameType
from typing import NamedTuple

from fivebar_description.interrupts import STOP_SIGNALS, service_signals
from fivebar_description.modules import module_command


class Executable(NamedTuple):
    """A node or another service, as entry points call it.

    Attributes:
        module: the module that has its `main`.
    """

    module: str

    @property
    def command(self) -> list[str]:
        """The command that runs it by this interpreter."""
        return [*module_command(__spec__.name), self.module]

    def __call__(self) -> None:
        """Load the module and run its `main`.

        A signal that asks for a stop while it loads ends the process at once, with exit status 0 as later: nothing has
        begun. As an exception it would leave a traceback, or get lost in the library that is being loaded.
        """
        for number in service_signals():
            signal.signal(number, _end)
        # whoever has started this process may have blocked them until here
        signal.pthread_sigmask(signal.SIG_UNBLOCK, STOP_SIGNALS)
        import_module(self.module).main()


def _end(number: int, frame: FrameType | None) -> None:
    os._exit(0)


if __name__ == "__main__":
    del sys.argv[0]
    Executable(sys.argv[0])()
