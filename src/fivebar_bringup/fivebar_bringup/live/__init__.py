"""The live page of a running graph: what it shows, what it accepts, and who may look."""
