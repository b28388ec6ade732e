# SPDX-License-Identifier: Apache-2.0
"""Identifies a robot from the bag of a run: reads the bag, fits, writes robot file, figures and page."""
