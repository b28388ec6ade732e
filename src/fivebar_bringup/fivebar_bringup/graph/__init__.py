# SPDX-License-Identifier: Apache-2.0
"""The node graph of a run."""
