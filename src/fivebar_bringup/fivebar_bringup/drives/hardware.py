# SPDX-License-Identifier: Apache-2.0
"""The hardware that a run controls: the simulated robot, or drives."""

from __future__ import annotations

from enum import StrEnum


class Hardware(StrEnum):
    """The robot that is controlled: simulated, or on emulated or real drives, of which three kinds have a name."""

    SIMULATED = "simulated"
    EMULATED = "emulated"
    SOCKETCAN = "socketcan"
    USB = "usb"
    EXTERNAL = "external"
    REAL = "real"
