"""What pretends to be the robot: the Pinocchio plant, its sensors and emulated drives."""
