# SPDX-License-Identifier: Apache-2.0
"""Identifies inertias, mass and friction of a five-bar from its motors' angles and torques."""
