"""The pace of cycles without a control law, such as while drives are being enabled."""

from __future__ import annotations

import threading
import time


class CyclePace:
    """Waits from one cycle to the next."""

    def __init__(self, period: float) -> None:
        """Begin with a cycle at once; `period` is the time (s) between two."""
        self._period = period
        self._pause = threading.Event()
        self._next = 0.0

    def wait(self) -> None:
        """Wait until the next cycle is due."""
        now = time.monotonic()
        self._pause.wait(max(0.0, self._next - now))
        self._next = max(self._next, now) + self._period
