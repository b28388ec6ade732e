# SPDX-License-Identifier: Apache-2.0
"""The choices of what a policy observes of a sample; `stepped_run` names the values."""

from __future__ import annotations

from enum import StrEnum


class Observation(StrEnum):
    """The encoders that a policy reads: on all joints, or on the motors alone."""

    ALL = "all"
    ENCODERS = "encoders"
