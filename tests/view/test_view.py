"""`ffrobot view`: grids read back with VTK's own reader hold what was solved; pictures show it."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from ffrobot.cli import cli
from ffrobot.common.errors import InputError, SolveError
from ffrobot.mbs.quantities.stress import von_mises
from ffrobot.pictures.view import Options, view_file
from ffrobot.results.file import Results

GRIDS = Options(pictures=False)
DIGITS = 2e-7  # numbers in the files have 7 digits; lengths are about 1 m


def axis(points):
    """Middles of the rings of four corners that a rectangular beam is swept from."""
    return points.reshape(-1, 4, 3).mean(axis=1)


def test_exaggeration_keeps_joints_shut(read, two_link, tmp_path):
    """At 20 times the deflection, too, link 2 begins where link 1 ends, and link 1 stays on the ground."""
    options = Options(analysis="joints_only", frames=5, pictures=False)
    paths = view_file(two_link.folder / "scene.results.h5", tmp_path, options).paths
    assert paths == [tmp_path / "joints_only.vtkhdf"]
    for time, _, points, data, _ in read(paths[0]):
        shown = points + 19.0 * data["exaggeration"]
        link1, link2 = axis(shown[:244]), axis(shown[244:])
        np.testing.assert_allclose(link1[0], 0.0, rtol=0, atol=20 * DIGITS)
        np.testing.assert_allclose(link2[0], link1[-1], rtol=0, atol=20 * DIGITS)
        (row,) = two_link.rows("joints_only", [time])
        deflection = two_link.file["joints_only/points/link2.tip/deflection"][row]
        moved = axis(data["deflection"][244:])[-1]
        assert np.linalg.norm(moved) == pytest.approx(np.linalg.norm(deflection), abs=DIGITS)


def test_solid_deforms_with_its_modes_and_carries_its_stress(read, solid_arm, tmp_path):
    path = solid_arm / "scene.results.h5"
    (grid,) = view_file(path, tmp_path, GRIDS).paths
    with Results(path) as results:
        body, p = results.modal_body("arm"), results["inverse/bodies/arm/modal"]
        R, theta = results["inverse/bodies/arm/position"], results["inverse/bodies/arm/angle"]
        found = results.stress_recovery("inverse", "arm")
        largest = results["inverse/stress/arm/surface/von_mises_max"]
    columns = [body.stress_loads.index(name) for name in found.loads]
    steps = read(grid)
    assert len(steps) == 11
    for k, (_, _, points, data, _) in enumerate(steps):
        x = body.mesh.points + body.mesh.mode_shapes @ p[k]
        c, s = np.cos(theta[k]), np.sin(theta[k])
        expected = np.stack([R[k, 0] + c * x[:, 0] - s * x[:, 1], R[k, 1] + s * x[:, 0] + c * x[:, 1], x[:, 2]], axis=1)
        np.testing.assert_allclose(points, expected, rtol=0, atol=DIGITS)
        stress = body.surface_stress @ found.modal[k] + body.surface_static[..., columns] @ found.sizes[k]
        np.testing.assert_allclose(data["von_mises"], von_mises(stress), rtol=1e-6, atol=1e-6 * largest.max())
        assert data["von_mises"].max() == pytest.approx(largest[k], rel=1e-6)
    assert max(np.linalg.norm(data["deflection"], axis=1).max() for _, _, _, data, _ in steps) > 1e-3


def test_closed_loop_with_rigid_bodies(read, slider_crank, tmp_path):
    """Crank and slider have no surface: a line, and a point that is where the slider is."""
    grid, *_ = view_file(slider_crank.folder / "scene.results.h5", tmp_path, GRIDS).paths
    time, data, points, _, cells = read(grid)[-1]
    kinds = [data.GetCellType(i) for i in range(data.GetNumberOfCells())]
    assert {kind for kind, body in zip(kinds, cells["body"], strict=True) if body == 1} == {9}  # quadrilaterals
    assert kinds[-1] == 1  # a vertex
    np.testing.assert_allclose(points[-1, 0], 0.35 - 0.12 * np.sin(100 * time), rtol=0, atol=1e-6)  # scene.toml


def test_modal_body_has_its_modes_as_vectors(read, solid_arm, tmp_path):
    with Results(solid_arm / "scene.results.h5") as results:
        body, path = results.modal_body("arm"), results.modal_files["arm"].path
    cli(["view", str(path), "-o", str(tmp_path / "v"), "--no-pictures"], standalone_mode=False)
    ((_, grid, points, data, _),) = read(tmp_path / "v" / "arm.vtkhdf")
    np.testing.assert_allclose(points, body.mesh.points, rtol=0, atol=DIGITS)
    assert grid.GetNumberOfCells() == len(body.mesh.cells)
    assert sorted(data) == [
        f"mode {k + 1:02d}, {body.frequency[k]:.5g} Hz, {body.family[k]}" for k in range(len(body.family))
    ]
    for k, name in enumerate(sorted(data)):
        np.testing.assert_allclose(data[name], body.mesh.mode_shapes[:, :, k], rtol=0, atol=1e-6)


@pytest.mark.usefixtures("can_draw")
def test_picture_shows_the_arm_exaggerated(solid_arm, tmp_path, capsys):
    """In colour as exaggerated, in grey outline as it was: 1 mm of 400 mm, 60 times, is far to be seen at the tip."""
    arguments = ["view", solid_arm / "scene.results.h5", "-o", tmp_path, "--scale", 60, "--pictures"]
    cli([str(argument) for argument in arguments], standalone_mode=False)
    assert capsys.readouterr().out.split() == [
        str(tmp_path / name) for name in ("inverse.vtkhdf", "inverse.png", "inverse.stress.png")
    ]
    image = np.asarray(Image.open(tmp_path / "inverse.png").convert("RGB"), dtype=int)[30:700, 200:]
    spread = np.ptp(image, axis=2)
    colored, grey = spread > 40, (spread < 10) & (image[..., 0] > 80) & (image[..., 0] < 220)
    columns = np.flatnonzero(colored.any(axis=0))
    tip = slice(columns[-1] - 100, columns[-1])
    assert colored.sum() > 20_000
    upper, lower = (np.nonzero(part[:, tip])[0].mean() for part in (colored, grey))
    assert 100 < lower - upper < 250  # 60 mm where the arm of 400 mm is about 1050 pixels long


@pytest.mark.usefixtures("can_draw")
def test_machine_without_opengl_gets_grids_and_a_clear_message(solid_arm, tmp_path, monkeypatch):
    """VTK ends the process that draws, by a real crash: told to use OSMesa, which is not here."""
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "vtkOSOpenGLRenderWindow")
    if list(Path("/usr/lib").glob("*/libOSMesa*")):
        pytest.skip("OSMesa is installed here")
    path = solid_arm / "scene.results.h5"
    viewed = view_file(path, tmp_path / "a")
    assert [p.name for p in viewed.paths] == ["inverse.vtkhdf"]
    assert "expected OpenGL through EGL" in viewed.notes[0]
    with pytest.raises(SolveError, match="PyVista cannot draw on this machine"):
        view_file(path, tmp_path / "b", Options(pictures=True))
    assert {p.name for p in (tmp_path / "b").iterdir()} == {"inverse.vtkhdf"}


def test_what_is_refused(solid_arm, tmp_path):
    path = solid_arm / "scene.results.h5"
    with pytest.raises(InputError, match='expected one of inverse, found "invers"'):
        view_file(path, tmp_path / "a", Options(analysis="invers"))
    with pytest.raises(InputError, match=r"time: expected one of the run, 0 to .* s, found 99 s"):
        view_file(path, tmp_path / "a", Options(time=99.0))
    with pytest.raises(InputError, match="expected a folder, found a file"):
        view_file(path, path)
    with pytest.raises(InputError, match="expected a results file, found no such file"):
        view_file(tmp_path / "none.h5", tmp_path / "a")
    assert not (tmp_path / "a").exists()


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


def test_tubes_are_where_they_were_solved(arm_3r, read, tmp_path):
    """At five steps."""
    viewed = view_file(arm_3r.folder / "scene.results.h5", tmp_path, Options(frames=5, pictures=False))
    assert [path.name for path in viewed.paths] == ["inverse.vtkhdf"]
    grids = read(viewed.paths[0])
    with Results(arm_3r.folder / "scene.results.h5") as results:
        largest = results.peak("inverse/points/fore.tip/deflection")[1]  # the output next to it is in the grids
        assert [time for time, *_ in grids] == pytest.approx([0.0, 0.15, np.round(largest / 0.005) * 0.005, 0.45, 0.6])
        for time, _, points, _, cells in grids:
            (row,) = arm_3r.rows("inverse", [time])
            column, upper, fore = parts(points, results)
            assert set(cells["body"]) == {0, 1, 2}
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
