"""Reactions that redundant constraints of loops leave open are named; what is written of them is the least split."""

import re

import numpy as np
import pytest
from beam_links import beam_link, circle
from tables_3d import ORIGIN, revolute, rigid, scene

import ffrobot

WEIGHT, ARM, HEIGHT = 50.0, 0.4, 1.8
NAMES = ("j1", "j2", "j3", "j4")


def pin(name, inner, outer, motor=False, **keys):
    return revolute(name, inner, outer, motor=motor, **keys)


def bar(name, length, mass):
    across, middle = mass * length**2 / 12, [length / 2, 0.0, 0.0]
    return rigid(name, mass, [1e-4, across, across], middle, tip=[length, 0.0, 0.0])


def coupler(family):
    keys = {"modes": {"count": 2, "family": family}, "damping": {"rayleigh": [0.0, 2e-4]}}
    return {"name": "coupler", "link": beam_link(0.4, circle(0.012), 4, **keys)}


def four_bar(middle, gravity, order="1234", unsolved=False):
    """Cranks of 0.2 m and a coupler of 0.4 m on four parallel axes."""
    joints = {
        "1": pin("j1", "ground", "left.root", motor=True),
        "2": pin("j2", "left.tip", "coupler.root"),
        "3": pin("j3", "coupler.tip", "right.tip"),
        "4": pin("j4", "ground", "right.root", at=[0.4, 0.0, 0.0]),
    }
    bodies, joints = [bar("left", 0.2, 0.5), middle, bar("right", 0.2, 0.6)], [joints[k] for k in order]
    guess = {"j1": 0.9, "j2": -0.9, "j3": 0.9, "j4": 0.9}
    run = {"name": "inv", "kind": "pcid", "end": 0.3, "output_step": 0.1}
    path = [{"name": "t", "joint": "j1", "value": "0.9 + 0.5*sin(4*t)"}]
    tables = scene(bodies, joints, run, gravity=gravity, trajectory=path, initial={"joints": guess})
    made = ffrobot.make_scene(**tables)
    return made if unsolved else ffrobot.solve(made)


def opened(results):
    return {name: list(results.attributes(f"inv/joints/{name}").get("indeterminate", [])) for name in NAMES}


def redundant(results):
    assert not any("redundant" in text for text in results.warnings.get("inv", ()))
    return results.notes.get("inv", [])


def test_a_door_on_two_hinges():
    """Of the least 2F² + 2m²/h² with Fh + 2m = Wb, where each hinge has F across and m: F = Wb/5h, m = 2Wb/5.

    A free joint beside them carries nothing.
    """
    hinges = {"low": ORIGIN, "high": [0.0, 0.0, HEIGHT]}
    leaf = rigid("leaf", WEIGHT / 10, [1.0] * 3, [ARM, 0.0, HEIGHT / 2], **hinges)
    joints = [pin(name, "ground", f"leaf.{name}", at=at) for name, at in hinges.items()]
    joints.append({"name": "loose", "type": "free", "between": ["ground", "leaf.low"]})
    run = {"name": "inv", "kind": "forward", "end": 0.1, "output_step": 0.1}
    results = ffrobot.solve(ffrobot.make_scene(**scene([leaf], joints, run, gravity=[0.0, 0.0, -10.0])))
    assert re.search(r'5 constraints .* redundant.*"low" \(x, y, z, mx, my\)', redundant(results)[0])
    for name, sign in (("low", 1.0), ("high", -1.0)):
        found = [results[f"inv/joints/{name}/{part}"][0] for part in ("reaction", "reaction_moment")]
        expected = [[sign * WEIGHT * ARM / (5 * HEIGHT), 0.0, WEIGHT / 2], [0.0, -2 * WEIGHT * ARM / 5, 0.0]]
        np.testing.assert_allclose(found, expected, atol=1e-9)
        assert list(results.attributes(f"inv/joints/{name}")["indeterminate"]) == ["x", "y", "z", "mx", "my"]
    assert not results["inv/joints/loose/reaction"].any()


def test_a_door_on_a_post_that_turns_moves_as_on_one_hinge():
    """All equations of the second hinge hold by themselves: slopes of them are round-off, and hold nothing."""
    found = []
    for hinges in (("low",), ("low", "high")):
        places = {"low": ORIGIN, "high": [0.0, 0.0, HEIGHT]}
        post = rigid("post", 2.0, [0.3] * 3, [0.1, 0.0, 0.2], **places)
        leaf = rigid("leaf", 3.0, [0.3, 0.2, 0.4], [ARM, 0.05, HEIGHT / 2], **places)
        joints = [revolute("foot", "ground", "post.low", [0.3, 1.0, 0.2], motor=True, rpy=[0.1, 0.0, 0.3])]
        joints += [pin(name, f"post.{name}", f"leaf.{name}") for name in hinges]
        start = {"joints": {"foot": 0.4, "low": 0.3}, "joint_rates": {"foot": 1.0, "low": -2.0}}
        runs = [{"name": "inv", "kind": "forward", "end": 0.5, "output_step": 0.1, "tolerance": 1e-8},
                {"name": "lin", "kind": "linear"}]  # fmt: skip
        tables = scene([leaf, post], joints, runs[0], gravity=[0.0, -9.8, 3.0], initial=start)
        results = ffrobot.solve(ffrobot.make_scene(**tables | {"analysis": runs}))
        found.append([results[f"inv/joints/{name}/coordinate"] for name in ("foot", "low")] + [results["lin/linear/A"]])
    for one, two in zip(*found, strict=True):
        np.testing.assert_allclose(two, one, rtol=0, atol=1e-8)


def test_parallel_axes_of_rigid_links():
    """Open is what acts along the axes and across them; the weight along these is carried, in-plane forces stay."""
    flat, along = (four_bar(bar("coupler", 0.4, 0.7), [0.0, -9.8, g]) for g in (0.0, -3.0))
    assert opened(along) == {name: ["z", "mx", "my"] for name in NAMES}
    (text,) = redundant(along)
    assert text.startswith("3 constraints of kinematic loops are redundant")
    assert '"j4" (z, mx, my)' in text
    of_ground = sum(along[f"inv/joints/{name}/reaction"][:, 2] for name in ("j1", "j4"))
    np.testing.assert_allclose(of_ground, 3.0 * 1.8, rtol=1e-12)
    for name in opened(along):
        in_plane = [results[f"inv/joints/{name}/reaction"][:, :2] for results in (flat, along)]
        np.testing.assert_allclose(*in_plane, atol=1e-9)


@pytest.mark.parametrize("order", ["4321", "1342"])
def test_the_split_does_not_depend_on_the_order_of_joints(order):
    first, other = (four_bar(bar("coupler", 0.4, 0.7), [0.0, -9.8, -3.0], order) for order in ("1234", order))
    for name in opened(first):
        for part in ("reaction", "reaction_moment"):
            path = f"inv/joints/{name}/{part}"
            np.testing.assert_allclose(other[path], first[path], atol=1e-8)


@pytest.mark.parametrize(
    ("family", "at_cranks", "at_coupler"),
    [
        ("all", [], []),
        ("in-plane-bending", ["z", "mx", "my"], ["z", "mx", "my"]),
        ("torsion", ["z", "mx", "my"], ["z", "my"]),
    ],
)
def test_modes_settle_what_they_carry(family, at_cranks, at_coupler):
    """A coupler that bends in two planes and twists settles all; bent in the plane, nothing; twisted, mx at its ends.

    It stays along x.
    """
    results = four_bar(coupler(family), [0.0, -9.8, -3.0])
    assert opened(results) == {"j1": at_cranks, "j2": at_coupler, "j3": at_coupler, "j4": at_cranks}
    assert len(redundant(results)) == bool(at_cranks)


def test_strict_ends_with_0_where_only_constraints_are_redundant(ffrobot, tmp_path):
    """The motion is right and the split stated: a note. The door's hinge that breaks apart would be a warning."""
    made = four_bar(bar("coupler", 0.4, 0.8), [0.0, -9.81, 0.0], unsolved=True)
    (tmp_path / "scene.toml").write_text(made.text)
    done = ffrobot("solve", tmp_path / "scene.toml", "--strict")
    assert (done.returncode, "warning" in done.stdout) == (0, False)
    assert re.search(r"(?m)^note       inv: 3 constraints of kinematic loops are redundant", done.stdout)
