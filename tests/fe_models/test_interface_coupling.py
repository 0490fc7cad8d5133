"""How named interfaces of solids take their faces along: as the link file says, else as its [reference] does."""

import h5py
import numpy as np
import pytest

from ffrobot.common.errors import InputError
from ffrobot.fe_models.link import make_link
from ffrobot.present.info import describe

RADIUS, PLACE = 0.006, 0.08
LINK = """
name = "part"
[material]
youngs_modulus = 7e10
poissons_ratio = 0.33
density = 2700.0
[geometry]
kind = "solid"
length = 0.2
section = {{ shape = "rectangle", height = 0.03, width = 0.01 }}
[[geometry.hole]]
position = 0.08
diameter = 0.012
[mesh]
order = 2
size = 0.02
[reference]
condition = "{condition}"
{reference}
[modes]
count = 3
[[interface]]
name = "pivot"
position = [0.08, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
{pivot}
[[interface]]
name = "cut"
position = 0.15
"""
# Condition, coupling of [reference] and of the pivot; whether the bore is a plate, and what root and tip are.
CASES = [
    ("cantilever", None, None, "rigid", "rigid", "mean"),
    ("cantilever", None, "mean", "mean", "rigid", "mean"),
    ("cantilever", "mean", None, "mean", "mean", "mean"),
    ("craig-bampton", None, None, "rigid", "rigid", "mean"),
    ("simply-supported", None, None, "mean", "mean", "mean"),
    ("simply-supported", None, "rigid", "rigid", "mean", "mean"),
    ("simply-supported", "rigid", None, "rigid", "rigid", "rigid"),
]


def written(folder, condition, reference=None, pivot=None):
    words = {"reference": reference, "pivot": pivot}
    lines = {key: f'coupling = "{word}"' if word else "" for key, word in words.items()}
    path = folder / "part.toml"
    path.write_text(LINK.format(condition=condition, **lines))
    return path


def out_of_plate(body, on_face, center):
    """Largest displacement of points of a face beside the best rigid motion of all of them, relative to the largest."""
    r = body.mesh.points[on_face] - center
    turns = np.stack([np.cross(axis, r) for axis in np.eye(3)], axis=-1)
    rigid = np.concatenate([np.broadcast_to(np.eye(3), (len(r), 3, 3)), turns], axis=2).reshape(-1, 6)
    shapes = body.mesh.mode_shapes[on_face].reshape(len(rigid), -1)
    left = shapes - rigid @ np.linalg.lstsq(rigid, shapes, rcond=None)[0]
    return np.abs(left).max() / np.abs(shapes).max()


@pytest.mark.parametrize(("condition", "reference", "pivot", "bore", "root", "tip"), CASES)
def test_faces_move_as_said(tmp_path, condition, reference, pivot, bore, root, tip):
    path = written(tmp_path, condition, reference, pivot)
    body = make_link(path).body
    points = body.mesh.points
    on_bore = np.abs(np.hypot(points[:, 0] - PLACE, points[:, 1]) - RADIUS) < 1e-6
    assert np.count_nonzero(on_bore) > 20
    assert (out_of_plate(body, on_bore, [PLACE, 0.0, 0.0]) < 1e-9) == (bore == "rigid")
    on_tip = np.abs(points[:, 0] - 0.2) < 1e-9
    assert (out_of_plate(body, on_tip, [0.2, 0.0, 0.0]) < 1e-9) == (tip == "rigid")
    expected = {"root": root, "tip": tip, "pivot": bore, "cut": "mean"}
    with h5py.File(path.with_suffix(".h5")) as file:
        assert {name: group.attrs["coupling"] for name, group in file["interfaces"].items()} == expected
    for name, coupling in expected.items():
        line = next(line for line in describe(path.with_suffix(".h5")).splitlines() if line.startswith("interfaces: "))
        assert f"m ({coupling})" in line.split(f"{name} at ")[1]


def test_a_face_that_the_condition_holds_is_held_as_it_says(tmp_path):
    path = written(tmp_path, "cantilever")
    path.write_text(path.read_text() + '[[interface]]\nname = "root"\ncoupling = "mean"\n')
    expected = r'coupling of root: expected "rigid", or coupling = "mean" in \[reference\]'
    with pytest.raises(InputError, match=expected):
        make_link(path)
