"""Parameters of the simulated plant, which the nodes of this package share."""
