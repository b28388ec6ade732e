# SPDX-License-Identifier: Apache-2.0
"""Estimates a recorded motion again, with other settings: reads the bag, replays it, writes figure and page."""
