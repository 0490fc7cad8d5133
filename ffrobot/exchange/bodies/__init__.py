"""Flexible bodies in the formats of other programs."""
