"""An emulated motor board with the bench's USB protocol, which moves the simulated robot. No ROS in here."""
