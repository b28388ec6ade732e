# SPDX-License-Identifier: Apache-2.0
"""A fixed set of crossings with rules of success, to compare controllers by, those of others included."""
