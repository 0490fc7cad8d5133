"""Unsound meshes are refused, with where and how many."""

from dataclasses import replace

import numpy as np
import pytest
from solid_parts import integrate, shape_functions

from ffrobot.common.errors import InputError
from ffrobot.mesh.cells import jacobians, reference_nodes
from ffrobot.mesh.checks import (
    check_boundary,
    check_connected,
    check_neighbours,
    check_quality,
    check_shape,
    oriented,
    straightened,
)
from ffrobot.mesh.part_mesh import PartMesh
from ffrobot.mesh.structured import structured_box

SECTION = (0.015, 0.025)


@pytest.fixture(params=["tetrahedron", "hexahedron"])
def box(request):
    return structured_box(1.0, SECTION, SECTION, (10, 3, 3), request.param)


def test_left_handed_cells_are_mirrored(box):
    mirrored = box.moved(box.points * [1, 1, -1])
    with pytest.raises(InputError, match="inverted"):
        check_quality(mirrored)
    mended = oriented(mirrored)
    check_quality(mended)
    assert integrate(mended) == pytest.approx(0.015 * 0.025)


def test_inverted_elements_are_told(box):
    points = box.points.copy()
    inner = np.argmin(np.linalg.norm(points - [0.5, 0.0025, 0.0042], axis=1))
    points[inner] += [0.0, 0.012, 0.0]
    with pytest.raises(InputError, match=r"expected .*, found \d+ inverted elements of \d+, e.g. at \(0\.[45]"):
        check_quality(box.moved(points))
    with pytest.raises(InputError, match="of distinct nodes, found 1 elements with a node twice of"):
        check_quality(replace(box, cells=np.vstack([box.cells[1:], np.append(box.cells[0, 1:], box.cells[0, 1])])))


def test_flat_elements_are_told():
    box = structured_box(1.0, SECTION, SECTION, (10, 1, 1), "tetrahedron")
    cells = np.concatenate([box.cells, [[0, 1, 4, 5]]])
    flat = replace(box, cells=cells, cell_tag=np.zeros(len(cells), dtype=np.int32))
    x = box.points[[0, 1, 4, 5]]
    assert abs(np.linalg.det(x[1:] - x[0])) < 1e-12
    with pytest.raises(InputError, match=r"found 1 flat elements \(slivers\) of 61, e.g. at \(0.05"):
        check_quality(flat)


def test_elements_in_one_another_are_told():
    """A tetrahedron's mirror image through one side is its neighbour; one on the same side lies in it."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.2, 0.2, -1], [0.2, 0.2, 0.5]], dtype=float)

    def part(*cells):
        return PartMesh(points, np.array(cells), "tetrahedron", 1, np.zeros(len(cells), dtype=np.int32))

    check_neighbours(part((0, 1, 2, 3), (0, 2, 1, 4)))
    for cells in [((0, 1, 2, 3), (0, 1, 2, 5)), ((0, 1, 2, 3), (0, 2, 1, 4), (0, 1, 2, 5))]:
        with pytest.raises(InputError, match=r"expected elements side by side, found 2 overlapping elements"):
            check_neighbours(part(*cells))


def test_cracks_are_told(box):
    """Nodes of one plane doubled above the middle: both sides of the crack; none of a bent bar."""
    check_boundary(box)
    check_boundary(box.moved(box.points * [1, 1, 1 + 0.5] + box.points[:, [1]] ** 2 * [1, 0, 3]))
    plane = np.flatnonzero((np.abs(box.points[:, 0] - 0.5) < 1e-9) & (box.points[:, 1] > 0.003))
    beyond = box.points[box.corners, 0].mean(axis=1) > 0.5
    other = np.arange(len(box.points))
    other[plane] = len(box.points) + np.arange(plane.size)
    cells = np.where(beyond[:, None], other[box.cells], box.cells)
    cracked = replace(box, points=np.concatenate([box.points, box.points[plane]]), cells=cells)
    check_connected(cracked)
    with pytest.raises(InputError, match=r"found \d+ of their free sides inside others, e.g. at \(0.5, 0.00"):
        check_boundary(cracked)


def test_elements_that_reach_over_others_are_told():
    """A cell's fourth corner becomes a node 0.3 m further on, so that it crosses the cells between."""
    box = structured_box(1.0, SECTION, SECTION, (10, 1, 1), "tetrahedron")
    beyond = np.flatnonzero(np.abs(box.points[:, 0] - 0.4) < 1e-9)
    changed = []
    for node in beyond:
        cells = box.cells.copy()
        cells[0, 3] = node
        x = box.points[cells[0]]
        if np.linalg.det(x[1:] - x[0]) > 1e-9:
            changed.append(replace(box, cells=cells))
    assert changed
    for part in changed:
        check_quality(part)
        with pytest.raises(InputError, match="free sides inside others"):
            check_boundary(part)


@pytest.mark.parametrize(
    ("scale", "unit", "says"),
    [
        (1000, "m", 'found 1000 m along x: looks like millimeters: geometry.unit = "mm"'),
        (39.37, "m", 'looks like inches: geometry.unit = "in"'),
        (0.001, "mm", 'looks like meters: geometry.unit = "m"'),
        (7.0, "m", "found 7 m along x$"),
    ],
)
def test_unit_slips_are_told(box, solid, scale, unit, says):
    with pytest.raises(InputError, match=rf"expected a part 1 m long, .*{says}"):
        check_shape(box.moved(box.points * scale), solid(unit=unit))


def test_parts_that_meet_without_sharing_nodes_are_told(box):
    half = len(box.cells) // 2
    cells = box.cells.copy()
    cells[half:] += len(box.points)
    apart = replace(box, cells=cells, points=np.concatenate([box.points, box.points]))
    with pytest.raises(InputError, match=rf"found 2: {half} elements around \(0.25.*share their nodes"):
        check_connected(apart)


def test_parts_that_meet_in_an_edge_only_are_told():
    box = structured_box(1.0, (1.0, 1.0), (1.0, 1.0), (2, 2, 1), "hexahedron")
    two = replace(box, cells=box.cells[[0, 3]], cell_tag=np.zeros(2, dtype=np.int32))
    with pytest.raises(InputError, match="found 2: 1 elements"):
        check_connected(two)


@pytest.mark.parametrize(("cell", "degree"), [(c, d) for c in ("tetrahedron", "hexahedron") for d in (1, 2)])
def test_jacobians_are_derivatives_of_the_position(cell, degree):
    nodes = reference_nodes(cell, degree)
    X, h = np.random.default_rng(2).random((5, 3)) / 3, 1e-6
    moved = nodes[None] + 0.02 * np.random.default_rng(3).random((1, len(nodes), 3))
    J = jacobians(moved, cell, degree, X)
    for d in range(3):
        ahead, behind = (shape_functions(cell, degree, X + s * h * np.eye(3)[d]) @ moved[0] for s in (1, -1))
        np.testing.assert_allclose(J[0, :, :, d], (ahead - behind) / (2 * h), atol=1e-8)


def test_cells_that_a_curved_edge_turns_over_are_straightened_as_little_as_needed():
    points = reference_nodes("tetrahedron", 2).copy()
    points[4, 2] += 0.6  # the edge 0–1 bulges through the cell
    points[5] += 0.01
    box = structured_box(1.0, (1, 1), (1, 1), (1, 1, 1), "tetrahedron")
    cell = replace(
        box, points=points, cells=np.arange(10).reshape(1, 10), degree=2, cell_tag=np.zeros(1, dtype=np.int32)
    )
    with pytest.raises(InputError, match="1 inverted"):
        check_quality(cell)
    mended = straightened(cell)
    check_quality(mended)
    assert 0.05 < mended.points[4, 2] < 0.6
