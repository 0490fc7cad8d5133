"""Closed loops: sampled controllers of motors and patches, and how well they do."""
