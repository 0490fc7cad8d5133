"""How named interfaces of solids take their faces along: as the link file says, else as its [reference] does."""

import h5py
import numpy as np
import pytest
from beam_links import rectangle, solid_link

import ffrobot
from ffrobot.common.errors import InputError
from ffrobot.present.info import describe

ONE_CACHE = True  # one mesh
RADIUS, PLACE = 0.006, 0.08
# Condition, coupling of [reference] and of the pivot; whether the bore is a plate, and what root and tip are.
CASES = [
    ("cantilever", None, None, "rigid", "rigid", "mean"),
    ("cantilever", None, "mean", "mean", "rigid", "mean"),
    ("craig-bampton", None, None, "rigid", "rigid", "mean"),
    ("simply-supported", None, "rigid", "rigid", "mean", "mean"),
    ("simply-supported", "rigid", None, "rigid", "rigid", "rigid"),
]


def link(condition, reference=None, pivot=None, **root):
    """A bar with a bore, the pivot's, and a section; coupling of [reference] and of the pivot."""
    told = [{} if word is None else {"coupling": word} for word in (reference, pivot)]
    places = [
        {"name": "pivot", "position": [PLACE, 0.0, 0.0], "normal": [0.0, 0.0, 1.0]} | told[1],
        {"name": "cut", "position": 0.15},
    ]
    hole = [{"position": PLACE, "diameter": 2 * RADIUS}]
    keys = {"name": "part", "modes": {"count": 3}, "interface": places + ([{"name": "root"} | root] if root else [])}
    made = solid_link(0.2, rectangle(0.03, 0.01), {"order": 2, "size": 0.03}, hole=hole, condition=condition, **keys)
    return made | {"reference": made["reference"] | told[0]}


def out_of_plate(body, on_face, center):
    """Largest displacement of points of a face beside the best rigid motion of all of them, relative to the largest."""
    r = body.mesh.points[on_face] - center
    turns = np.stack([np.cross(axis, r) for axis in np.eye(3)], axis=-1)
    rigid = np.concatenate([np.broadcast_to(np.eye(3), (len(r), 3, 3)), turns], axis=2).reshape(-1, 6)
    shapes = body.mesh.mode_shapes[on_face].reshape(len(rigid), -1)
    left = shapes - rigid @ np.linalg.lstsq(rigid, shapes, rcond=None)[0]
    return np.abs(left).max() / np.abs(shapes).max()


@pytest.mark.parametrize(("condition", "reference", "pivot", "bore", "root", "tip"), CASES)
def test_faces_move_as_said(condition, reference, pivot, bore, root, tip):
    made = ffrobot.make_link(link(condition, reference, pivot))
    body = made.body
    points = body.mesh.points
    on_bore = np.abs(np.hypot(points[:, 0] - PLACE, points[:, 1]) - RADIUS) < 1e-6
    assert np.count_nonzero(on_bore) > 20
    assert (out_of_plate(body, on_bore, [PLACE, 0.0, 0.0]) < 1e-9) == (bore == "rigid")
    on_tip = np.abs(points[:, 0] - 0.2) < 1e-9
    assert (out_of_plate(body, on_tip, [0.2, 0.0, 0.0]) < 1e-9) == (tip == "rigid")
    expected = {"root": root, "tip": tip, "pivot": bore, "cut": "mean"}
    with h5py.File(made.path) as file:
        assert {name: group.attrs["coupling"] for name, group in file["interfaces"].items()} == expected
    for name, coupling in expected.items():
        line = next(line for line in describe(made.path).splitlines() if line.startswith("interfaces: "))
        assert f"m ({coupling})" in line.split(f"{name} at ")[1]


def test_a_face_that_the_condition_holds_is_held_as_it_says():
    expected = r'coupling of root: expected "rigid", or coupling = "mean" in \[reference\]'
    with pytest.raises(InputError, match=expected):
        ffrobot.make_link(link("cantilever", coupling="mean"))
