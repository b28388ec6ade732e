# SPDX-License-Identifier: Apache-2.0
"""The size of each of a robot's faults at which each controller first fails."""
