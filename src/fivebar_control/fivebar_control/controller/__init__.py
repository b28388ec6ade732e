# SPDX-License-Identifier: Apache-2.0
"""The controller of a motion as an object that answers readings with torques, for loops without ROS."""
