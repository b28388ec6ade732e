"""The simulated camera: pictures of the robot, rendered on the processor."""
