# SPDX-License-Identifier: Apache-2.0
"""The file of a run as the control chain reads it."""
