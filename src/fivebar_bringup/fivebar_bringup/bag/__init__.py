# SPDX-License-Identifier: Apache-2.0
"""Recordings: rosbag2 directories (`metadata.yaml` + `.mcap`), written, built and read back without ROS."""

RECORDER = "bag_recorder"
"""Name of the node that writes them."""
