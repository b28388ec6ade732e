"""Identifies a robot from the bag of a run: reads it, solves, writes parameter file, figures and page."""
