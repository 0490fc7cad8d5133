"""What does not depend on how a scene is written down: turned as a whole, in a mirror, its bodies in another order.

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


def arm():
    """Six axes and two links that bend, a full pose; products of inertia in its wrist."""
    tables = tables_of("arm6_undeformed", 1e-10)
    wrist = next(body for body in tables["body"] if body["name"] == "w6")
    wrist["rigid"]["inertia"] = [[9e-4, 1e-4, -2e-4], [1e-4, 1.5e-3, 3e-4], [-2e-4, 3e-4, 1.4e-3]]
    fall = {"name": "fall", "kind": "forward", "end": 0.02, "output_step": 0.01, "tolerance": 1e-10}
    straight = {"name": "straight", "kind": "fcid", "shape": "zero", "end": 0.04, "output_step": 0.01}
    rest = {"name": "rest", "kind": "static"}
    tables["analysis"] = [tables["analysis"][0] | {"end": 0.04, "output_step": 0.01}, fall, straight, rest]
    return tables


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


def compare(first, second, tables, Q, points):
    """All that `second`, the scene changed by Q, has to have in common with `first`."""
    axial = turning(Q)
    for analysis in (each["name"] for each in tables["analysis"]):
        of = lambda key: (second[f"{analysis}/{key}"], first[f"{analysis}/{key}"])  # noqa: E731, B023
        peaks = {key: max(peak(first, f"{analysis}/joints/{joint['name']}/{key}") for joint in tables["joint"])
                 for key in ("reaction", "reaction_moment")}  # fmt: skip
        driven = [joint["name"] for joint in tables["joint"] if analysis != "fall" and joint.get("motor", True)]
        largest = max((peak(first, f"{analysis}/joints/{name}/moment") for name in driven), default=0.0)
        for joint in tables["joint"]:
            name = f"joints/{joint['name']}"
            for key, T in (("reaction", Q), ("reaction_moment", axial)):
                found, expected = of(f"{name}/{key}")
                close(found, expected @ T.T, f"{analysis} {name} {key}", peaks[key])
            if joint["type"] != "spherical":
                close(*of(f"{name}/coordinate"), f"{analysis} {name}")
            if joint["name"] in driven:
                close(*of(f"{name}/moment"), f"{analysis} {name}, moment", largest)
        for point in points:
            found, expected = of(f"points/{point}/position")
            close(found, expected @ Q.T, f"{analysis} {point}")
        for key, T in (("linear", Q), ("angular", axial)):
            found, expected = of(f"momentum/{key}")
            close(found, expected @ T.T, f"{analysis} momentum {key}")
        for key in ("kinetic", "strain"):
            close(*of(f"energy/{key}"), f"{analysis} {key}")


CASES = {"arm": (arm, ("w6.tool", "upper.mid", "fore.mid")), "loop": (loop, ("slider.pin", "rod.mid"))}


@pytest.fixture(scope="module", params=CASES)
def case(request):
    make, points = CASES[request.param]
    with solved(make()) as results:
        yield make(), results, points


def test_a_scene_turned_as_a_whole_moves_as_before(case):
    tables, before, points = case
    Q = random_rotation(np.random.default_rng(1))
    with solved(moved(tables, Q)) as after:
        compare(before, after, tables, Q, points)


def test_a_mirrored_robot_moves_as_in_the_mirror(case):
    tables, before, points = case
    with solved(moved(tables, MIRROR)) as after:
        compare(before, after, tables, MIRROR, points)
        for point in points:
            R, mirrored = (rotation(of[f"inverse/points/{point}/quaternion"][-1]) for of in (before, after))
            np.testing.assert_allclose(mirrored, MIRROR @ R @ MIRROR, rtol=0, atol=SHARE)


def test_bodies_in_another_order_move_as_before(case):
    tables, before, points = case
    with solved(tables | {"body": tables["body"][::-1]}) as after:
        compare(before, after, tables, np.eye(3), points)


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
