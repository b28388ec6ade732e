"""The thesis' figures and claims made again: every run, what was measured, and a verdict that follows from a rule."""
