"""Torque-only inputs: servo constraint, internal dynamics, stable inversion, the kind `motors-only`."""
