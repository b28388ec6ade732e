# SPDX-License-Identifier: Apache-2.0
"""The same motions with every controller, side by side: on an exact robot, and on rigs with what real ones have."""
