# SPDX-License-Identifier: Apache-2.0
"""The `fivebar` command, and how it ends where the operating system refuses something."""

from __future__ import annotations

import os
import sys
from contextlib import suppress

from fivebar_bringup.cli.app import BAD_INPUT, FAILED, app
from fivebar_bringup.cli.exhaustion import exhaustion
from fivebar_bringup.cli.printing import accept_any_character, complain, flush, open_closed_streams


def main() -> None:
    """Run the command; what the operating system refuses, such as a full disk, is one line and exit status 2."""
    open_closed_streams()
    accept_any_character()
    try:
        try:
            app()
        finally:
            flush(sys.stdout)
    except BrokenPipeError:
        _discard_output()
        sys.exit(FAILED)
    except OSError as error:
        _discard_output()
        exhausted = exhaustion(error)
        if exhausted is not None:
            complain(exhausted)
            sys.exit(BAD_INPUT)
        place = (
            f"{os.fsdecode(error.filename)}: "
            if isinstance(error.filename, str | bytes)
            else "a file or the output cannot be written: "
        )
        complain(f"{place}{error.strerror or error}")
        sys.exit(BAD_INPUT)
    except (MemoryError, ImportError, RuntimeError) as error:
        exhausted = exhaustion(error)
        if exhausted is None:
            raise
        complain(exhausted)
        sys.stderr.flush()
        # at once: at the exit of an interpreter without memory, libraries may end in a segmentation fault
        os._exit(BAD_INPUT)


def _discard_output() -> None:
    """Keep the interpreter from writing at its exit what could not be written."""
    # where no more files can be opened, nothing more is written either
    with suppress(OSError), open(os.devnull, "wb") as nowhere:
        os.dup2(nowhere.fileno(), 1)


if __name__ == "__main__":
    main()
