"""Frames of tools: position, orientation and compliance by closed forms, and by the same robot without a tool."""

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from scipy.spatial.transform import Rotation
from tables_3d import ORIGIN, X, Y, Z, pin, planar, revolute, rigid, scene

from ffrobot import make_scene, solve
from ffrobot.common.errors import InputError
from ffrobot.mbs.model.body import bent_section
from ffrobot.run.solve import prepare_scene

RPY = (0.4, -0.7, 1.1)
REST = {"name": "rest", "kind": "static"}
E, HEIGHT, LENGTH, BEYOND = 70e9, 0.02, 0.6, 0.25


def turned(rpy):
    return Rotation.from_euler("xyz", rpy).as_matrix()


def wrist(**keys):
    """Three axes through one point on a column: any orientation of the last body."""
    bodies = [rigid(name, 1.0, (0.01, 0.012, 0.009), [0.0, 0.0, 0.05], end=[0.1, 0.0, 0.2]) for name in "abc"]
    sides = (("a", "ground", Z), ("b", "a.end", Y), ("c", "b.end", X))
    tables = scene(
        bodies, [revolute(f"to_{name}", side, f"{name}.root", axis) for name, side, axis in sides],
        {"name": "move", "kind": "pcid", "end": 0.5, "output_step": 0.05, "tolerance": 1e-10},
        tool=[tool()], initial={"joints": {"to_a": 0.3, "to_b": 0.5, "to_c": -0.4}},
    )  # fmt: skip
    return make_scene(**(tables | keys))


def tool(**keys):
    return {"name": "gripper", "point": "c.end", "at": [0.05, -0.02, 0.15], "rpy": list(RPY)} | keys


def rotations_of(results):
    """Rotations of the three bodies over time, by the coordinates of their joints."""
    q = [results[f"move/joints/to_{name}/coordinate"].ravel() for name in "abc"]
    one, two = Rotation.from_euler("z", q[0]), Rotation.from_euler("z", q[0]) * Rotation.from_euler("y", q[1])
    return one, two, two * Rotation.from_euler("x", q[2])


def test_the_orientation_of_a_tool_follows_its_path():
    """A path of a tool is that of its body turned back by the tool's rpy: the same angles of the joints."""
    path = [f"{0.2 * k} + 0.3*t**2" for k in range(1, 4)]
    with solve(wrist(trajectory=[{"name": "turn", "point": "c.gripper", "rpy": path}])) as of_tool:
        (one, two, A), times = rotations_of(of_tool), of_tool["move/time"]
        place = of_tool["move/points/c.gripper/position"]
    wanted = Rotation.from_euler("xyz", np.array([0.2, 0.4, 0.6]) + 0.3 * times[:, None] ** 2)
    np.testing.assert_allclose((A * Rotation.from_matrix(turned(RPY))).as_matrix(), wanted.as_matrix(), atol=1e-9)
    end = np.array([0.1, 0.0, 0.2])
    expected = one.apply(end) + two.apply(end) + A.apply([0.15, -0.02, 0.35])
    np.testing.assert_allclose(place, expected, atol=1e-9)


def test_a_direction_of_a_tool_is_in_its_axes():
    """z of the tool along a given direction: two equations, exact."""
    keys = {"name": "point", "point": "c.gripper", "tool_axis": [0.0, 0.0, 1.0], "direction": ["0.2", "t", "1"]}
    held = {"name": "held", "joint": "to_a", "value": "0.3"}
    with solve(wrist(trajectory=[keys, held])) as results:
        (*_, A), times = rotations_of(results), results["move/time"]
    along = A.apply(turned(RPY)[:, 2])
    wanted = np.stack([np.full_like(times, 0.2), times, np.ones_like(times)], axis=1)
    np.testing.assert_allclose(along, wanted / np.linalg.norm(wanted, axis=1)[:, None], atol=1e-9)


def test_payloads_and_joints_on_a_tool_are_in_its_axes():
    """The same torques as with center and inertia turned by hand, and as with a body welded there by its rpy."""
    F, center, inertia = turned(RPY), np.array([0.02, 0.01, 0.1]), np.diag([0.02, 0.03, 0.015])
    paths = [{"name": n, "joint": f"to_{n}", "value": f"0.3 + {k}*t**3"} for k, n in enumerate("abc", 1)]
    at_tool = {"point": "c.gripper", "mass": 2.0, "center": center.tolist(), "inertia": inertia.tolist()}
    by_hand = {"point": "c.end", "mass": 2.0, "center": ([0.05, -0.02, 0.15] + F @ center).tolist(),
               "inertia": (F @ inertia @ F.T).tolist()}  # fmt: skip
    plain = wrist(trajectory=paths)
    bodies = [*({"name": b.name, "rigid": b.rigid.model_dump(exclude_unset=True)} for b in plain.body),
              rigid("extra", 2.0, inertia.tolist(), center)]  # fmt: skip
    joints = [joint.model_dump(exclude_unset=True) for joint in plain.joint]
    weld = {"name": "weld", "type": "weld", "between": ["c.gripper", "extra.root"]}
    found = []
    for keys in (
        {"payload": [at_tool]},
        {"payload": [by_hand], "tool": []},
        {"body": bodies, "joint": [*joints, weld]},
    ):
        with solve(wrist(trajectory=paths, **keys)) as results:
            found.append(np.array([results[f"move/joints/to_{name}/moment"].ravel() for name in "abc"]))
    np.testing.assert_allclose(found[0], found[1], rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(found[0], found[2], rtol=1e-9, atol=1e-9)


def link(elements=20, count=4, family="in-plane-bending"):
    modes = {"count": count, "family": family}
    return beam_link(LENGTH, rectangle(HEIGHT, 0.03), elements, nu=0.3, name="strip", modes=modes)


def test_compliance_at_a_tool_beyond_the_tip():
    """A rigid nose on a cantilever: ∫ (L + d − x)²/EI dx across, L/EI in rotation; in the tool's axes, by F Cᵀ Fᵀ."""
    EI = E * 0.03 * HEIGHT**3 / 12
    a = LENGTH + BEYOND
    across, mixed = (a**3 - BEYOND**3) / (3 * EI), (a**2 - BEYOND**2) / (2 * EI)
    C = np.array([[0.0, 0.0, 0.0], [0.0, across, mixed], [0.0, mixed, LENGTH / EI]])
    c, s = np.cos(0.6), np.sin(0.6)
    own = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    tables = planar(
        [{"name": "strip", "link": link()}], [pin("hub", "ground", "strip.root")], REST, gravity=[0.0, 0.0],
        tool=[{"name": "nose", "point": "strip.tip", "at": [BEYOND, 0.0], "angle": 0.6}],
        initial={"joints": {"hub": 0.4}}, trajectory=[{"name": "still", "joint": "hub", "value": "0.4"}],
    )  # fmt: skip
    with solve(make_scene(**tables)) as results:
        assert results.has("rest/joints_locked/compliance/strip.tip")
        found = results["rest/joints_locked/compliance/strip.nose"][0]
    np.testing.assert_allclose(found, own @ C @ own.T, rtol=1e-8, atol=1e-14)


@pytest.mark.parametrize("arm", [(0.0, 0.0, 0.2), (0.1, -0.05, 0.15)])
def test_the_bent_place_of_a_tool_is_exact_to_second_order(arm):
    """With geometric stiffening, u = u_tip + exp(φ~) d but for terms of third order: an eighth of half the bending."""
    blade = link(10, 6, ["in-plane-bending", "out-of-plane-bending", "torsion"])
    tables = scene(
        [{"name": "strip", "link": blade}], [revolute("hub", "ground", "strip.root")], REST, gravity=ORIGIN,
        geometric_stiffening=True, tool=[{"name": "nose", "point": "strip.tip", "at": list(arm)}],
    )  # fmt: skip
    body = prepare_scene(make_scene(**tables)).model.tree.nodes[0].body
    p = np.random.default_rng(3).normal(size=body.n_modes) / np.sqrt(body.stiffness)
    off = []
    for size in (0.1, 0.05):
        tip, nose = (bent_section(body, name, size * p) for name in ("tip", "nose"))
        off.append(np.linalg.norm(nose.u - tip.u - Rotation.from_rotvec(tip.phi).apply(arm)))
    assert off[1] < 0.14 * off[0]


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"point": "c.ende"}, 'tool "gripper": point: expected one of the points .* of "c".*did you mean "end"'),
        ({"point": "d.end"}, 'tool "gripper": point: .*"d'),
        ({"name": "end"}, 'expected one that no point of "c" has, found "end"'),
        ({"rpy": [0.0, 0.0]}, r"rpy"),
    ],
)
def test_wrong_tools(keys, message):
    with pytest.raises(InputError, match=message):
        solve(wrist(tool=[tool(**keys)], trajectory=[{"name": "a", "joint": "to_a", "value": "0"}]))
