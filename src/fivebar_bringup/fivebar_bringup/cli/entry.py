"""The entry point of the `fivebar` command, which loads nothing large before an interrupt has a defined outcome."""

from __future__ import annotations

import signal


def main() -> None:
    """Load and run the command; Ctrl-C while it loads, which takes a second, ends it without a traceback."""
    # an ignored interrupt, as of a job in the background, stays ignored
    heard = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if heard:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from fivebar_bringup.cli.main import main as run

    if heard:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    run()
