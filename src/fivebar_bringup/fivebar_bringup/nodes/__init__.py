"""ROS nodes around a run: recorder, process of composed nodes, run monitor, status and goal clients, benchmark."""
