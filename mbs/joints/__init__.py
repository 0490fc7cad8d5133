"""Joints, one file for each type: its keys, its constraints, its coordinate."""
