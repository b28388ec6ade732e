"""Recordings: rosbag2 directories (`metadata.yaml` + `.mcap`), written, built and read back without ROS."""
