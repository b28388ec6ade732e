# SPDX-License-Identifier: Apache-2.0
"""Shared by the nodes of this package: base class of the controllers, parameters, and the goal server."""
