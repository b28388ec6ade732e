"""What happens between a measured state and its torque, written once: nodes, offline runner and engine call it."""
