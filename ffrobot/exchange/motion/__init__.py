"""Motions of joints for other programs."""
