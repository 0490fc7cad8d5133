"""To and from other programs: robot descriptions, bodies, trajectories."""
