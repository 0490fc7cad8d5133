"""Joints: their keys, constraints and coordinates."""
