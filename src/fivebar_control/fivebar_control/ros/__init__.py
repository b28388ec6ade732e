"""What the nodes of this package share: their common base for controllers, parameters, and the goal server."""
