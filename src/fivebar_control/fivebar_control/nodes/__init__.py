# SPDX-License-Identifier: Apache-2.0
"""The ROS nodes of the control chain: thin adapters between messages and the plain Python of this package."""

from fivebar_description.ros_environment import require_middleware

require_middleware()
