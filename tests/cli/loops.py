"""Closed loops: to be added to the two-link case, and of a wheel."""

from tables_3d import pin, planar

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


def wheel(python, **loop):
    """Keys of a scene: a wheel in a closed loop with a controller in Python, FILE:FUNCTION."""
    body = {"mass": 1.0, "inertia": 0.5, "center": [0.0, 0.0], "points": {"root": [0.0, 0.0]}}
    closed = {"name": "loop", "kind": "closed-loop", "actuation": "inverse", "sample_time": 0.01, **loop}
    closed["controller"] = [{"kind": "python", "python": python}]
    inverse = {"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.01}
    keys = {"gravity": (0.0, 0.0), "trajectory": [{"name": "turn", "joint": "O", "value": "t**2"}]}
    return planar([{"name": "w", "rigid": body}], [pin("O", "ground", "w.root")], inverse, closed, **keys)
