"""Pictures of modal bodies: of a beam from stage 1, and of surfaces made up of triangles and quadrilaterals."""

from dataclasses import replace
from itertools import count

import numpy as np
import pytest
from beam_links import beam_link, rectangle

import ffrobot
from ffrobot.cli import cli
from ffrobot.fe_models.modal_body import PictureMesh
from ffrobot.fe_models.modal_body_file import write_modal_body
from ffrobot.pictures.figures.plot import FOLD, _outline, draw_mesh, draw_modes

# Faces of a unit cube, their corners in order around each.
CUBE = np.array([[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]])
CORNERS = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])


@pytest.fixture(scope="module")
def beam():
    keys = {"E": 2.0e11, "nu": 0.3, "rho": 7800.0, "name": "arm", "modes": {"count": 8}}
    return ffrobot.make_link(beam_link(1.0, rectangle(0.1, 0.05), 10, **keys)).body


@pytest.fixture(params=["triangles", "quadrilaterals"])
def solid(beam, request):
    """A box of the beam's size whose eight corners move as its sections do."""
    cells = CUBE if request.param == "quadrilaterals" else np.concatenate([CUBE[:, [0, 1, 2]], CUBE[:, [0, 2, 3]]])
    points = (CORNERS - [0, 0.5, 0.5]) * [1.0, 0.1, 0.05]
    at = [beam.interpolate(x) for x in points[:, 0]]
    shapes = np.array([a.translation + np.cross(a.rotation.T, [0, *x[1:]]).T for a, x in zip(at, points, strict=True)])
    return replace(beam, kind="solid", mesh=PictureMesh(points, cells, shapes))


def test_a_beam_is_drawn_at_all_its_stations(beam):
    """Corners of its section on a ring at each, twisted ones too; titles say frequency and family."""
    axes = draw_modes(beam).axes
    titles = [f"{k}: {f:.5g} Hz, {family}" for k, f, family in zip(count(1), beam.frequency, beam.family, strict=False)]
    assert [one.get_title(loc="left") for one in axes] == titles[:6]
    for one in axes:
        _, surface = one.collections
        assert len(surface.get_paths()) >= 4 * (len(beam.stations.position) - 1)
        assert not one.texts[0].get_text().startswith("the axis")


def test_modes_of_a_solid_are_drawn_over_its_outline(solid):
    figure = draw_modes(solid)
    for axes in figure.axes:
        outline, surface = axes.collections
        assert len(outline.get_segments()) == 12  # a box has twelve edges; diagonals of its faces are none
        assert len(surface.get_paths()) == len(solid.mesh.cells)
        assert surface.get_zorder() > outline.get_zorder()


def test_mesh_shows_cells_and_interfaces(solid, beam):
    axes = draw_mesh(solid).axes
    assert len(axes) == 1  # no cell but the end face is whole within a close-up
    quadrilaterals = solid.mesh.cells.shape[1] == 4
    sides = 12 if quadrilaterals else 18  # the diagonals, too, are sides of triangles
    lines = [path for path in axes[0].collections[0].get_paths() if len(np.unique(path.vertices, axis=0)) == 2]
    assert len(axes[0].collections[0].get_paths()) - len(lines) == len(solid.mesh.cells)
    assert len({tuple(path.vertices.mean(axis=0).round(9)) for path in lines}) == sides
    assert {"root", "tip"} <= {line.get_label() for line in axes[0].lines}
    assert len(draw_mesh(beam).axes[0].collections[0].get_segments()) == 10


def test_fold_of_a_roof_and_border_of_an_open_surface():
    """Two triangles that meet at 90° share a fold; all else is border. Flat, the diagonal goes."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    cells = np.array([[0, 1, 2], [1, 3, 2]])
    edges, viewer = {(0, 1), (0, 2), (1, 3), (2, 3)}, np.array([0.0, 0.0, 1.0])
    assert set(map(tuple, _outline(points, cells, viewer))) == edges
    points[3, 2] = 5.0
    assert set(map(tuple, _outline(points, cells, viewer))) == edges | {(1, 2)}
    assert 0.8 < FOLD < 0.9


def test_command_tells_modal_bodies_from_results(solid, tmp_path, capsys):
    path = tmp_path / "arm.h5"
    write_modal_body(path, solid)
    cli(["plot", str(path)], standalone_mode=False)
    folder = tmp_path / "arm.figures"
    written = [folder / f"{name}.{kind}" for name in ("mesh", "modes") for kind in ("png", "pdf")]
    assert capsys.readouterr().out.split() == [str(p) for p in written]
    assert all(p.stat().st_size > 2000 for p in written)
