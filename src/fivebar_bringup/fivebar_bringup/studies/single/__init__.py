"""Studies of one question each, run as `python -m`."""
