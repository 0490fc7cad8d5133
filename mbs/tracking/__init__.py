"""Optimal control along a path: the problem, its solver, the kind `tracking`."""
