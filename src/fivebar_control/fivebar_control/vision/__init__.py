"""The camera's view of the robot: tags, the platform's position, and the calibration of the camera."""
