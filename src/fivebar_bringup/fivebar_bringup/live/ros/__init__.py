"""What the live page gets from a running graph, and what it hands over to it."""
