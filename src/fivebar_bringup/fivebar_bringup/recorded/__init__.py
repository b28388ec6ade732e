"""A run as it lies on the disk, and what follows from it."""
