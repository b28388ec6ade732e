# SPDX-License-Identifier: Apache-2.0
"""The workspace and its singular loci: pure kinematics on grids and curves."""
