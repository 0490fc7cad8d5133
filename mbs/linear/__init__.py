"""A robot at rest: static equilibria, linear equations, vibration, poses."""
