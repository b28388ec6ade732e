# SPDX-License-Identifier: Apache-2.0
"""Calibrates the geometry of a five-bar: lengths, bases, encoder zeros, and the mounting of its IMU."""
