"""Identifies a robot from the bag of a run: reads the bag, fits, writes parameter file, figures and page."""
