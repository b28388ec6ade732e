# SPDX-License-Identifier: Apache-2.0
"""A named fault: what every part that can stop the robot says about why."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_description.outside_text import one_line


class Fault(NamedTuple):
    """A named cause for zero torque, and what was seen. docs/reference/faults.md lists the names."""

    name: str
    detail: str

    def __str__(self) -> str:
        """Return the text that is published: the name, a colon, the detail."""
        return f"{self.name}: {self.detail}"

    @classmethod
    def from_text(cls, text: str) -> Fault:
        """Return the fault that a published text reports, whoever has published it."""
        name, _, detail = one_line(text).partition(": ")
        return cls(name, detail)
