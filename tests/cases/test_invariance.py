"""What does not depend on how a scene is written down: turned as a whole, in a mirror, in another unit of length.

Random robots, their bodies in another order, too: tests/stress/test_rewritten_scenes.py.

A mirror tells conventions apart that a right-handed scene alone does not: one left-handed sign anywhere (of an axis,
a moment, a product of inertia, an order of rotations), and forces are no longer those of the mirrored robot.
"""

import numpy as np
import pytest
from four_bar import out_of_plane
from moved_scenes import MIRROR, moved, tables_of, turning
from rotations import random_rotation, rotation
from tables_3d import solved

SHARE = 1e-9  # of peaks


def loop():
    """Revolute, universal, spherical and prismatic joints about a link that bends; driven at its slider."""
    tables = tables_of("slider_crank_3d", 1e-10)
    law = tables["trajectory"][0]["x"]
    tables["trajectory"] = [{"name": "path", "joint": "guide", "value": law}]
    tables["analysis"] = [tables["analysis"][0] | {"end": 0.04}]
    return tables


def close(found, expected, what, peak=None):
    peak = np.abs(expected).max() if peak is None else peak
    np.testing.assert_allclose(found, expected, rtol=0, atol=SHARE * peak, err_msg=what)


def peak(results, name):
    return np.abs(results[name]).max()


def compare(first, second, Q):
    """All that `second`, the scene changed by Q, has to have in common with `first`."""
    axial, joints = turning(Q), loop()["joint"]
    of = lambda key: (second[f"inverse/{key}"], first[f"inverse/{key}"])  # noqa: E731
    peaks = {key: max(peak(first, f"inverse/joints/{joint['name']}/{key}") for joint in joints)
             for key in ("reaction", "reaction_moment")}  # fmt: skip
    driven = [joint["name"] for joint in joints if joint.get("motor", True)]
    largest = max((peak(first, f"inverse/joints/{name}/moment") for name in driven), default=0.0)
    for joint in joints:
        name = f"joints/{joint['name']}"
        for key, T in (("reaction", Q), ("reaction_moment", axial)):
            found, expected = of(f"{name}/{key}")
            close(found, expected @ T.T, f"{name} {key}", peaks[key])
        if joint["type"] != "spherical":
            close(*of(f"{name}/coordinate"), name)
        if joint["name"] in driven:
            close(*of(f"{name}/moment"), f"{name}, moment", largest)
    for point in POINTS:
        found, expected = of(f"points/{point}/position")
        close(found, expected @ Q.T, point)
    for key, T in (("linear", Q), ("angular", axial)):
        found, expected = of(f"momentum/{key}")
        close(found, expected @ T.T, f"momentum {key}")
    for key in ("kinetic", "strain"):
        close(*of(f"energy/{key}"), key)


POINTS = ("slider.pin", "rod.mid")


@pytest.fixture(scope="module")
def before():
    with solved(loop()) as results:
        yield results


def test_a_scene_turned_as_a_whole_moves_as_before(before):
    Q = random_rotation(np.random.default_rng(1))
    with solved(moved(loop(), Q)) as after:
        compare(before, after, Q)


def test_a_mirrored_robot_moves_as_in_the_mirror(before):
    with solved(moved(loop(), MIRROR)) as after:
        compare(before, after, MIRROR)
        for point in POINTS:
            R, mirrored = (rotation(of[f"inverse/points/{point}/quaternion"][-1]) for of in (before, after))
            np.testing.assert_allclose(mirrored, MIRROR @ R @ MIRROR, rtol=0, atol=SHARE)


def crank(unit):
    """Of a rigid loop: angles, and torque, in m, kg, s."""
    inverse = {"name": "inverse", "kind": "pcid", "end": 0.3, "output_step": 0.05, "tolerance": 1e-10}
    with solved(out_of_plane("0.7+0.9*(1-cos(3*t))", inverse, unit=unit)) as results:
        coordinates = np.column_stack([results[f"inverse/joints/{name}/coordinate"] for name in "ABD"])
        return coordinates, results["inverse/joints/A/moment"] / unit**2


@pytest.mark.parametrize("unit", [1e-3, 1e9], ids=["km", "nm"])
def test_a_loop_moves_alike_in_any_unit_of_length(unit):
    """A driven angle is 1 rad in any of them: measured in lengths it was no motion of a robot of 4e8 nm."""
    for found, expected in zip(crank(unit), crank(1.0), strict=True):
        close(found, expected, "crank")
