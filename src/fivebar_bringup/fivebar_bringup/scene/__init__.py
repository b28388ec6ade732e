# SPDX-License-Identifier: Apache-2.0
"""The robot, its loci and its motion as shapes in space, for pictures in RViz and Foxglove; plain geometry."""
