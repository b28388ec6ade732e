# SPDX-License-Identifier: Apache-2.0
"""Reference motions: rest-to-rest polynomials through waypoints, and the planner that finds their crossings."""
