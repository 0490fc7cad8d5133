"""What designs are sought for in these tests: a tube that swings, a cantilever under a force, a rigid arm."""

import csv

from beam_links import beam_link, rectangle, tube


def rows(path):
    """Of a table in CSV, by column."""
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


MODES = {"count": 2, "family": "in-plane-bending"}
FREE = MODES | {"attachment_modes": False}
TUBE = beam_link(0.6, tube(0.02, 0.016), 6, nu=0.3, name="arm", modes=FREE, damping={"ratio": 0.02})
SWING = {
    "name": "arm",
    "gravity": [0.0, -9.81],
    "body": [{"name": "arm", "link": TUBE}],
    "joint": [{"name": "shoulder", "type": "revolute", "between": ["ground", "arm.root"]}],
    "payload": [{"point": "arm.tip", "mass": 0.5}],
    "initial": {"state": "static"},
    "trajectory": [{"name": "swing", "joint": "shoulder", "value": "pi/4*(1 - cos(pi*t))"}],
    "analysis": [{"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.01}],
}

L, E, RHO, FORCE = 0.5, 70e9, 2700.0, 20.0
BEAM = beam_link(L, rectangle(0.02, 0.02), 2, nu=0.3, rho=RHO, name="beam", modes=MODES, damping={"ratio": 0.01}, E=E)
CANTILEVER = {
    "name": "cantilever",
    "gravity": [0.0, 0.0],
    "body": [{"name": "beam", "link": BEAM}],
    "joint": [{"name": "clamp", "type": "weld", "between": ["ground", "beam.root"]}],
    "load": [{"point": "beam.tip", "y": str(FORCE)}],
    "initial": {"state": "static"},
    "analysis": [{"name": "still", "kind": "static"}],
}

RIGID = {"mass": 2.0, "center": [0.3, 0.0], "inertia": 0.05, "points": {"root": [0.0, 0.0], "tip": [0.6, 0.0]}}
ARM = {
    "name": "arm",
    "gravity": [0.0, -9.81],
    "body": [{"name": "arm", "rigid": RIGID}],
    "payload": [{"point": "arm.tip", "mass": 0.5}],
    "joint": [{"name": "shoulder", "type": "revolute", "between": ["ground", "arm.root"]}],
    "trajectory": [{"name": "swing", "joint": "shoulder", "value": "t**2"}],
    "analysis": [{"name": "inverse", "kind": "pcid", "end": 0.5, "output_step": 0.05}],
}
MASS, PAYLOAD = "body.arm.rigid.mass", "payload.0.mass"
