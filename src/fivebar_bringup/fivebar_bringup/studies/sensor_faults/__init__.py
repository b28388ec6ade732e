"""Faults of sensors on random crossings: what is survived, what is noticed, and by which name."""
