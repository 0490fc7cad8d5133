"""Numerical work on a system: positions, statics, vibration, linearisation, integrators, stable inversion."""
