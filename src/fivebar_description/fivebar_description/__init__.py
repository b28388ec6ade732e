# SPDX-License-Identifier: Apache-2.0
"""Description of the five-bar robot: parameters, URDF, Pinocchio model and ROS interface."""
