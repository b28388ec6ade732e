"""The ROS nodes of the control chain: thin adapters between messages and the plain Python of this package."""
