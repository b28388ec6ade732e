# SPDX-License-Identifier: Apache-2.0
"""An executable of a package: signals have an outcome before the libraries of its program are loaded."""

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from itertools import takewhile
from typing import NamedTuple

from fivebar_description.interrupts import STOP_SIGNALS, end_at_once, service_signals
from fivebar_description.modules import module_command
from fivebar_description.ros_environment import BAD_INPUT

ROS_ARGUMENTS = "--ros-args"
"""The argument that parameters and remappings of a node follow."""

HELP = frozenset({"-h", "--help"})
"""Words that ask for help."""

NODE_HELP = """{what}

Example: {use}

Parameters are the keys of the scenario, each given as -p NAME:=VALUE. While the node runs, `ros2 param list /{name}`
lists those that it reads, and `ros2 param describe /{name} NAME` explains one. `fivebar settings` prints all of them,
and `fivebar nodes` the topics.
"""


class Executable(NamedTuple):
    """A node or another service, as entry points call it.

    Attributes:
        module: the module that has its `main`.
        example: parameters in an example of a node's use; None for a program that reads its words itself.
        package: the ROS package that has it, where that is not the import package of its module.
    """

    module: str
    example: str | None = None
    package: str = ""

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
            signal.signal(number, end_at_once)
        # whoever has started this process may have blocked them until here
        signal.pthread_sigmask(signal.SIG_UNBLOCK, STOP_SIGNALS)
        self._confirm_there()
        if self.example is not None:
            self._read_words(self.example)
        import_module(self.module).main()

    def _confirm_there(self) -> None:
        """End the process with exit status 2 where the optional package of the module is not installed."""
        package, *_ = self.module.split(".")
        if find_spec(package) is None:
            # here, because hardly any process needs what it imports
            from fivebar_description.optional import missing

            print(f"{self.module.rpartition('.')[2]}: {missing(package)}", file=sys.stderr)
            sys.exit(BAD_INPUT)

    def _read_words(self, example: str) -> None:
        """End the process with help where it is asked for, or with exit status 2 at words that ROS would ignore."""
        words = words_of(sys.argv)
        if not words:
            return
        package, _, name = self.module.split(".")
        use = f"ros2 run {self.package or package} {name} {ROS_ARGUMENTS} {example}"
        if not HELP.intersection(words):
            print(f"{name}: {words[0]!r}: expected parameters after {ROS_ARGUMENTS}: {use}", file=sys.stderr)
            sys.exit(BAD_INPUT)
        print(NODE_HELP.format(what=str(import_module(self.module).__doc__).rstrip(), use=use, name=name), end="")
        sys.exit(0)


def words_of(command: Sequence[str]) -> list[str]:
    """Return the words of a command after its name that are not for ROS."""
    return list(takewhile(lambda word: word != ROS_ARGUMENTS, command[1:]))


if __name__ == "__main__":
    del sys.argv[0]
    Executable(sys.argv[0])()
