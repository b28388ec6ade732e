"""The workspace and its singular loci: pure kinematics on grids and curves."""
