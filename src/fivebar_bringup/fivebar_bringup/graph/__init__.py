"""The node graph of a run."""
