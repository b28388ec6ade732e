"""Description of the five-bar robot: parameters, URDF, Pinocchio model and ROS interface."""
