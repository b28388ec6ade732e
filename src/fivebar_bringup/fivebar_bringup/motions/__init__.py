# SPDX-License-Identifier: Apache-2.0
"""Motions on request: from the robot's rest position to a goal in a given assembly mode."""
