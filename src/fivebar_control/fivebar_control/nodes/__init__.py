"""The ROS nodes of the controller: thin adapters between messages and the plain Python beside them."""
