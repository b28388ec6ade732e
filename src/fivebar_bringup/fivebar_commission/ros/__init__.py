# SPDX-License-Identifier: Apache-2.0
"""The simulated robot of a practice by the clock, which speaks ROS."""
