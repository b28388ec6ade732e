# SPDX-License-Identifier: Apache-2.0
"""Rigs: from which robots the studies draw, what their controllers measure, and with which settings; as files."""
