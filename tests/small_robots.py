"""Robots of studies: a tube that swings, a cantilever under a force, a rigid arm; and tables that studies write."""

import csv

from beam_links import beam_link, rectangle, tube
from tables_3d import joint, pin, planar


def rows(path):
    """Of a table in CSV, by column."""
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


MODES = {"count": 2, "family": "in-plane-bending"}
FREE = MODES | {"attachment_modes": False}
TUBE = beam_link(0.6, tube(0.02, 0.016), 6, nu=0.3, name="arm", modes=FREE, damping={"ratio": 0.02})
SHOULDER, HELD = pin("shoulder", "ground", "arm.root"), {"point": "arm.tip", "mass": 0.5}
SWING = planar(
    [{"name": "arm", "link": TUBE}],
    [SHOULDER],
    {"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.01},
    payload=[HELD],
    initial={"state": "static"},
    trajectory=[{"name": "swing", "joint": "shoulder", "value": "pi/4*(1 - cos(pi*t))"}],
)

L, E, RHO, FORCE = 0.5, 70e9, 2700.0, 20.0
BEAM = beam_link(L, rectangle(0.02, 0.02), 2, nu=0.3, rho=RHO, name="beam", modes=MODES, damping={"ratio": 0.01}, E=E)
CANTILEVER = planar(
    [{"name": "beam", "link": BEAM}],
    [joint("clamp", "weld", "ground", "beam.root")],
    {"name": "still", "kind": "static"},
    gravity=(0.0, 0.0),
    load=[{"point": "beam.tip", "y": str(FORCE)}],
    initial={"state": "static"},
)

RIGID = {"mass": 2.0, "center": [0.3, 0.0], "inertia": 0.05, "points": {"root": [0.0, 0.0], "tip": [0.6, 0.0]}}
ARM = planar(
    [{"name": "arm", "rigid": RIGID}],
    [SHOULDER],
    {"name": "inverse", "kind": "pcid", "end": 0.5, "output_step": 0.05},
    payload=[HELD],
    trajectory=[{"name": "swing", "joint": "shoulder", "value": "t**2"}],
)
MASS, PAYLOAD = "body.arm.rigid.mass", "payload.0.mass"
