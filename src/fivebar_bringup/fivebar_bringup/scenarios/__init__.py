# SPDX-License-Identifier: Apache-2.0
"""Scenario files: found, read and checked."""
