# SPDX-License-Identifier: Apache-2.0
"""The pseudo-terminal that stands for the board's USB port."""

from __future__ import annotations

import contextlib
import os
import pty
import select
import tty
from pathlib import Path

MOST_BYTES = 4096


class PseudoPort:
    """A serial port that this process serves: the client opens `path`, or the symbolic link to it."""

    def __init__(self, link: Path | None = None) -> None:
        """Plug the cable in."""
        self._link = link
        self._files: tuple[int, int] | None = None
        self.path = ""
        """The device that the client opens."""
        self.plug()

    def plug(self) -> None:
        """Make the port, under the same link as before."""
        if self._files is not None:
            return
        ours, theirs = pty.openpty()
        # kept open, so that a client that closes the port is no end of it, and raw before any client comes
        tty.setraw(theirs)
        os.set_blocking(ours, False)
        self._files = ours, theirs
        self.path = os.ttyname(theirs)
        if self._link is not None:
            self._link.unlink(missing_ok=True)
            self._link.symlink_to(self.path)

    def unplug(self) -> None:
        """Unplug the cable: the port is gone, also for a client that has it open."""
        if self._files is None:
            return
        if self._link is not None:
            self._link.unlink(missing_ok=True)
        for file in self._files:
            os.close(file)
        self._files = None

    def read(self, timeout: float) -> bytes:
        """Return the bytes that have come, b"" where none comes within a time (s)."""
        if self._files is None:
            select.select((), (), (), timeout)
            return b""
        readable, _, _ = select.select(self._files[:1], (), (), timeout)
        if not readable:
            return b""
        with contextlib.suppress(BlockingIOError):
            return os.read(self._files[0], MOST_BYTES)
        return b""

    def write(self, data: bytes) -> None:
        """Send bytes; what does not fit, because nobody reads, is lost."""
        if self._files is not None and data:
            with contextlib.suppress(BlockingIOError):
                os.write(self._files[0], data)
