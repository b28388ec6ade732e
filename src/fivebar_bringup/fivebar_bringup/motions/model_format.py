# SPDX-License-Identifier: Apache-2.0
"""Formats of models of a robot."""

from __future__ import annotations

from enum import StrEnum


class ModelFormat(StrEnum):
    """A format of models."""

    MJCF = "mjcf"
    SDF = "sdf"
    URDF = "urdf"
