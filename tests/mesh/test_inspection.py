"""What is found in a part's file without a link file, and the draft of one: a plate with bores, by closed forms."""

import tomllib

import gmsh
import meshio
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ffrobot.exchange.part_draft import draft_link
from ffrobot.fe_models.link import computed_modal_body
from ffrobot.mesh.cells import reference_nodes, volume_and_center
from ffrobot.mesh.gmsh_session import gmsh_session
from ffrobot.mesh.inspection import inspect_part
from ffrobot.mesh.structured import structured_box

LENGTH, HEIGHT, THICKNESS, RADIUS = 300.0, 40.0, 10.0, 12.0
BORES = (25.0, 150.0, 275.0)
VOLUME = THICKNESS * (LENGTH * HEIGHT - 3 * np.pi * RADIUS**2) * 1e-9


def plate(path, bores=BORES, *, mesh=False):
    with gmsh_session():
        cad = gmsh.model.occ
        bar = cad.addBox(0, -HEIGHT / 2, -THICKNESS / 2, LENGTH, HEIGHT, THICKNESS)
        tools = [(3, cad.addCylinder(x, 0, -THICKNESS / 2, 0, 0, THICKNESS, RADIUS)) for x in bores]
        if tools:
            cad.cut([(3, bar)], tools)
        cad.synchronize()
        if mesh:
            gmsh.option.setNumber("Mesh.MeshSizeMax", 20.0)
            gmsh.model.mesh.generate(3)
        gmsh.write(str(path))


def bores_of(part):
    return sorted((face for face in part.faces if face.kind == "bore"), key=lambda face: face.center[0])


def test_a_step_file(tmp_path):
    plate(tmp_path / "plate.step")
    part = inspect_part(tmp_path / "plate.step")
    assert (part.unit, part.is_declared) == ("mm", True)
    np.testing.assert_allclose(part.high - part.low, [0.3, 0.04, 0.01], atol=1e-9)
    assert part.volume == pytest.approx(VOLUME, rel=2e-4)
    found = bores_of(part)
    for x, bore in zip(BORES, found, strict=True):
        np.testing.assert_allclose(bore.center, [x / 1000, 0, 0], atol=1e-8)
        np.testing.assert_allclose(np.abs(bore.direction), [0, 0, 1], atol=1e-6)
        assert bore.radius == pytest.approx(RADIUS / 1000, rel=1e-6)
    planes = [face for face in part.faces if face.kind == "plane"]
    assert len(planes) == 6
    assert sum(face.area for face in planes[2:4]) == pytest.approx(2 * 0.3 * 0.01, rel=1e-9)


@pytest.mark.parametrize("order", [[0, 1, 2, 3, 4, 5, 6, 7], [3, 0, 1, 2, 7, 4, 5, 6]])
def test_a_bar_of_hexahedra_that_twists(order, tmp_path):
    """By φ over its length, n cells of length L/n: each slice is an affine image, of area bh ((2 + cos φ/n)/3)."""
    length, height, width, turn, count = 0.3, 0.04, 0.02, 1.2, 6
    bar = structured_box(length, (height, width), (height, width), (count, 2, 1), "hexahedron")
    x, y, z = bar.points.T
    a = turn * x / length
    points = np.column_stack([x, np.cos(a) * y - np.sin(a) * z, np.sin(a) * y + np.cos(a) * z])
    meshio.Mesh(points, [("hexahedron", bar.cells[:, order])]).write(tmp_path / "bar.vtk")
    part = inspect_part(tmp_path / "bar.vtk", "m")
    assert part.volume == pytest.approx(length * height * width * (2 + np.cos(turn / count)) / 3, rel=1e-12)
    np.testing.assert_allclose(part.center, [length / 2, 0, 0], atol=1e-12)


@pytest.mark.parametrize("divisions", [(10, 1, 1), (12, 2, 1), (9, 3, 2)])
def test_a_square_bar_gets_axes_along_its_faces(divisions, tmp_path):
    """Both transverse axes are principal, any is right. The draft has the density that is given, and its stiffness."""
    bar = structured_box(0.4, (0.04, 0.04), (0.04, 0.04), divisions, "tetrahedron")
    meshio.Mesh(bar.points, [("tetra", bar.cells)]).write(tmp_path / "bar.vtk")
    part = inspect_part(tmp_path / "bar.vtk", "m")
    for density, modulus, word in ((None, 70e9, "aluminum."), (7800.0, 210e9, "steel."), (1200.0, 70e9, "replace it")):
        text = draft_link(part, tmp_path / "bar.vtk", "bar", tmp_path, density)
        draft = tomllib.loads(text)
        np.testing.assert_allclose(draft["geometry"]["y_axis"], [0, 1, 0], atol=1e-9)
        assert draft["material"]["density"] == (density or 2700.0)
        assert draft["material"]["youngs_modulus"] == modulus
        assert word in text.splitlines()[1]


@pytest.mark.parametrize("cell", ["tetrahedron", "hexahedron"])
def test_volumes_of_curved_cells(cell):
    """A box sheared by squares, which cells of degree 2 follow exactly: its volume stays, its center is known."""
    sides = np.array([0.3, 0.2, 0.5])
    box = structured_box(1.0, (1.0, 1.0), (1.0, 1.0), (1, 1, 1), cell)
    corners = (box.points + np.array([0, 0.5, 0.5]))[box.cells]
    edges = (corners[:, [1, 3, 4] if cell == "hexahedron" else [1, 2, 3]] - corners[:, :1]).transpose(0, 2, 1)
    nodes = (corners[:, :1] + np.einsum("cij,vj->cvi", edges, reference_nodes(cell, 2))) * sides
    x, y, z = np.moveaxis(nodes, 2, 0)
    bent = np.stack([x + 2 * y**2 - z**2, y + z**2, z], axis=2)
    volume, center = volume_and_center(bent, cell, 2)
    assert volume == pytest.approx(sides.prod(), rel=1e-13)
    _, y2, z2 = sides**2 / 3
    np.testing.assert_allclose(center, sides / 2 + [2 * y2 - z2, z2, 0], rtol=1e-13)


def test_shafts_are_not_bores(tmp_path):
    with gmsh_session():
        gmsh.model.occ.addCylinder(0, 0, 0, 0, 200, 0, 15)
        gmsh.model.occ.synchronize()
        gmsh.write(str(tmp_path / "rod.step"))
    part = inspect_part(tmp_path / "rod.step")
    (shaft,) = (face for face in part.faces if face.kind != "plane")
    assert (shaft.kind, shaft.radius) == ("shaft", pytest.approx(0.015, rel=1e-6))
    np.testing.assert_allclose(shaft.center, [0, 0.1, 0], atol=1e-8)


@pytest.mark.parametrize(("bores", "length"), [(BORES, 0.25), ((), 0.3)])
def test_a_draft_wherever_the_part_lies(bores, length, tmp_path):
    """A mesh, and the same turned and moved: links of one mass and one frequency, between bores or plane ends."""
    plate(tmp_path / "plate.msh", bores, mesh=True)
    mesh = meshio.read(tmp_path / "plate.msh")
    turn = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix()
    cells = [(block.type, block.data) for block in mesh.cells if block.type == "tetra"]
    bodies = []
    for name, points in (("here", mesh.points), ("there", mesh.points @ turn.T + [500.0, -20.0, 70.0])):
        file = tmp_path / f"{name}.vtk"
        meshio.Mesh(points, cells).write(file)
        part = inspect_part(file)
        assert (part.unit, part.is_declared) == ("mm", False)
        link = tmp_path / f"{name}.toml"
        link.write_text(draft_link(part, file, name, tmp_path))
        bodies.append(computed_modal_body(link))
    here, there = bodies
    assert here.length == pytest.approx(length, rel=1e-6)
    assert there.length == pytest.approx(length, rel=1e-6)
    assert here.mass == pytest.approx(there.mass, rel=1e-9)
    np.testing.assert_allclose(here.frequency[:3], there.frequency[:3], rtol=1e-6)


def test_other_faces_of_a_draft_have_their_numbers(tmp_path):
    """Those of the table and the picture: a face is as far from the root in the link as in the file."""
    plate(tmp_path / "plate.step")
    part = inspect_part(tmp_path / "plate.step")
    draft = draft_link(part, tmp_path / "plate.step", "plate", tmp_path).split("\n# [[interface]]\n")
    root = bores_of(part)[0]
    assert len(draft) == 1 + len(part.faces) - 2
    for block in draft[1:]:
        keys = tomllib.loads(block.replace("# ", ""))
        kind, number = keys["name"].split("_")
        face = part.faces[int(number) - 1]
        assert kind == face.kind
        assert np.linalg.norm(keys["position"]) == pytest.approx(np.linalg.norm(face.point - root.point), abs=1e-8)


def test_axes_of_a_fork_are_those_of_its_faces(tmp_path):
    """Of the two lugs at its end the draft takes one, 10 mm off the plane of symmetry."""
    with gmsh_session():
        cad = gmsh.model.occ
        whole, slot = cad.addBox(0, -20, -15, 300, 40, 30), cad.addBox(230, -20, -5, 70, 40, 10)
        bores = [(3, cad.addCylinder(x, 0, -15, 0, 0, 30, RADIUS)) for x in (25, 275)]
        cad.cut([(3, whole)], [(3, slot), *bores])
        cad.synchronize()
        gmsh.write(str(tmp_path / "fork.step"))
    keys = tomllib.loads(draft_link(inspect_part(tmp_path / "fork.step"), tmp_path / "fork.step", "fork", tmp_path))
    assert keys["geometry"]["length"] == pytest.approx(0.25, rel=1e-9)
    np.testing.assert_allclose(
        np.abs([keys["geometry"][axis] for axis in ("x_axis", "y_axis")]), np.eye(3)[:2], atol=1e-9
    )
    np.testing.assert_allclose(np.abs(keys["interface"][1]["position"]), [0.25, 0, 0.01], atol=1e-9)


def test_the_command(tmp_path, ffrobot):
    plate(tmp_path / "plate.step")
    done = ffrobot.ok("link", "plate.step", "--inspect", "--density", "2700", "-o", "plate.toml", cwd=tmp_path)
    assert f"mass {2700 * VOLUME:.4f}"[:10] in done.stdout
    assert "drawn in mm" in done.stdout
    assert (tmp_path / "plate.faces.png").read_bytes().startswith(b"\x89PNG")
    assert ffrobot("link", "plate.step", "--inspect", "-o", "plate.toml", cwd=tmp_path).returncode == 2
    assert "no such file" in ffrobot("link", "gone.step", "--inspect", cwd=tmp_path).stderr
    assert "--inspect" in ffrobot("link", "plate.toml", "--unit", "mm", cwd=tmp_path).stderr
