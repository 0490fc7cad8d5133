"""Tables of arms in 3D with patches: a link, layouts of patches, an arm of a waist and a shoulder."""

from beam_links import beam_link, rectangle
from tables_3d import ORIGIN, Y, Z, revolute, rigid, scene

SEVEN = {"indices": [1, 2, 3, 4, 5, 6, 7], "family": "all"}
TWO_IN_EACH_PLANE = {"count": 2, "family": ["in-plane-bending", "out-of-plane-bending"]}


def link(modes):
    modes = modes | {"attachment_modes": False}
    return {"name": "link", "link": beam_link(0.4, rectangle(0.006, 0.012), 4, modes=modes, damping={"ratio": 0.01})}


def pzt(name, bends, **keys):
    return {
        "body": "link", "name": name, "bends": bends, "count": 4, "length": 0.06, "width": 0.005, "thickness": 0.5e-3,
        "modulus": 63e9, "d31": 110e-12, "density": 7600.0, "limit": 200.0,
    } | keys  # fmt: skip


def arm(*analyses, **tables):
    column = rigid("column", 1.0, [0.01] * 3, [0.0, 0.0, 0.1], top=[0.0, 0.0, 0.2])
    joints = [
        revolute("waist", "ground", "column.root", Z),
        revolute("shoulder", "column.top", "link.root", [-y for y in Y]),
    ]
    payload = [{"point": "link.tip", "mass": 0.1, "center": ORIGIN}]
    keys = {"payload": payload, "initial": {"joints": {"waist": 0.0, "shoulder": 0.0}}}
    return scene([column, link(TWO_IN_EACH_PLANE)], joints, *analyses, **keys | tables)
