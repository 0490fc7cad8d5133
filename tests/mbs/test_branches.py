"""The postures in which a scene can start: two of a planar arm, eight of an arm with a spherical wrist."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
import tree_oracle
from four_bar import planar
from rods import arm_of_rods

from ffrobot import make_scene, solve
from ffrobot.common.errors import InputError
from ffrobot.mbs.posture.branches import in_words, start_postures
from ffrobot.mbs.posture.start import undeformed_posture
from ffrobot.run.solve import prepare_scene

CASES = Path(__file__).parents[2] / "cases"


def test_elbow_up_and_down():
    """Two links of equal length: the other start is the mirror image about the line to the tip."""
    model = prepare_scene(CASES / "two_link" / "scene.toml").model
    first, second = start_postures(model)
    columns = model.tree.joint_columns
    np.testing.assert_allclose(first.q[: model.tree.n_v][columns], np.radians([0.0, 60.0]), atol=1e-12)
    np.testing.assert_allclose(second.q[: model.tree.n_v][columns], np.radians([60.0, -60.0]), atol=1e-12)
    assert second.guess == 'joints = { O = "60*deg", A = "-60*deg" }'
    np.testing.assert_allclose(second.away, np.radians(120.0), rtol=1e-12)


@pytest.mark.parametrize(
    ("path", "words"),
    [({"joint": "D", "value": "1.4"}, ("up", "down")), ({"point": "coupler.m", "y": "0.25"}, ("down", "up"))],
)
def test_elbows_of_a_loop_next_to_where_it_is_cut(path, words):
    """Of four bars B is between A and C, at which the loop is cut: above or below the line of these two."""
    run = {"name": "i", "kind": "pcid", "end": 0.5, "output_step": 0.1}
    start = {"joints": {"A": 1.0, "B": -0.7, "D": 1.5}}
    tables = planar({name: {} for name in "ABCD"}, [run], trajectory=[{"name": "t"} | path], initial=start)
    tables["body"][1]["rigid"]["points"]["m"] = [0.25, 0.1]
    model = prepare_scene(make_scene(**tables)).model
    found = start_postures(model)
    assert [one.branch for one in found] == [{"B": word} for word in words]
    for one, word in zip(found, words, strict=True):
        A, B = (model.tree.nodes[model.tree.carried[name]].coordinates(one.q)[0] for name in "AB")
        b, c = np.exp(1j * A) * 0.2, np.exp(1j * A) * 0.2 + np.exp(1j * (A + B)) * 0.5
        assert (b.imag > b.real * c.imag / c.real) == (word == "up")


def arm_6r(**initial):
    """The case, with rigid bodies of the same length in place of its links."""
    keys = tomllib.loads((CASES / "arm_6r" / "scene.toml").read_text(encoding="utf-8"))
    lengths = {"upper_arm": 0.4, "forearm": 0.3}
    for body in keys["body"]:
        if "link" in body:
            del body["link"]
            points = {"root": [0.0, 0.0, 0.0], "tip": [lengths[body["name"]], 0.0, 0.0]}
            body["rigid"] = {"mass": 1.0, "center": [0.1, 0.0, 0.0], "inertia": [0.1, 0.1, 0.1], "points": points}
    scene = {key: keys[key] for key in ("name", "space", "gravity", "body", "joint", "trajectory")}
    scene |= {"initial": keys["initial"] | initial, "analysis": [{"name": "rest", "kind": "static"}]}
    return prepare_scene(make_scene(**scene)).model


@pytest.fixture(scope="module")
def six_axes():
    """An arm with a spherical wrist and its starts."""
    model = arm_6r()
    return model, start_postures(model)


def test_shoulder_elbow_and_wrist_of_six_axes(six_axes):
    """Each turn of the wrist comes in two, each elbow, each shoulder: all hold the tool in the same place and triad.

    Left and right: the wrist's center is on one side or the other of the plane through the first axis along that of
    the shoulder; flips of the wrist change its angle's sign and turn the joints next to it by half a turn; elbows are
    up where they are above the line from the shoulder to the wrist.
    """
    model, found = six_axes
    tree = model.tree
    assert [list(one.branch) for one in found] == [["shoulder", "elbow", "wrist_pitch"]] * 8
    angles = {tuple(one.branch.values()): one.q[[tree.nodes[tree.carried[n]].q.start for n in tree.carried]]
              for one in found}  # fmt: skip
    assert len(angles) == 8
    tool = tree.section("flange.tool", np.eye(3))
    pivots = [tree.nodes[tree.carried[name]].inner for name in ("shoulder", "elbow", "wrist_pitch")]
    held = []
    for one, ((shoulder, elbow, wrist), q) in zip(found, angles.items(), strict=True):
        at = [
            tree_oracle.motion(tree, section, one.q[None], tree_oracle.frames(tree, one.q[None]))
            for section in (tool, *pivots)
        ]
        held.append(at[0])
        a, b, c = (motion.r[0] for motion in at[1:])
        middle = a + (c - a) * ((b - a) @ (c - a)) / ((c - a) @ (c - a))
        assert (b[2] > middle[2]) == (elbow == "up")
        forward = abs(np.angle(np.exp(1j * (q[0] - found[0].q[0])))) < np.pi / 2
        assert forward == (shoulder == "left")
        other = angles[shoulder, elbow, "flip" if wrist == "noflip" else "noflip"]
        turned = np.angle(np.exp(1j * (other - q)))
        np.testing.assert_allclose(turned[:3], 0.0, atol=1e-8)
        np.testing.assert_allclose(np.abs(turned[[3, 5]]), np.pi, atol=1e-8)
        np.testing.assert_allclose(other[4], -q[4], atol=1e-8)
    for motion in held:
        np.testing.assert_allclose(motion.r, held[0].r, atol=1e-10)
        np.testing.assert_allclose(motion.F, held[0].F, atol=1e-10)


@pytest.mark.parametrize("wrist", ["noflip", "positive"])
def test_a_start_of_six_axes_by_name(six_axes, wrist):
    """By the names of all three, and by the sign of an angle."""
    _, found = six_axes
    *_, wanted = (one for one in found[1:] if one.branch["wrist_pitch"] == "noflip")
    q = undeformed_posture(arm_6r(branch=wanted.branch | {"wrist_pitch": wrist})).q
    np.testing.assert_allclose(np.exp(1j * q), np.exp(1j * wanted.q), atol=1e-7)


def two_rods(**initial):
    """Two rods of 0.5 m whose tip is at (0.6, 0.1)."""
    path = [{"name": "tip", "point": "b.tip", "x": "0.6", "y": "0.1"}]
    rest = [{"name": "rest", "kind": "static"}]
    return arm_of_rods({"a": (1.0, 0.5), "b": (1.0, 0.5)}, trajectory=path, initial=initial, analysis=rest)


@pytest.mark.parametrize(("word", "side"), [("up", 1), ("down", -1), ("negative", 1), ("positive", -1)])
def test_an_elbow_by_name(word, side):
    """The law of cosines: the elbow is up where its angle is negative; the same from either guess."""
    angle = np.pi - np.arccos((0.5 - (0.6**2 + 0.1**2)) / 0.5)
    for guess in (0.5, -0.5):
        results = solve(two_rods(joints={"A": guess}, branch={"A": word}))
        assert results["rest/joints/A/coordinate"][0] == pytest.approx(-side * angle, abs=1e-6)
        y = results["rest/points/a.tip/position"][0, 1]
        assert (y > 0.1 * 0.5) == (side == 1)


@pytest.mark.parametrize("name", ["elbow 1", "épaule", "関節", "a^b", "x = 1, y", 'a "quoted" #1', "a'b"])
def test_joints_of_any_name(name):
    """Lines for [initial] are TOML whatever joints are called, and choose the posture that they were printed for."""
    tables = tomllib.loads(two_rods(branch={"A": "up"}).text)
    tables["joint"][1]["name"], tables["initial"] = name, {"branch": {name: "up"}}
    prepared = prepare_scene(make_scene(**tables))
    for one in start_postures(prepared.model):
        assert tomllib.loads(in_words(one.branch)) == {"branch": one.branch}
        read = tomllib.loads(one.guess)["joints"]
        assert read.keys() == one.guesses.keys() == {"O", name}
        degrees = float(read[name].removesuffix("*deg"))
        assert np.radians(degrees) == pytest.approx(one.guesses[name][0], abs=1e-5)


def test_a_branch_that_is_not_there():
    with pytest.raises(
        InputError, match=r'initial\.branch: expected one of the 2 postures .* A = "up", O = "negative"'
    ):
        prepare_scene(two_rods(branch={"A": "up", "O": "negative"}))
    with pytest.raises(InputError, match="branch"):
        two_rods(branch={"B": "up"})
    with pytest.raises(InputError, match='"up"'):
        two_rods(branch={"A": "above"})
