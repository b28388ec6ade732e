"""ROS nodes around a run: recorder, process of composed nodes, run monitor, status and goal clients, benchmark."""

from fivebar_description.ros_environment import require_middleware

require_middleware()
