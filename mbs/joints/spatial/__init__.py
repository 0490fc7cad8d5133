"""Joints, one file for each type: its keys, its triads, where it puts one section on the other."""
