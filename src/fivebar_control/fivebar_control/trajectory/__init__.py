"""Reference motions: rest-to-rest polynomials through waypoints, and the planner that finds their crossings."""
