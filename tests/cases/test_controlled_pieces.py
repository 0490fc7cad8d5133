"""Links in pieces in 3D in linear models and closed loops: as in the plane, and as the one link where it is stiff."""

import numpy as np
import pytest
from scenes_in_3d import joint_keys

import ffrobot
from ffrobot.mbs.fields.spelling import place
from ffrobot.mbs.quantities.motion import RobotMotion
from ffrobot.run.solve import solve_scene
from ffrobot.run.watcher import Watcher
from ffrobot.run.whole_links import make_whole_links

S = "(10*t**3-15*t**4+6*t**5)"
CONDITIONS = {"link1": "simply-supported", "link2": "cantilever"}
INVERSE = {"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.01, "tolerance": 1e-8}
REST = {"name": "rest", "kind": "linear", "points": ["link2.tip", "link1.tip"]}
MOVING = {"name": "moving", "kind": "linear", "about": "inverse", "times": [0.0, 0.1]}
LOOP = {
    "name": "loop", "kind": "closed-loop", "end": 0.1, "output_step": 0.01, "tolerance": 1e-6, "sample_time": 1e-3,
    "actuation": "inverse", "unlimited": True, "tip": "link2.tip",
    "disturbance": [{"point": "link2.tip", "y": "5.0*sin(10*pi*t)**2"}],
    "sensor": [{"point": "link2.tip"}, {"modal": "link1"}, {"modal": "link2"}],
    "controller": [
        {"kind": "joint-pid", "proportional": {"O": 5.0, "A": 1.0}, "derivative": {"O": 0.05, "A": 0.01}}
    ],
}  # fmt: skip
LQR = {"kind": "lqr", "modes": 2, "moment": 0.1, "voltage": 10.0, "angle": 0.2, "rate": 2.0, "deflection": 0.05}
DESIGN = LOOP | {"name": "design", "controller": [LQR], "end": 0.003, "output_step": 0.001}


PATCHES = {"count": 4, "length": 0.12, "width": 0.02, "thickness": 5e-4, "modulus": 63e9, "d31": 1.1e-10} | {
    "allocation": "least-squares", "structural": ["stiffness"]
}  # fmt: skip
PATCHED = [{"body": name, **PATCHES} for name in CONDITIONS]
REPLAY = {"name": "replay", "kind": "forward", "actuation": "inverse", "apply": "joints+pzt"} | {
    "end": 0.1, "output_step": 0.01, "tolerance": 1e-8
}  # fmt: skip


def arm(pieces, analyses, family="in-plane-bending", count=4, **changes):
    """Two planar links whose joints are driven, from equilibrium."""
    link = {
        "name": "link",
        "material": {"youngs_modulus": 7e10, "poissons_ratio": 0.3, "density": 2700.0},
        "geometry": {"kind": "beam", "length": 1.0, "section": {"shape": "rectangle", "height": 0.01, "width": 0.02}},
        "mesh": {"elements": 12},
        "modes": {"count": count, "family": family},
        "damping": {"rayleigh": [0.0, 2e-4]},
    }
    divided = {} if pieces is None else {"pieces": pieces}
    return {
        "name": "arm",
        "space": "planar",
        "gravity": [0.0, -9.81],
        "geometric_stiffening": True,
        "body": [
            {"name": name, "link": link | {"reference": {"condition": condition}}, **divided}
            for name, condition in CONDITIONS.items()
        ],
        "joint": [
            {"name": "O", "type": "revolute", "between": ["ground", "link1.root"]},
            {"name": "A", "type": "revolute", "between": ["link1.tip", "link2.root"]},
        ],
        "payload": [{"point": "link2.tip", "mass": 0.2}],
        "initial": {"state": "static", "angles": {"link1": 0.1, "link2": 0.6}},
        "trajectory": [
            {"name": "first", "joint": "O", "value": f"0.1+0.4*{S}"},
            {"name": "second", "joint": "A", "value": f"0.5-0.6*{S}"},
        ],
        "analysis": analyses,
    } | changes


def in_3d(tables, **changes):
    return tables | {
        "space": "spatial",
        "gravity": place(tables["gravity"]),
        "joint": [joint_keys(joint) for joint in tables["joint"]],
        "initial": {"state": "static", "joints": {"O": 0.1, "A": 0.5}},
    } | changes  # fmt: skip


@pytest.fixture(scope="module")
def both():
    """Solutions of the arm with its links in three pieces, in the plane and in 3D."""
    tables = arm(
        3, [INVERSE, REST, MOVING, LOOP | {"sensor": [*LOOP["sensor"], {"pzt": "link2"}]}, DESIGN], pzt=PATCHED
    )
    plane, space = (ffrobot.make_scene(**of) for of in (tables, in_3d(tables)))
    return solve_scene(plane, Watcher()), solve_scene(space, Watcher())


def test_linear_models_are_those_of_the_plane(both):
    """Poles, names, and what motors and forces do to joints and points, at rest and in motion."""
    for name, share in (("rest", 1e-7), ("moving", 1e-4)):
        plane, space = both[0].outcomes[name].details, both[1].outcomes[name].details
        for in_plane, of_space in zip(plane.models, space.models, strict=True):
            sources, targets = (
                [each for each in of if not each.startswith("modal/")]
                for of in (in_plane.input_names, in_plane.output_names)
            )
            assert set(targets) <= set(of_space.output_names)
            for omega in (0.3, 20.0, 300.0):
                expected, found = (
                    model.frequency_response(np.array([omega]), sources, targets) for model in (in_plane, of_space)
                )
                np.testing.assert_allclose(found, expected, rtol=0, atol=share * np.abs(expected).max())
        for of_plane, modes in zip(plane.modes, space.modes, strict=True):
            np.testing.assert_allclose(modes.frequency, of_plane.frequency, rtol=share, atol=1e-5)


def test_controllers_know_the_whole_links(both):
    """Modal coordinates of these, their rates and accelerations along the motion, as the plane tells them."""
    told, found = (make_whole_links(of).as_links(of.outcomes["inverse"]) for of in both)
    for node, of_plane in zip(found.model.tree.nodes, told.model.tree.nodes, strict=True):
        to_file, in_plane = node.body.modal_transform.T, of_plane.body.modal_transform.T
        for share, values, expected in (
            (1e-4, found.q[:, node.p_q], told.q[:, of_plane.p_q]),
            (1e-4, found.v[:, node.p_v], told.v[:, of_plane.p_v]),
            (5e-3, found.a[:, node.p_v], told.a[:, of_plane.p_v]),
        ):
            of_link = expected @ in_plane
            np.testing.assert_allclose(values @ to_file, of_link, atol=share * np.abs(of_link).max())
    t = found.time
    s = 10 * t**3 - 15 * t**4 + 6 * t**5
    for node, path in zip(found.model.tree.nodes, (0.1 + 0.4 * s, 0.5 - 0.6 * s), strict=True):
        np.testing.assert_allclose(found.q[:, node.q][:, 0], path, atol=1e-9)


def test_a_closed_loop_reads_what_it_does_in_the_plane(both):
    """Sensors of joints, points and modes."""
    plane, space = (of.outcomes["loop"].details for of in both)
    assert {of.outcomes[name].status for of in both for name in ("loop", "design")} == {"completed"}
    assert [name for name in space.outputs if not name.endswith("/z")] == list(plane.outputs)
    for name, share in (
        ("joint/A", 1e-4),
        ("point/link2.tip/y", 1e-5),
        ("modal/link1/1", 1e-3),
        ("modal/link2/1", 1e-3),
        ("pzt/link2/2", 1e-3),
    ):
        found, expected = (of.readings[:, list(of.outputs).index(name)] for of in (space, plane))
        np.testing.assert_allclose(found, expected, atol=share * np.abs(expected).max(), err_msg=name)


def test_patches_across_cuts_are_those_of_the_plane():
    """Voltages for a path of the tip, from rest, and what they do to the arm again.

    Of 0.12 m, in the middle of each quarter of the link: two of four are across cuts.
    """
    path = [{"name": "tip", "point": "link2.tip", "x": f"1.82-0.2*{S}", "y": f"0.66+0.2*{S}"}]
    tables = arm(3, [INVERSE, REPLAY], pzt=PATCHED, trajectory=path)
    plane = solve_scene(ffrobot.make_scene(**tables), Watcher())
    space = solve_scene(ffrobot.make_scene(**in_3d(tables)), Watcher())
    for link in CONDITIONS:
        expected, found = (of.analyses["inverse"].actuation.voltages[link] for of in (plane, space))
        assert np.abs(expected.required).max() > 10.0
        a, b = expected.required, found.required
        np.testing.assert_allclose(b[0], a[0], rtol=0, atol=1e-8 * np.abs(a[0]).max())
        np.testing.assert_allclose(b, a, rtol=0, atol=1e-3 * np.abs(a).max())
    inverse, replay = (place_of_tip(space.outcomes[name]) for name in ("inverse", "replay"))
    assert np.linalg.norm(replay - inverse, axis=1).max() < 2e-5  # what four patches leave of static shapes vibrates


def place_of_tip(run):
    """(T, 3) of the end of the last piece, m."""
    return RobotMotion(run.model, run.time, run.q, run.v, run.a, run.multipliers).point("link2, piece 3.tip").position


def test_an_arm_that_bends_in_both_planes_and_twists():
    """In pieces and whole: frequencies, shapes of links, and a loop whose controller is designed for whole links.

    Without gravity: sag couples bending and twist of pieces, but not of the one link, whose file does not say so.
    """
    axes = {"O": [0.0, 0.6, 0.8], "A": [0.0, 0.0, 1.0]}
    found = []
    for pieces in (None, 3):
        tables = arm(pieces, [INVERSE, REST, DESIGN], ["in-plane-bending", "out-of-plane-bending", "torsion"], 12)
        payload = [{"point": "link2.tip", "mass": 0.2, "center": [0.0, 0.05, 0.02]}]
        tables = in_3d(tables, gravity=[0.0, 0.0, 0.0], payload=payload)
        tables["joint"] = [joint | {"axis": axes[joint["name"]]} for joint in tables["joint"]]
        found.append(ffrobot.solve(ffrobot.make_scene(**tables)))
    with found[0] as one, found[1] as two:
        expected, frequency = (of["rest/linear/frequency"][0, :9] for of in (one, two))
        np.testing.assert_allclose(frequency[2:], expected[2:], rtol=2e-3)
        assert sorted(one.names("rest/linear/modes/link2")) == sorted(two.names("rest/linear/modes/link2"))
        for mode in range(2, 5):
            shapes = [of["rest/linear/modes/link2/modal"][0, mode, :4] for of in (one, two)]
            cosine = shapes[0] @ shapes[1] / np.prod([np.linalg.norm(shape) for shape in shapes])
            assert abs(cosine) == pytest.approx(1.0, abs=2e-3)
        for joint in "OA":
            commands = [of[f"design/joints/{joint}/moment"] for of in (one, two)]
            np.testing.assert_allclose(*commands, atol=1e-2 * np.abs(commands[0]).max())
