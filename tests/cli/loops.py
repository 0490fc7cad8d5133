"""Closed loops to be added to the two-link case."""

# With a controller from own.py beside the scene.
OWN_CONTROLLER = """
[[analysis]]
name = "loop"
kind = "closed-loop"
actuation = "inverse"
sample_time = 0.001
controller = [{ kind = "python", python = "own.py:controller" }]
sensor = [{ joint = "O" }]
"""
