"""What decides: the analytic model, the controllers, the trajectories, the estimators and the drive bridge."""
