"""Scenes whose results are kept: cases by their files, and what they leave out by functions that make short scenes."""

from functools import partial
from pathlib import Path

import numpy as np
import scenes_in_3d
from beam_links import beam_link, rectangle
from moved_scenes import tables_of
from random_robots import random_scene
from robots_3d import random_scene_in_3d
from tables_3d import pin, planar

import ffrobot

FOLDER = Path(__file__).parents[2] / "cases"
SHORT = {"end": 0.05, "output_step": 0.002}
TIGHT = SHORT | {"tolerance": 1e-9}
INVERSE = {"name": "inverse", "kind": "pcid"} | TIGHT
RELEASED = {"name": "released", "kind": "forward"} | TIGHT
AGAIN = {"name": "again", "kind": "forward", "actuation": "inverse", "apply": "trajectory", "tolerance": 1e-8}
STATIC = {"name": "rest", "kind": "static"}
SAGGING = {"name": "sagging", "kind": "fcid", "shape": "static"} | SHORT
LINEAR = {"name": "linear", "kind": "linear", "about": "inverse", "times": [0.0, 0.02]}
BUILT = {"viscous_friction": 0.3, "coulomb_friction": 0.2, "friction_speed": 0.5, "rotor_inertia": 1e-4,
         "gear_ratio": 30.0}  # fmt: skip
FRICTION = {"viscous_friction": 0.02, "coulomb_friction": 0.05, "friction_speed": 0.5}
GIVES = {"gear_ratio": 60.0, "rotor_inertia": 2e-4, "stiffness": 3e3, "damping": 2.0, "motor": True}
PD = {"kind": "joint-pid", "proportional": {"O": 500.0, "A": 100.0}, "derivative": {"O": 40.0, "A": 8.0}}
SOFT = {"kind": "joint-pid", "proportional": {"O": 20.0, "A": 5.0}, "derivative": {"O": 0.5, "A": 0.1}}
LQR = {"kind": "lqr", "inputs": "patches", "modes": 4, "deflection": 1e-4, "voltage": 200.0}
DAMPER = {"kind": "modal-velocity", "bodies": ["link1", "link2"], "modes": 2, "damping_ratio": 0.05, "sensor": "ideal"}
ENCODERS = [{"joint": "O", "resolution": 1e-5}, {"joint": "A", "resolution": 1e-5}]
BLOW = [{"point": "link2.tip", "y": "where(t < 0.02, 30*sin(pi*t/0.02), 0)"}]
LOOP = {"name": "loop", "kind": "closed-loop", "actuation": "inverse", "sample_time": 0.001, "delay": 0.0005,
        "disturbance": BLOW, "controller": [PD], "sensor": ENCODERS, "tolerance": 1e-8}  # fmt: skip
PATCHES = {"length": 0.05, "width": 0.02, "thickness": 5e-4, "modulus": 63e9, "d31": 110e-12, "density": 7600.0}
LINK = beam_link(0.5, rectangle(0.008, 0.02), 8, nu=0.3, damping={"ratio": 0.01})


def bending(count=3, **of_link):
    modes = {"count": count, "family": "in-plane-bending", "attachment_modes": False}
    return LINK | {"modes": modes} | of_link


def arm(*analyses, of_joints=(), of_bodies=(), **tables):
    """Two flexible links in the plane, whose tip follows a path."""
    bodies = [{"name": f"link{k}", "link": bending()} | dict(of_bodies) for k in (1, 2)]
    joints = [
        pin("O", "ground", "link1.root", **dict(of_joints)),
        pin("A", "link1.tip", "link2.root", **dict(of_joints)),
    ]
    path = {"name": "tip", "point": "link2.tip", "x": "0.80889 - 8*t**2", "y": "0.16397 + 6*t**2"}
    keys = {"initial": {"state": "static", "angles": {"link1": -0.4, "link2": 0.8}}, "trajectory": [path]}
    return ffrobot.make_scene(**planar(bodies, joints, *analyses, **keys | tables))


def patched(**layout):
    return [{"body": f"link{k}", "count": 3} | PATCHES | layout for k in (1, 2)]


def slider_crank(of_joints):
    tables = scenes_in_3d.read(FOLDER / "slider_crank" / "scene.toml") | {"analysis": [INVERSE, RELEASED]}
    tables["joint"] = [one | of_joints.get(one["name"], {}) for one in tables["joint"]]
    moments = {"O": 0.2, "guide": 0.1, "B": 0.3}
    return ffrobot.make_scene(**tables, load=[{"joint": j, "moment": f"{m}*sin(30*t)"} for j, m in moments.items()])


def spring(t, position, velocity):
    return -40.0 * (position - np.array([0.8, 0.2])) - 0.8 * velocity


LOADS = [{"point": "link2.mid", "x": "3*t", "moment": "0.5"}, {"joint": "A", "moment": "2*sin(30*t)"}]
UNDEFORMED = {"state": "undeformed", "angles": {"link1": -0.4, "link2": 0.8}}
LET_GO = {"initial": UNDEFORMED, "trajectory": []}
IN_PIECES = {"pieces": 2, "link": bending(damping={"rayleigh": [0.0, 1e-5]})}
GRIPPER = [{"point": "link2.tip", "mass": 0.3, "inertia": 2e-3}]
PLANAR = {
    "arm": partial(arm, INVERSE, AGAIN, STATIC, SAGGING),
    "arm_with_attachment_modes": partial(arm, INVERSE, AGAIN, of_bodies={"link": bending(modes={"count": 3})}),
    "arm_released": partial(arm, RELEASED, load=LOADS, **LET_GO),
    "arm_as_built": partial(
        arm, INVERSE, AGAIN | {"apply": "joints"}, SAGGING, of_joints=BUILT, load=LOADS, payload=GRIPPER
    ),
    "arm_with_gears": partial(arm, INVERSE, AGAIN | {"apply": "joints"}, LINEAR, of_joints=GIVES),
    "arm_with_frame_motors": partial(arm, INVERSE, SAGGING, motors="frame", pzt=patched()),
    "arm_with_patches": partial(
        arm, INVERSE, AGAIN | {"apply": "joints+pzt"}, SAGGING, pzt=patched(structural=True, limit=100.0)
    ),
    "arm_under_control": partial(
        arm, INVERSE, LOOP | {"controller": [SOFT]}, LOOP | {"name": "patches", "controller": [SOFT, DAMPER]}, LINEAR,
        pzt=patched(),
    ),
    "arm_by_motors_only": partial(
        arm, {"name": "exact", "kind": "motors-only", "end": 0.4, "output_step": 0.004},
        trajectory=[{"name": "tip", "point": "link2.tip", "via": [[0.80889, 0.16397], [0.83, 0.2]], "duration": 0.4}],
    ),
    "arm_stiffened": partial(
        arm, INVERSE, RELEASED, initial=UNDEFORMED, geometric_stiffening=True, payload=GRIPPER
    ),
    "arm_in_pieces": partial(
        arm, INVERSE, RELEASED, of_bodies=IN_PIECES, initial=UNDEFORMED, pzt=patched(structural=False)
    ),
    "arm_with_modes_as_needed": partial(
        arm, INVERSE | {"tolerance": 1e-5}, of_bodies={"modes": "auto", "link": bending(8)}
    ),
    "arm_checked": partial(arm, INVERSE | {"check": "finer"}),
    "arm_on_a_spring": partial(arm, RELEASED, load=[{"point": "link2.tip", "force": spring}], **LET_GO),
    "loop_with_friction": partial(slider_crank, dict.fromkeys(("O", "A", "B", "guide"), FRICTION)),
    **{f"random_{k}": lambda k=k: random_scene(3717, k)[1] for k in (*range(4), *range(6, 12))},
}  # fmt: skip


def arm_in_3d(*analyses, checkpoint="arm3_line_static", of_joints=(), of_bodies=(), **tables):
    """The arm of a checkpoint with other analyses."""
    found = tables_of(checkpoint, 1e-8)
    found["joint"] = [one | dict(of_joints) for one in found["joint"]]
    found["body"] = [body | (dict(of_bodies) if "link" in body else {}) for body in found["body"]]
    return ffrobot.make_scene(**found | {"analysis": list(analyses)} | tables)


def planar_case_in_3d(case, *analyses, **tables):
    """A planar case with its patches put into space."""
    planar = scenes_in_3d.read(FOLDER / case / "scene.toml")
    found = scenes_in_3d.in_3d(planar) | {"pzt": planar.get("pzt", [])}
    joints = scenes_in_3d.CRANK if case == "slider_crank" else scenes_in_3d.TWO_LINK
    return ffrobot.make_scene(**found | {"initial": {"joints": joints}, "analysis": list(analyses)} | tables)


SPATIAL = {
    "arm_in_3d": partial(arm_in_3d, INVERSE, AGAIN, STATIC, SAGGING, LINEAR),
    "arm_in_3d_as_built": partial(
        arm_in_3d, INVERSE, AGAIN | {"apply": "joints"}, SAGGING, of_joints=BUILT,
        payload=[{"point": "fore.tip", "mass": 0.2, "inertia": [1e-3, 2e-3, 1.5e-3]}],
        load=[{"point": "upper.tip", "x": "3*t", "my": "0.5"}, {"joint": "q2", "moment": "sin(30*t)"}],
    ),
    "arm_in_3d_with_gears": partial(arm_in_3d, INVERSE, AGAIN | {"apply": "joints"}, of_joints=GIVES),
    "arm_in_3d_with_frame_motors": partial(arm_in_3d, INVERSE, SAGGING, motors="frame"),
    "arm_in_3d_stiffened": partial(arm_in_3d, INVERSE, AGAIN, SAGGING, geometric_stiffening=True),
    "tool_axis": partial(arm_in_3d, INVERSE, AGAIN, checkpoint="arm5_tool_axis"),
    "pose": partial(arm_in_3d, INVERSE, SAGGING, checkpoint="arm6_static"),
    "stanford": partial(arm_in_3d, INVERSE, AGAIN | {"apply": "joints"}, STATIC, checkpoint="stanford"),
    "patches_in_3d": partial(
        planar_case_in_3d, "two_link_patched", INVERSE, AGAIN | {"apply": "joints+pzt"}, SAGGING
    ),
    "control_in_3d": partial(
        planar_case_in_3d, "two_link_closed_loop", INVERSE, LOOP, LOOP | {"name": "patches", "controller": [PD, LQR]}
    ),
    "loop_in_3d": partial(planar_case_in_3d, "slider_crank", INVERSE, RELEASED),
    **{f"random_in_3d_{k}": lambda k=k: random_scene_in_3d(3717, k, [("a", 1e-7, "dop853")], 60_000)[1]
       for k in range(8)},
}  # fmt: skip
MADE = PLANAR | SPATIAL
"""By name, functions without arguments that make a scene."""
MORE = {name for name in MADE if name.startswith("random") and name[-1] not in "01"}
"""Random scenes beside which others are enough by day."""
CASES = {
    path.parent.name if path.stem == "scene" else f"{path.parent.name}_{path.stem}": path
    for path in sorted(FOLDER.glob("*/*.toml"))
    if "[[analysis]]" in path.read_text(encoding="utf-8")
}
"""Scene files of the cases."""
NIGHTLY = {
    "arm_6r", "lightened_arm", "lightest_arm_solid", "soft_arm_tracking", "two_link_closed_loop", "two_link_points",
    "two_link_rest_to_rest", "two_link_solid", "two_link_split", "two_link_tracking",
}  # fmt: skip
"""Cases that take long, beside which there is a shorter one of the same kind."""
