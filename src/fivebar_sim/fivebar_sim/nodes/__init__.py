"""The ROS node of the simulated robot: a thin adapter around the plant."""
