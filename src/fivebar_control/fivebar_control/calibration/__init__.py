"""Calibrates the geometry of a five-bar: lengths, bases, encoder zeros, and the mounting of its IMU."""
