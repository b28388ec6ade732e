# SPDX-License-Identifier: Apache-2.0
"""A growing MCAP file that is complete and readable at every instant, also between two system calls.

An MCAP file ends with its index (the summary) and a footer that says where the index starts; readers begin at the
footer. New data overwrite the old index. Writing the new data, index and footer over it in a single call is not
enough: the kernel checks for a pending SIGKILL after every page, so a killed process can leave a partial write.
Therefore the old index is first copied beyond the end of what is going to be written:

1. write a footer far beyond the end, still pointing at the old index; it extends the file and lies within one page, so
   it is written completely or not at all;
2. copy the old index in front of that footer (nothing refers to it yet);
3. rewrite the footer so that it points at the copy;
4. write new data, new index and new footer over the old index (nothing refers to these bytes now);
5. truncate the file after the new footer.

Until step 5 a reader finds the old state, afterwards the new one. This protects against the death of the process; a
power failure can still lose what the operating system had not written to the disk.
"""

from __future__ import annotations

import io
import os
import struct
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from fivebar_description.files import replace_file

PAGE = 4096
"""Bytes that the kernel copies without interruption, at this alignment."""

_FOOTER = struct.Struct("<BQQQI8s")
_FOOTER_OPCODE = 2
_MAGIC = b"\x89MCAP0\r\n"


class TailStream(io.BytesIO):
    """The end of a file, buffered in memory: a stream whose positions are offsets in the whole file."""

    def __init__(self) -> None:
        super().__init__()
        self._base = 0

    @property
    def base(self) -> int:
        """Offset in the file of the first buffered byte."""
        return self._base

    def tell(self) -> int:
        """Return the offset in the file of the next byte to be written."""
        return self._base + super().tell()

    def cut(self, offset: int) -> None:
        """Discard everything from this offset in the file on; writing continues there."""
        self.seek(offset - self._base)
        self.truncate(offset - self._base)

    def release(self) -> None:
        """Discard the buffer once it has been written to the file; writing continues at the same offset."""
        self._base = self.tell()
        self.seek(0)
        self.truncate(0)


class _State(NamedTuple):
    """State of the file on disk: end of the data, everything after it (index and footer), start of the index."""

    data_end: int
    tail: bytes
    summary_start: int


class TailFile:
    """The file on disk. Every method either brings it to the new state or raises OSError and leaves the old one."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._fd = -1
        self._state = _State(0, b"", 0)

    def replace(self, content: bytes, data_end: int) -> None:
        """Replace the file's content by `content`, a complete MCAP file; creates the file. For small files only.

        Used as long as the file has no chunk: without one, readers scan the file instead of using the index.
        """
        replace_file(self._path, content)
        fd = os.open(self._path, os.O_RDWR | os.O_CLOEXEC)
        old, self._fd = self._fd, fd
        if old >= 0:
            os.close(old)
        self._state = _state_of(0, content, data_end)

    def extend(self, start: int, block: bytes, data_end: int) -> None:
        """Put `block` at the offset `start`, the end of the data so far, in place of the old index and footer.

        `block` is new data up to the offset `data_end`, then the new index and footer.
        """
        old = self._state
        old_size = old.data_end + len(old.tail)
        size = start + len(block)
        summary = old.tail[old.summary_start - old.data_end : -_FOOTER.size]
        needed = max(old_size, size) + len(summary) + _FOOTER.size
        far_footer = -(-needed // PAGE) * PAGE - _FOOTER.size
        shelter = far_footer - len(summary)
        try:
            self._put(far_footer, _footer(old.summary_start))
            self._put(shelter, summary)
            self._put(far_footer, _footer(shelter))
            self._put(start, block)
            os.ftruncate(self._fd, size)
        except BaseException:
            # The blocks of the old index are still allocated, so this works on a full disk too. If it fails all the
            # same, the copy of the index remains valid.
            with suppress(OSError):
                self._put(old.data_end, old.tail)
                os.ftruncate(self._fd, old_size)
            raise
        self._state = _state_of(start, block, data_end)

    def close(self) -> None:
        """Close the file; has no effect on a closed file."""
        fd, self._fd = self._fd, -1
        if fd >= 0:
            os.close(fd)

    def _put(self, offset: int, data: bytes) -> None:
        rest = memoryview(data)
        while rest:
            count = os.pwrite(self._fd, rest, offset)
            offset += count
            rest = rest[count:]


def _footer(summary_start: int) -> bytes:
    """Return footer and closing magic; the checksum 0 stands for "none"."""
    return _FOOTER.pack(_FOOTER_OPCODE, _FOOTER.size - 9 - len(_MAGIC), summary_start, 0, 0, _MAGIC)


def _state_of(start: int, block: bytes, data_end: int) -> _State:
    summary_start: int = _FOOTER.unpack(block[-_FOOTER.size :])[2]
    return _State(data_end, block[data_end - start :], summary_start)
