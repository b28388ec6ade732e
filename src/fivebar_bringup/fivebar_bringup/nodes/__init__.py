"""The ROS node that records a run."""
