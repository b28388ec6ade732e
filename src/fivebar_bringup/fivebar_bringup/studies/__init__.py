"""Studies over many runs: comparison, sweep, reproduction, map, identification, planned motions, benchmark."""
