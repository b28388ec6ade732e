# SPDX-License-Identifier: Apache-2.0
"""ROS nodes around a run: recorder, process of composed nodes, run monitor, goal client and scene."""

from fivebar_description.ros_environment import require_middleware

require_middleware()
