# SPDX-License-Identifier: Apache-2.0
"""The vendor's USB adapters for CAN FD, fdcanusb and mjcanfd-usb-1x, on their serial port.

Lines of text go both ways: `can send ID DATA FLAGS` is answered by OK or ERR, and `rcv ID DATA FLAGS` is a frame. Id
and data are hexadecimal; of the flags E says that the id has 29 bits, B that the bit rate is switched, F that it is a
frame of CAN FD. The adapters ignore the port's baud rate.
"""

from __future__ import annotations

import errno
import fcntl
import os
import select
import termios
import tty
from collections import deque

import can

LONGEST_LINE = 512
"""Number of bytes without the end of a line beyond which they are none."""


class FdcanusbBus(can.BusABC):
    """An adapter as an interface of python-can."""

    def __init__(self, channel: str) -> None:
        """Open the serial port.

        Raises:
            OSError: it cannot be opened.
        """
        self._port = os.open(channel, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            tty.setraw(self._port)
            fcntl.ioctl(self._port, termios.TIOCEXCL)
        except termios.error as error:
            os.close(self._port)
            raise OSError(errno.ENOTTY, "no serial port", channel) from error
        self.channel_info = channel
        self._rest = b""
        self._lines: deque[bytes] = deque()
        super().__init__(channel)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a frame.

        Raises:
            OSError: the adapter does not take it.
        """
        line = sent_line(msg)
        if os.write(self._port, line) < len(line):
            raise OSError(errno.EAGAIN, "the adapter does not take all of a frame")

    def shutdown(self) -> None:
        """Close the serial port."""
        super().shutdown()
        if self._port >= 0:
            os.close(self._port)
            self._port = -1

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self._lines and select.select([self._port], [], [], timeout)[0]:
            data = os.read(self._port, 4096)
            if not data:
                raise OSError(errno.EIO, "the adapter is gone")
            self._split(data)
        message = received(self._lines.popleft()) if self._lines else None
        return message, False

    def _split(self, data: bytes) -> None:
        *lines, rest = (self._rest + data).replace(b"\r", b"\n").split(b"\n")
        self._rest = rest if len(rest) <= LONGEST_LINE else b""
        self._lines.extend(line for line in lines if line)


def sent_line(message: can.Message) -> bytes:
    """Return the line that sends a frame."""
    flags = ("B" if message.bitrate_switch else "b") + ("F" if message.is_fd else "")
    return f"can send {message.arbitration_id:04x} {bytes(message.data).hex().upper()} {flags}\n".encode("ascii")


def received(line: bytes) -> can.Message | None:
    """Return the frame of a line, None for another line.

    Raises:
        can.CanOperationError: the adapter has not sent a frame, or the line cannot be read.
    """
    word, *fields = line.split()
    if word == b"ERR":
        raise can.CanOperationError(line.decode("latin1"))
    if word != b"rcv":
        return None
    try:
        number, data, *flags = fields
        return can.Message(
            arbitration_id=int(number, 16),
            data=bytes.fromhex(data.decode("ascii")),
            is_extended_id=b"E" in flags,
            is_fd=b"F" in flags,
            bitrate_switch=b"B" in flags,
        )
    except ValueError as error:
        raise can.CanOperationError(f"{line.decode('latin1')}: {error}") from error
