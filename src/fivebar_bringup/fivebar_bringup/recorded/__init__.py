# SPDX-License-Identifier: Apache-2.0
"""A run as it lies on the disk, and what follows from it."""
