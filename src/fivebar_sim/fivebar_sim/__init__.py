"""Simulation of the five-bar robot: the Pinocchio plant, its sensors and emulated drives."""
