"""Motions on request: from where the robot rests to a place in a named assembly mode."""
