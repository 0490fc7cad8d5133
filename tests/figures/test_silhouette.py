"""Outlines of surfaces in the plane: hulls of random polyhedra, plates with openings, pockets, one above another."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from ffrobot.pictures.silhouette import silhouette, winding_number


def area(loop):
    """Of a closed polygon (m, 2), counter-clockwise positive."""
    x, y = loop.T
    return 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)


def total(points, cells):
    return sum(area(points[loop, :2]) for loop in silhouette(points, cells))


def convex(points):
    """The triangles of the hull of points (p, 3), normals outwards."""
    hull = ConvexHull(points)
    cells = hull.simplices.copy()
    normals = np.cross(points[cells[:, 1]] - points[cells[:, 0]], points[cells[:, 2]] - points[cells[:, 0]])
    inwards = np.sum(normals * hull.equations[:, :3], axis=1) < 0.0
    cells[inwards] = cells[inwards][:, ::-1]
    return cells


@pytest.mark.parametrize("seed", range(20))
def test_random_polyhedron_covers_the_hull_of_its_shadow(seed):
    """Against Qhull in the plane."""
    points = np.random.default_rng(seed).standard_normal((40, 3))
    (loop,) = silhouette(points, convex(points))
    shadow = ConvexHull(points[:, :2])
    assert set(loop) == set(shadow.vertices)
    assert area(points[loop, :2]) == pytest.approx(shadow.volume, rel=1e-12)  # "volume" of a plane hull is its area


def wall(lower, upper):
    """Quadrilaterals between two rings of as many points, normals to the right of the way."""
    return np.stack([lower, np.roll(lower, -1), np.roll(upper, -1), upper], axis=1)


def ring(radius, z, count=24):
    angle = 2 * np.pi * np.arange(count) / count
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(count, z)], axis=1)


def turned(*profile):
    """A body of revolution about z with a hole: rings (radius, z), counter-clockwise in the plane of r and z."""
    points = np.concatenate([ring(radius, z) for radius, z in profile])
    rows = np.arange(len(points)).reshape(len(profile), -1)
    return points, np.concatenate([wall(a, b) for a, b in zip(rows, np.roll(rows, -1, axis=0), strict=True)])


POLYGON = 12 * np.sin(2 * np.pi / 24)  # area of the polygon with 24 corners on the unit circle


def test_washer_has_an_opening():
    points, cells = turned((0.4, 0.0), (1.0, 0.0), (1.0, 0.1), (0.4, 0.1))
    loops = silhouette(points, cells)
    assert sorted(area(points[loop, :2]) for loop in loops) == pytest.approx([-0.16 * POLYGON, POLYGON])


def test_step_of_a_bore_is_no_opening():
    """Wide above and narrow below: what is open is the narrow part, and the step leaves no line."""
    points, cells = turned((0.2, 0.0), (1.0, 0.0), (1.0, 0.2), (0.6, 0.2), (0.6, 0.1), (0.2, 0.1))
    loops = silhouette(points, cells)
    assert sorted(area(points[loop, :2]) for loop in loops) == pytest.approx([-0.04 * POLYGON, POLYGON])


def test_plate_over_a_washer_closes_it_and_one_beside_it_does_not():
    washer, cells = turned((0.4, 0.0), (1.0, 0.0), (1.0, 0.1), (0.4, 0.1))
    plate = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0.2, 0.3)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]  # normals outwards
    for shift, found in ((0.0, POLYGON), (3.0, 0.84 * POLYGON + 1.0)):
        points = np.concatenate([washer, plate + np.array([shift, 0.0, 0.0])])
        assert total(points, np.concatenate([cells, len(washer) + np.array(quads)])) == pytest.approx(found)


def test_winding_number_counts_loops_and_openings():
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    places = np.array([[0.0, 0.0], [0.7, 0.1], [2.0, 0.1]])
    np.testing.assert_array_equal(winding_number(places, [square, 0.5 * square[::-1]]), [0, 1, 0])
    np.testing.assert_array_equal(winding_number(places, [square, 0.5 * square]), [2, 1, 0])
