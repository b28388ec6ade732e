# SPDX-License-Identifier: Apache-2.0
"""Model, control laws, trajectories, estimation and drive bridge of the five-bar robot."""
