"""What the nodes of this package share: parameters of the simulated plant."""
