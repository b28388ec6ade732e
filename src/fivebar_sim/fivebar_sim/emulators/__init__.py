# SPDX-License-Identifier: Apache-2.0
"""Emulated hardware as programs of their own."""
