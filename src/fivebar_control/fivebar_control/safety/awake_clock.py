"""A clock for deadlines on what others send: it stands still while this process does not run.

When a machine pauses a process, its deadlines pass although nobody is late: what was sent in time waits to be taken.
The clock goes on from where the pause began, so that there is time to take it. A node that watches others needs no
more: a pause of its own is the business of whoever waits for its answers.
"""

from __future__ import annotations

from collections.abc import Callable


class AwakeClock:
    """The time (s) of a steady clock less the pauses of whoever reads it often."""

    def __init__(self, steady: Callable[[], float], longest: float) -> None:
        """Begin at the steady clock's time; what lies between two readings counts for `longest` (s) at most."""
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
