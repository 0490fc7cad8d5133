"""Numerical work on a system: positions, statics, vibration, linearization, integrators, stable inversion."""
