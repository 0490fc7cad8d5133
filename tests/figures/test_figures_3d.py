"""Figures of motions: which there are, that bodies are drawn where they were solved, and to scale."""

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from PIL import Image

from ffrobot.common.errors import InputError
from ffrobot.pictures.figures.configurations import draw_configurations
from ffrobot.pictures.figures.plot import draw, plot_file
from ffrobot.pictures.figures.shared import FigureRecord
from ffrobot.pictures.figures.standard import standard_figures
from ffrobot.pictures.figures.style import SceneAxes
from ffrobot.pictures.motion import moving_bodies, section_axes
from ffrobot.pictures.projection import FRONT, PLANE, SIDE, SPACE
from ffrobot.pictures.shapes import line_shape
from ffrobot.results.file import Results

FRAMES = np.array([0, 20, 61, 120])


@pytest.fixture(scope="module")
def arm(arm_3r):
    with Results(arm_3r.folder / "scene.results.h5") as results:
        yield results


@pytest.fixture(scope="module")
def crank(slider_crank_3d):
    with Results(slider_crank_3d.folder / "scene.results.h5") as results:
        yield results


def test_standard_figures(arm, crank):
    names = {record.name for record in standard_figures(arm)}
    per_joint = {f"{what}_{joint}" for joint in ("waist", "shoulder", "elbow")
                 for what in ("coordinate", "moment", "torque_speed", "reaction")}  # fmt: skip
    assert per_joint <= names
    assert {"configurations_inverse", "path_tool", "force_tool", "energy_inverse", "deflection_fore.tip",
            "modal_inverse_upper", "modal_force_inverse_fore"} <= names  # fmt: skip
    names = {record.name for record in standard_figures(crank)}
    assert {"coordinate_universal_1", "coordinate_universal_2", "reaction_ball", "coordinate_guide"} <= names
    assert not {"moment_universal_1", "coordinate_ball", "deflection_crank.tip"} & names  # no motor, no angle, rigid


def test_every_standard_figure_is_drawn(arm_3r, tmp_path):
    results = tmp_path / "scene.results.h5"  # without figures.toml beside it
    results.write_bytes((arm_3r.folder / "scene.results.h5").read_bytes())
    paths = plot_file(results, tmp_path / "figures", ["png"], ["*"])
    with Results(results) as opened:
        assert [path.stem for path in paths] == [record.name for record in standard_figures(opened)]
    for path in paths:
        assert (np.asarray(Image.open(path).convert("L")) < 100).sum() > 300  # axes, labels, curves


@pytest.mark.parametrize("s", [1.0, 40.0])
def test_links_are_drawn_where_they_were_solved_and_joined(arm, s):
    """Ends of the lines against the file; at 40 times the deflection, too, each begins where the one before it ends."""
    bodies = moving_bodies(arm, "inverse", FRAMES)
    drawn = {}
    for body in bodies:
        at = line_shape(arm, body, []).placed(s)
        drawn[body.name] = at
        if s == 1.0:
            for end, label in ((0, "root"), (-1, "tip" if body.name != "column" else "top")):
                expected = arm[f"inverse/points/{body.name}.{label}/position"][FRAMES]
                at_end = at[:, end] if body.name != "column" else at[:, np.argsort(body.points[:, 2])[end]]
                np.testing.assert_allclose(at_end, expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(drawn["fore"][:, 0], drawn["upper"][:, -1], rtol=0, atol=1e-12)
    bent = np.linalg.norm(drawn["fore"][:, -1] - arm["inverse/points/fore.tip/position"][FRAMES], axis=1)
    assert bent.max() < 1e-12 if s == 1.0 else bent.max() > 0.1


def test_sections_have_the_axes_of_the_file(crank):
    """The universal joint's axes are square at all times: z of the crank's tip, y of the rod's root."""
    bodies = moving_bodies(crank, "inverse", FRAMES)
    z = section_axes(bodies, "crank.tip", len(FRAMES))[:, :, 2]
    y = section_axes(bodies, "rod.root", len(FRAMES))[:, :, 1]
    np.testing.assert_allclose(np.sum(z * y, axis=1), 0.0, atol=1e-10)
    axis = [0.19047253607043549, -0.47618134017608871, 0.85847046790847781]  # of the crank, scene.toml
    np.testing.assert_allclose(z, np.tile(axis, (len(FRAMES), 1)), atol=1e-12)


def test_a_metre_is_as_long_on_all_axes(arm, crank):
    """Every view has one scale; its two directions and that towards the viewer are a right-handed trihedron."""
    for results in (arm, crank):
        record = next(r for r in standard_figures(results) if r.kind == "configurations")
        picture = draw_configurations(record, results)
        assert isinstance(picture, Figure)
        assert [axes.get_aspect() for axes in picture.axes] == [1.0] * 3
    for view in (PLANE, SPACE, FRONT, SIDE):
        np.testing.assert_allclose(np.array(view) @ np.array(view).T, np.eye(3), atol=1e-15)
        np.testing.assert_allclose(np.cross(view.right, view.up), view.viewer, atol=1e-15)


def test_configurations_hold_every_link_at_every_time(arm):
    """In all three views: one step of the arm at x, y, z is at its x, y from above and at its x, z from the front."""
    record = FigureRecord(name="c", kind="configurations", analysis="inverse", times=(0.0, 0.1, 0.6), exaggeration=3.0)
    corner, above, level = draw_configurations(record, arm).axes
    assert "deflections × 3" in corner.get_title(loc="left")
    assert [axes.get_xlabel() + axes.get_ylabel() for axes in (above, level)] == ["x (m)y (m)", "x (m)z (m)"]
    bodies = moving_bodies(arm, "inverse", FRAMES[[0, 1, 3]])
    for axes, right, up in (
        (corner, SPACE.right, SPACE.up),
        (above, [1, 0, 0], [0, 1, 0]),
        (level, [1, 0, 0], [0, 0, 1]),
    ):
        drawn = np.concatenate([np.concatenate(c.get_segments()) for c in axes.collections])
        assert len(axes.collections) == 3 * 3  # times, bodies
        for body in bodies:
            at = line_shape(arm, body, []).placed(3.0)
            at = np.stack([at @ right, at @ up], axis=-1)
            assert np.all(at > [axes.get_xlim()[0], axes.get_ylim()[0]])
            assert np.all(at < [axes.get_xlim()[1], axes.get_ylim()[1]])
            away = np.linalg.norm(at.reshape(-1, 1, 2) - drawn, axis=2).min(axis=1)
            assert away.max() < (0.02 if axes is corner else 1e-12)  # tubes of 8 and 11 mm seen from the corner


def test_outline_of_a_surface_goes_around_its_opening():
    """Area by Gauss' theorem over the edges that are drawn: of a plate with a square hole, seen from its face."""
    x = np.arange(4.0)
    points = np.stack([*np.meshgrid(x, x, indexing="ij"), np.zeros((4, 4))], axis=-1).reshape(-1, 3)
    cells = np.array([[4 * i + j, 4 * i + j + 4, 4 * i + j + 5, 4 * i + j + 1] for i in range(3) for j in range(3)])
    picture = Figure()
    axes = SceneAxes(picture.subplots(), PLANE)
    axes.body(points, np.delete(cells, 4, axis=0), "C0")
    axes.body(points, cells[:, ::-1], "C1")  # from behind: nothing is seen
    axes.finish()
    outline, behind = (np.array(one.get_segments()) for one in axes.axes.collections if isinstance(one, LineCollection))
    assert len(outline) == 16
    assert np.sum(np.cross(outline[:, 0], outline[:, 1])) / 2 == pytest.approx(8.0)
    assert len(behind) == 0


def test_paths_in_3d_have_three_columns(arm):
    curve = {"data": "inverse/points/fore.tip/position", "label": "tip"}
    corner, above, level = draw(FigureRecord(name="p", kind="path", curves=(curve,)), arm).axes
    x, y, z = arm[curve["data"]].T
    np.testing.assert_array_equal(above.lines[0].get_data(), [x, y])
    np.testing.assert_array_equal(level.lines[0].get_data(), [y, z])  # the line goes farther in y than in x
    np.testing.assert_allclose(corner.lines[0].get_data(), [arm[curve["data"]] @ d for d in SPACE[:2]], atol=1e-15)
    wrong = {"data": "inverse/points/fore.tip/quaternion", "label": "tip"}
    with pytest.raises(InputError, match=r'expected three columns \(x, y, z\) in ".*quaternion", found 4'):
        draw(FigureRecord(name="p", kind="path", curves=(wrong,)), arm)
