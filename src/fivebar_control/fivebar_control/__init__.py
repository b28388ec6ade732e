"""Model, control laws, trajectories, estimation and drive bridge of the five-bar robot."""
