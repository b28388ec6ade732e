"""The simulated robot of a practice by the clock, which speaks ROS."""
