# SPDX-License-Identifier: Apache-2.0
"""Simulation of the five-bar robot: the Pinocchio plant, its sensors and emulated drives."""
