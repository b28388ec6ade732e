"""Shared by the nodes of this package: base class of the controllers, parameters, and the goal server."""
