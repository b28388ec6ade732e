# SPDX-License-Identifier: Apache-2.0
"""Reproduces the figures and claims of the thesis: every run, the measured values, and verdicts by stated rules."""
