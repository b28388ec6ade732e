"""A clock for deadlines on received messages that does not advance while this process is suspended.

When the operating system suspends a process, its deadlines expire although no sender is late: messages that came in
time are still queued. The clock continues from where the pause began, so that they can be processed first. The pause of
a node itself is detected by the nodes that wait for its answers.
"""

from __future__ import annotations

from collections.abc import Callable


class PauseCompensatedClock:
    """The time (s) of a steady clock minus the pauses of the process, which has to read it periodically."""

    def __init__(self, steady: Callable[[], float], longest: float) -> None:
        """Start at the steady clock's time; the interval between two readings counts for `longest` (s) at most."""
        self._steady = steady
        self._longest = longest
        self._last = steady()
        self._paused = 0.0

    def read(self) -> float:
        """Return the time (s)."""
        now = self._steady()
        self._paused += max(0.0, now - self._last - self._longest)
        self._last = now
        return now - self._paused
