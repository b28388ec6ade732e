"""ROS nodes around a run: recorder, process of composed nodes, run monitor, goal client, scene and viewer."""

from fivebar_description.ros_environment import require_middleware

require_middleware()
