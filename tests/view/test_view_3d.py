"""`ffrobot view` of scenes in 3D: grids hold what was solved, joints stay shut, the picture stands upright."""

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from ffrobot.pictures.view import Options, view_file
from ffrobot.results.file import Results

DIGITS = 2e-7  # numbers in the files have 7 digits; lengths are about 1 m


@pytest.fixture(scope="module")
def grids(arm_3r, read, tmp_path_factory):
    """For five steps: time, points, body numbers of the cells."""
    folder = tmp_path_factory.mktemp("view")
    viewed = view_file(arm_3r.folder / "scene.results.h5", folder, Options(frames=5, pictures=False))
    assert [path.name for path in viewed.paths] == ["inverse.vtkhdf"]
    return [(time, points, cells["body"]) for time, _, points, _, cells in read(viewed.paths[0])]


def rings(points, count):
    """Middles and radii of the `count` rings of a tube."""
    corners = points.reshape(count, -1, 3)
    middle = corners.mean(axis=1)
    return middle, np.linalg.norm(corners - middle[:, None], axis=2)


def parts(points, results):
    """Points of column (a line), upper arm and forearm (tubes), in the order of the grid."""
    stations = [len(results.modal_body(name).stations.position) for name in ("upper", "fore")]
    corners, column = divmod(len(points), sum(stations))
    first = column + corners * stations[0]
    return points[:column], rings(points[column:first], stations[0]), rings(points[first:], stations[1])


def test_tubes_are_where_they_were_solved(grids, arm_3r):
    with Results(arm_3r.folder / "scene.results.h5") as results:
        largest = results.peak("inverse/points/fore.tip/deflection")[1]  # the output next to it is in the grids
        assert [time for time, *_ in grids] == pytest.approx([0.0, 0.15, np.round(largest / 0.005) * 0.005, 0.45, 0.6])
        for time, points, bodies in grids:
            (row,) = arm_3r.rows("inverse", [time])
            column, upper, fore = parts(points, results)
            assert set(bodies) == {0, 1, 2}
            for at, name in ((column, "column.top"), (column, "column.root")):
                expected = results[f"inverse/points/{name}/position"][row]
                assert np.linalg.norm(at - expected, axis=1).min() < DIGITS
            for (middle, radius), name, outer in ((upper, "upper", 0.0055), (fore, "fore", 0.004)):
                for end, label in ((0, "root"), (-1, "tip")):
                    expected = results[f"inverse/points/{name}.{label}/position"][row]
                    np.testing.assert_allclose(middle[end], expected, rtol=0, atol=DIGITS)
                np.testing.assert_allclose(radius, outer, rtol=2e-3)
                # r = R + A (x + Φ p), with SciPy's rotation, at the station in the middle of the link
                body = results.modal_body(name)
                k = len(body.stations.position) // 2
                x = body.stations.position[k] + body.stations.translation[k] @ results.modal("inverse", name)[row]
                e = results[f"inverse/bodies/{name}/quaternion"][row]
                turned = Rotation.from_quat([*e[1:], e[0]]).apply(x)
                expected = results[f"inverse/bodies/{name}/position"][row] + turned
                np.testing.assert_allclose(middle[k], expected, rtol=0, atol=DIGITS)


@pytest.mark.usefixtures("can_draw")
def test_picture_stands_upright(arm_3r, tmp_path):
    """The rigid column is drawn, pale: pixels one above the other, higher than broad; the arm goes to its right."""
    viewed = view_file(arm_3r.folder / "scene.results.h5", tmp_path, Options(time=0.0, pictures=True))
    image = np.asarray(Image.open(viewed.paths[-1]).convert("L"), dtype=int)
    rows, columns = np.nonzero(image[80:640] < 235)  # without title, foot, axes and bar
    assert len(rows) > 2000
    foot = columns[rows > rows.max() - 30]
    assert np.ptp(foot) < 40  # the column's foot is the lowest thing, and narrow
    assert columns.max() - foot.max() > 100  # the arm is on its right
