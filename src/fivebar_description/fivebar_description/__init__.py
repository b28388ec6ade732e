"""What the robot is: its parameters, its URDF, its Pinocchio model and its ROS interface."""
