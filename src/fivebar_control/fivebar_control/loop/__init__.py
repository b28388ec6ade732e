# SPDX-License-Identifier: Apache-2.0
"""The control cycle from measured state to torque command, shared by nodes, offline runner and engine."""
