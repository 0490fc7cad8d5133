"""Planar scenes by what they are about, short, and the same scenes in 3D: tables of both."""

import four_bar
import numpy as np
import scenes_in_3d
from beam_links import beam_link, rectangle
from checkpoints import CASES
from scenes_in_3d import CRANK, TWO_LINK

from ffrobot.mbs.fields.spelling import place

SHORT = {"end": 0.05, "output_step": 0.005}
INVERSE = {"name": "inverse", "kind": "pcid", "tolerance": 1e-10} | SHORT
STRAIGHT = {"name": "straight", "kind": "fcid", "shape": "zero"} | SHORT
STATIC = STRAIGHT | {"name": "static", "shape": "static"}
REST = {"name": "rest", "kind": "static"}
REPLAY = {"name": "replay", "kind": "forward", "actuation": "inverse", "apply": "joints", "tolerance": 1e-9}
LINEAR = {"name": "linear", "kind": "linear"}
MOVING = {"name": "moving", "kind": "linear", "about": "inverse", "times": [0.0, 0.05]}
MASS = [{"point": "link2.tip", "mass": 0.3}]
RIGID_GEAR = {"gear_ratio": 60.0, "rotor_inertia": 2e-4}
GEARS = ({"stiffness": 3e3, "damping": 2.0} | RIGID_GEAR, RIGID_GEAR)
LOOP = {
    "name": "loop", "kind": "closed-loop", "actuation": "inverse", "sample_time": 0.001, "delay": 0.0005,
    "tolerance": 1e-9,
}  # fmt: skip
TURN_CRANK = {"kind": "joint-pid", "proportional": {"O": 20.0}, "derivative": {"O": 0.5}}
PCID = {"kind": "pcid"}
SAME = ("pzt", "payload", "geometric_stiffening", "analysis", "load")  # spelled the same in both


def pair(case, *analyses, start=TWO_LINK, state="undeformed", patches=False, of_joints=(), **keys):
    """Tables of a case with other analyses and keys, in the plane and in 3D."""
    planar = scenes_in_3d.read(CASES / case / "scene.toml") | keys | {"analysis": list(analyses)}
    if not patches:
        planar.pop("pzt", None)
    for joint, own in zip(planar["joint"], of_joints, strict=False):
        joint |= own
    planar["initial"]["state"] = state
    same = {key: planar[key] for key in SAME if key in planar}
    return planar, scenes_in_3d.in_3d(planar) | {"initial": {"joints": start, "state": state}} | same


def rough_loop():
    """Friction and loads in all joints of a loop of rigid bars."""
    rough = {"viscous_friction": 0.3, "coulomb_friction": 0.2, "friction_speed": 0.05}
    joints = {name: rough | (RIGID_GEAR if name == "A" else {}) for name in "CABD"}
    loads = [{"joint": "C", "moment": "0.7*sin(5*t)"}, {"joint": "B", "moment": "0.4 + t"}]
    released = INVERSE | {"name": "released", "kind": "forward"}
    points = {"points": ["coupler.tip"]}
    of_both = joints, [INVERSE, REPLAY, released, REST, LINEAR | points, MOVING | points]
    return four_bar.planar(*of_both, load=loads), four_bar.in_3d(*of_both, load=loads)


def link(**keys):
    """The keys of a beam."""
    return beam_link(
        0.7, rectangle(0.01, 0.02), 12, nu=0.3,
        modes={"count": 3, "family": "in-plane-bending", "attachment_modes": False}
    ) | keys  # fmt: skip


def few_modes():
    """Explicit numbers, of which voltages serve those left out, too."""
    tables = pair("two_link", INVERSE, patches=True, state="static")
    return [of | {"body": [body | {"modes": 3} for body in of["body"]]} for of in tables]


def one_link(analysis, of_body=(), stiffened=False, **of_patches):
    """A link that turns about its root, with patches unless their count is 0."""
    law = "0.4 + 0.5*(10*(2*t)**3-15*(2*t)**4+6*(2*t)**5)"
    layout = {"length": 0.05, "width": 0.02, "thickness": 5e-4, "modulus": 63e9, "d31": 110e-12, "structural": False}
    layout |= {"body": "link", "count": 3} | of_patches
    planar = {
        "name": "turn", "space": "planar", "gravity": [0.0, -9.81],
        "body": [{"name": "link", "link": link(damping={"rayleigh": [0.0, 2e-4]})} | dict(of_body)],
        "joint": [{"name": "O", "type": "revolute", "between": ["ground", "link.root"]}],
        "payload": [{"point": "link.tip", "mass": 0.2}], "initial": {"state": "static", "angles": {"link": 0.4}},
        "trajectory": [{"name": "turn", "joint": "O", "value": law}],
        "pzt": [layout] if layout["count"] else [], "geometric_stiffening": stiffened,
        "analysis": [{"name": "inverse", "end": 0.5, "output_step": 0.01, "tolerance": 1e-7} | analysis],
    }  # fmt: skip
    joints = [scenes_in_3d.joint_keys(joint) for joint in planar["joint"]]
    start = {"state": "static", "joints": {"O": 0.4}}
    return planar, planar | {"space": "spatial", "gravity": place(planar["gravity"])} | {
        "joint": joints,
        "initial": start,
    }


FEATURES = {  # what is compared in any case, beside motion and moments; the scene; share of the peaks
    "analyses of two links": ("strain", lambda: pair("two_link", INVERSE, STRAIGHT, STATIC, REST, payload=MASS), 1e-8),
    "a loop": ("deflection", lambda: pair("slider_crank", INVERSE, start=CRANK), 1e-8),
    "gears that give between frames": (
        "frequency", lambda: pair("two_link", LINEAR, of_joints=GEARS[::-1], motors="frame"), 1e-6
    ),  # of responses at 0.2 rad/s, where round-off counts (38 000 / 0.2)² times
    "a controller of a loop of bodies": (
        "commands",
        lambda: pair(
            "slider_crank", INVERSE, LOOP | {"controller": [TURN_CRANK]}, start=CRANK,
            of_joints=[{"motor": True, "gear_ratio": 20.0, "rotor_inertia": 1e-5}],
        ), 1e-6,
    ),
    "friction in a loop": ("dissipated_power", rough_loop, 1e-8),
    "patches that stiffen": (
        "stiffness_ratio",
        lambda: one_link(PCID, structural=True, density=7800.0, face="both", limit=20.0), 1e-7,
    ),
    "motors alone": ("moment", lambda: one_link({"kind": "motors-only"}, count=0), 1e-5),
    "few modes": ("required_voltage", few_modes, 1e-7),
    "pieces": ("deflection", lambda: one_link({"kind": "pcid"}, {"pieces": 3}, stiffened=True), 1e-5),
}  # fmt: skip
COMPARED = (
    "coordinate", "rate", "moment", "reaction", "force", "modal", "modal_force", "position",
    "deflection", "target", "kinetic", "strain", "dissipated_power", "frequency", "motor_angle", "gear_moment",
    "required_voltage", "voltage", "commands", "wanted", "tip_error", "residual", "edges",
    "moment_per_volt", "stiffness_ratio", "authority",
)  # fmt: skip


def peaks(numbers):
    """Largest absolute value of each kind of dataset, by its last name."""
    found = {}
    for name, values in numbers.items():
        kind = name.rpartition("/")[2]
        found[kind] = max(found.get(kind, 0.0), np.abs(values).max())
    largest = max(found.get(kind, 0.0) for kind in ("force", "moment"))
    for kind, share in (("modal_force", 1.0), ("residual", 1e-3)):  # which may vanish
        found[kind] = max(found.get(kind, 0.0), share * largest)
    return found


def same_models(planar, spatial, share):
    """The same transfer from motors and forces in the plane to joints, motors and points."""
    outputs = ("joint/", "motor/", "point/")
    for in_plane, in_3d in zip(planar, spatial, strict=True):
        assert in_3d.freedom == in_plane.freedom
        sources = [name for name in in_plane.input_names if name in in_3d.input_names]
        targets = [name for name in in_plane.output_names if name in in_3d.output_names and name.startswith(outputs)]
        assert any(name.startswith("joint/") for name in sources)
        assert any(name.startswith("point/") for name in targets)
        omega = np.array([0.2, 3.0, 40.0, 700.0])
        expected, found = (model.frequency_response(omega, sources, targets) for model in (in_plane, in_3d))
        for k in range(len(omega)):
            np.testing.assert_allclose(found[k], expected[k], rtol=0, atol=share * np.abs(expected[k]).max())
