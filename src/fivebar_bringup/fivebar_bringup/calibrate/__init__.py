# SPDX-License-Identifier: Apache-2.0
"""Calibrates a robot's geometry from the bag of a motion: reads the bag, fits, writes robot file, figures and page."""
