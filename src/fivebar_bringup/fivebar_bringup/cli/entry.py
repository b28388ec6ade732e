# SPDX-License-Identifier: Apache-2.0
"""The entry point of the `fivebar` command: nothing large is loaded before an interrupt has a defined outcome."""

from __future__ import annotations

import signal


def main() -> None:
    """Load and run the command; Ctrl-C while it loads, up to `input_errors`, ends it without a traceback."""
    # an ignored interrupt, as of a job in the background, stays ignored
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from fivebar_bringup.cli.main import main as run

    run()


if __name__ == "__main__":
    main()
