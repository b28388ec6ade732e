"""The file of a run as the control chain reads it."""
