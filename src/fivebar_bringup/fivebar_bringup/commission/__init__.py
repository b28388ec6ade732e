"""Leads from a box of parts to the first crossing: steps with a gate each, on real drives or on a simulated robot."""
