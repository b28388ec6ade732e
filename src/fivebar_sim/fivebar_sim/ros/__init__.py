# SPDX-License-Identifier: Apache-2.0
"""Parameters of the simulated plant, which the nodes of this package share."""
