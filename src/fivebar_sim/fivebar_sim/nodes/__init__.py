# SPDX-License-Identifier: Apache-2.0
"""The ROS node of the simulated robot: a thin adapter around the plant."""

from fivebar_description.ros_environment import require_middleware

require_middleware()
