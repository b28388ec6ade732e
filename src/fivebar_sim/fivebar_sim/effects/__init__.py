# SPDX-License-Identifier: Apache-2.0
"""Differences between a robot and its model: one module per effect, its settings beside compilable functions."""
