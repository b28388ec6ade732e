# SPDX-License-Identifier: Apache-2.0
"""Tells of a robot's file what its robot can do: where it goes and crosses, how exactly, and what to calibrate."""
