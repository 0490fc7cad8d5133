"""Parts from meshes of several formats become the part that they describe, or a clear error."""

import sys

import gmsh
import meshio
import numpy as np
import pytest
from decks import with_middles
from solid_parts import VOLUME, bar, face_area, integrate, two_bars

from ffrobot.common.errors import InputError
from ffrobot.mesh.gmsh_session import gmsh_session
from ffrobot.mesh.kept_parts import geometry_content
from ffrobot.mesh.mesh_files import read_foreign
from ffrobot.mesh.records import PlaceRecord
from ffrobot.mesh.structured import structured_box

# Ending, content, and what is expected of it.
CORRUPT = [
    ("step", "", ".*"),
    ("vtk", "", ".*"),
    *((ending, "*NODE\n1, 0., 0.\n", ".*") for ending in ("msh", "inp", "bdf", "vtu")),
    ("k", "*KEYWORD\n", r".* its ending is not one of \.step, .*"),
]


def structured_bar(cell, across=2):
    """Cells of a bar of the paper's section, 1 m long."""
    return structured_box(1.0, (0.015, 0.025), (0.015, 0.025), (8, across, across), cell)


@pytest.mark.parametrize(("ending", "content", "says"), CORRUPT)
def test_corrupt_files_are_refused(solid, mesh_part, tmp_path, ending, content, says, capfd):
    path = tmp_path / f"part.{ending}"
    path.write_text(content)
    with pytest.raises(InputError, match=rf"link.toml: geometry.file: part.{ending}: expected .*, found {says}"):
        mesh_part(solid(file=path))
    assert capfd.readouterr() == ("", "")


def test_cut_off_files_are_refused(solid, mesh_part, step_file, tmp_path):
    for name, text in {
        "half.step": step_file(bar).read_text()[:3000],
        "half.msh": write_mesh(tmp_path / "whole.msh").read_text()[:8000],
    }.items():
        (tmp_path / name).write_text(text)
        with pytest.raises(InputError, match=rf"geometry.file: {name}: expected .*, found "):
            mesh_part(solid(file=tmp_path / name, unit="mm"))


def write_mesh(path, order=1, hexahedra=False, version=4.1):
    """Two halves of a bar in millimetres with the groups "arm", "hub", "left" (x = 0) and "joint" (in the middle)."""
    with gmsh_session():
        model = gmsh.model
        two_bars(model.occ)
        model.occ.fragment([(3, 1)], [(3, 2)])
        model.occ.synchronize()
        for name, (_, tag) in zip(("arm", "hub"), model.getEntities(3), strict=True):
            model.setPhysicalName(3, model.addPhysicalGroup(3, [tag]), name)
        for name, x in (("left", 0), ("joint", 400)):
            faces = [tag for _, tag in model.getEntities(2) if abs(model.occ.getCenterOfMass(2, tag)[0] - x) < 1e-6]
            model.setPhysicalName(2, model.addPhysicalGroup(2, faces), name)
        if hexahedra:
            for _, tag in model.getEntities(1):
                model.mesh.setTransfiniteCurve(tag, 4)
            for _, tag in model.getEntities(2):
                model.mesh.setTransfiniteSurface(tag)
                model.mesh.setRecombine(2, tag)
            for _, tag in model.getEntities(3):
                model.mesh.setTransfiniteVolume(tag)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 25)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1 if order == 20 else 0)
        model.mesh.generate(3)
        model.mesh.setOrder(2 if order == 20 else order)
        gmsh.write(str(path))
    return path


@pytest.mark.parametrize(
    ("hexahedra", "order", "version"),
    [(False, 1, 2.2), (False, 2, 4.1), (True, 1, 4.1), (True, 2, 2.2), (True, 20, 4.1)],
)
def test_gmsh_meshes_keep_their_groups(solid, mesh_part, tmp_path, hexahedra, order, version):
    path = write_mesh(tmp_path / "part.msh", order, hexahedra, version)
    part = mesh_part(solid(file=path, unit="mm"), (PlaceRecord(name="root", group="left"),))
    assert part.cell == ("hexahedron" if hexahedra else "tetrahedron")
    assert part.degree == 1  # straight: the nodes on edges are not needed
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-9)
    hub = part.points[part.corners[part.cell_tag == part.regions["hub"]]]
    assert hub[..., 0].min() == pytest.approx(0.4)
    assert face_area(part, "root") == pytest.approx(VOLUME, rel=1e-9)


PARTITIONS = {
    "one file": ({}, None),
    "with copies at their faces": ({"PartitionCreateGhostCells": 1}, None),
    "a file for each": ({"PartitionSplitMeshFiles": 1}, "expected all 2 partitions of the mesh in one file, found 1"),
}


@pytest.mark.parametrize(
    ("partitions", "binary"),
    [("one file", 0), ("with copies at their faces", 0), ("with copies at their faces", 1), ("a file for each", 1)],
)
def test_partitions_of_gmsh(solid, mesh_part, tmp_path, partitions, binary):
    options, says = PARTITIONS[partitions]
    path = tmp_path / "part.msh"
    with gmsh_session():
        bar(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        gmsh.model.setPhysicalName(3, gmsh.model.addPhysicalGroup(3, [1]), "bar")
        for name, value in (options | {"MeshSizeMax": 25, "Binary": binary}).items():
            gmsh.option.setNumber(f"Mesh.{name}", value)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.partition(2)
        gmsh.write(str(path))
    if says:
        with pytest.raises(InputError, match=says):
            mesh_part(solid(file=tmp_path / "part_1.msh", unit="mm"))
        return
    part = mesh_part(solid(file=path, unit="mm"))
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-9)
    assert (list(part.regions), part.remarks) == (["bar"], ())


@pytest.mark.parametrize(
    ("place", "keys", "says"),
    [
        ({"group": "joint"}, {}, r"interface.group of hub: expected a face on the boundary .* not connected"),
        ({"group": "lift"}, {}, r'groups of faces or nodes "joint", "left", found "lift" \(did you mean "left"'),
        ({}, {"size": 0.1}, r"mesh.size: expected none, since part.msh is a mesh, found 0.1"),
    ],
)
def test_what_a_ready_mesh_does_not_have_is_refused(solid, mesh_part, tmp_path, place, keys, says):
    geometry = solid(file=write_mesh(tmp_path / "part.msh"), unit="mm")
    with pytest.raises(InputError, match=says):
        mesh_part(geometry, (PlaceRecord(name="hub" if place else "root", **place),), **keys)


@pytest.mark.parametrize("ending", ["inp", "bdf", "vtk", "vtu", "med", "xdmf"])
@pytest.mark.parametrize("kind", ["tetra10", "hexahedron"])
def test_foreign_meshes(solid, mesh_part, tmp_path, ending, kind):
    """Upper and lower face of curved tetrahedra are parabolas: ∫ 1 + 0.3 x² dx = 1.1; meshio 5.0 writes none in bdf."""
    curved = kind == "tetra10" and ending != "bdf"
    box = structured_bar("hexahedron" if kind == "hexahedron" else "tetrahedron", 1 if curved else 2)
    points, cells = with_mid_sides(box, bend=0.3) if curved else (box.points, box.cells)
    meshio.Mesh(points, [(kind if curved else kind.removesuffix("10"), cells)]).write(tmp_path / f"part.{ending}")
    part = mesh_part(solid(file=tmp_path / f"part.{ending}"))
    assert part.degree == 1 + curved
    assert integrate(part) == pytest.approx((1.1 if curved else 1.0) * VOLUME, rel=1e-6)
    assert face_area(part, "tip") == pytest.approx((1.3 if curved else 1.0) * VOLUME, rel=1e-6)


def by_vtk(grid, path, compressed=""):
    """Write a grid as VTK 9 and ParaView do: version 5.1 in binary form, or XML with appended data."""
    from vtkmodules.vtkIOLegacy import vtkUnstructuredGridWriter
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    writer = vtkXMLUnstructuredGridWriter() if path.suffix == ".vtu" else vtkUnstructuredGridWriter()
    if compressed:
        getattr(writer, f"SetCompressorTypeTo{compressed}")()
        writer.SetDataModeToAppended()
    elif path.suffix == ".vtk":
        writer.SetFileTypeToBinary()
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    writer.Write()


@pytest.mark.parametrize(("kind", "compressed"), [("TETRA", ""), ("VOXEL", "ZLib"), ("TETRA", "LZ4")])
def test_files_of_vtk_itself(solid, mesh_part, tmp_path, kind, compressed):
    """With data of points."""
    pyvista = pytest.importorskip("pyvista")
    cell = "tetrahedron" if kind == "TETRA" else "hexahedron"
    box = structured_bar(cell)
    cells = box.cells if kind == "TETRA" else box.cells[:, [0, 1, 3, 2, 4, 5, 7, 6]]
    grid = pyvista.UnstructuredGrid({pyvista.CellType[kind]: cells}, box.points)
    grid.point_data["u"] = box.points / 7
    path = tmp_path / ("part.vtu" if compressed else "part.vtk")
    by_vtk(grid, path, compressed)
    part = mesh_part(solid(file=path))
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-6)
    assert not part.remarks


def test_cells_that_meshio_leaves_out_are_not_dropped(tmp_path, monkeypatch):
    """A voxel beside tetrahedra, where VTK is not installed."""
    pyvista = pytest.importorskip("pyvista")
    cells = np.array([[0, 1, 2, 4]]), np.array([[0, 1, 2, 3, 4, 5, 6, 7]])
    points = np.array([[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1)], dtype=float)
    kinds = pyvista.CellType.TETRA, pyvista.CellType.VOXEL
    pyvista.UnstructuredGrid(dict(zip(kinds, cells, strict=True)), points).save(tmp_path / "part.vtu")
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(InputError, match="cells that meshio cannot handle"):
        read_foreign(tmp_path / "part.vtu")


@pytest.mark.parametrize(("kind", "bend"), [("HEXAHEDRON", None), ("TETRAHEDRON", None), ("TETRAHEDRON", 0.3)])
def test_cells_of_any_degree_of_vtk(solid, mesh_part, tmp_path, kind, bend):
    """As FEniCSx and ParaView write them; with 10 nodes the volume is that of parabolas: ∫ 1 + 0.3 x² dx = 1.1."""
    pyvista = pytest.importorskip("pyvista")
    box = structured_bar(kind.lower(), 1)
    points, cells = (box.points, box.cells) if bend is None else with_mid_sides(box, bend)
    of = np.column_stack([np.full(len(cells), cells.shape[1]), cells]).ravel()
    kinds = np.full(len(cells), int(pyvista.CellType[f"LAGRANGE_{kind}"]))
    pyvista.UnstructuredGrid(of, kinds, points).save(tmp_path / "part.vtu")
    part = mesh_part(solid(file=tmp_path / "part.vtu"))
    assert integrate(part) == pytest.approx((1.1 if bend else 1.0) * VOLUME, rel=1e-6)


def test_hidden_cells_of_vtk_are_rejected(solid, mesh_part, tmp_path):
    """ParaView's blanking: meshio shows all cells, VTK's own reader the others."""
    pyvista = pytest.importorskip("pyvista")
    box = structured_bar("hexahedron")
    grid = pyvista.UnstructuredGrid({pyvista.CellType.HEXAHEDRON: box.cells}, box.points)
    grid.cell_data["vtkGhostType"] = np.repeat(np.array([0, 32], dtype=np.uint8), [30, 2])
    by_vtk(grid, tmp_path / "part.vtu")
    with pytest.raises(InputError, match="2 cells that vtkGhostType hides"):
        mesh_part(solid(file=tmp_path / "part.vtu"))


def with_mid_sides(box, bend=0.0):
    """The tetrahedra of `box` with 10 nodes, as meshio numbers them; `bend` makes its upper edge a parabola."""
    points, cells = with_middles(box.points, box.cells)
    points[:, 1] *= 1 + bend * points[:, 0] ** 2
    return points, cells


@pytest.mark.parametrize(
    ("blocks", "says"),
    [
        ([("triangle", [[0, 1, 2]])], "expected a mesh of volume elements, found none: 1 triangles or quadrilaterals"),
        ([("wedge", [[0, 1, 2, 3, 4, 5]])], "found unsupported elements: 1 wedge"),
        (
            [("tetra", [[0, 1, 2, 3]]), ("hexahedron", [[0, 1, 2, 3, 4, 5, 6, 7]])],
            "found a mixture: 1 tetra, 1 hexahedron",
        ),
    ],
)
def test_other_elements_are_refused(solid, mesh_part, tmp_path, blocks, says):
    points = np.random.default_rng(1).random((8, 3))
    meshio.Mesh(points, [(kind, np.array(cells)) for kind, cells in blocks]).write(tmp_path / "part.vtk")
    with pytest.raises(InputError, match=says):
        mesh_part(solid(file=tmp_path / "part.vtk"))


def test_curved_hexahedra_of_20_nodes_are_refused(solid, mesh_part, tmp_path):
    path = write_mesh(tmp_path / "part.msh", 20, hexahedra=True)
    mesh = meshio.read(path)
    bent = mesh.points * [1, 1, 1]
    bent[:, 1] *= 1 + 1e-6 * bent[:, 0] ** 2
    cells = np.concatenate([block.data for block in mesh.cells if block.type == "hexahedron20"])
    meshio.Mesh(bent, [("hexahedron20", cells)]).write(tmp_path / "bent.vtu")
    with pytest.raises(InputError, match="found hexahedra of 20 nodes"):
        mesh_part(solid(file=tmp_path / "bent.vtu", unit="mm"))


@pytest.mark.parametrize("number", [2147483648, -1, 81])
def test_nodes_that_are_not_there_are_refused(solid, mesh_part, tmp_path, number):
    """In a VTK file of 81 nodes, which count from 0."""
    box = structured_bar("tetrahedron")
    path = tmp_path / "part.vtk"
    meshio.Mesh(box.points, [("tetra", box.cells)]).write(path, binary=False)
    first = " ".join(map(str, box.cells[0]))
    text = path.read_text()
    assert first in " ".join(text.split())
    at = text.index("CONNECTIVITY" if "CONNECTIVITY" in text else "CELLS")
    path.write_text(text[:at] + text[at:].replace(f"\n{box.cells[0][0]}", f"\n{number}", 1))
    with pytest.raises(InputError, match=r"geometry.file: part.vtk: expected .*, found "):
        mesh_part(solid(file=path))


@pytest.mark.parametrize("ending", ["ele", "node", "xml"])
def test_files_beside_a_mesh_count(solid, tmp_path, ending):
    """The other one of TetGen's two files, and groups of FEniCS: a mesh is another one where these are."""
    box, path, known = structured_bar("tetrahedron"), tmp_path / f"bar.{ending}", set()
    for size in (1, 2):
        points, cells = (box.points * size, box.cells) if ending == "ele" else (box.points, box.cells[::size])
        if ending == "xml":
            meshio.write(path, meshio.Mesh(box.points, [("tetra", box.cells)]))
            values = "".join(f'<entity index="{k}" value="{size}"/>' for k in range(len(box.cells)))
            head = f'<mesh_function type="int" dim="3" size="{len(box.cells)}">'
            (tmp_path / "bar_parts.xml").write_text(f"<dolfin>{head}{values}</mesh_function></dolfin>")
            assert set(read_foreign(path).regions) == {str(size)}
        else:
            meshio.write(tmp_path / "bar.node", meshio.Mesh(points, [("tetra", cells)]))
            found = read_foreign(path)
            np.testing.assert_allclose(found.points, points)
            np.testing.assert_array_equal(found.blocks[0][1], cells)
        known.add(str(geometry_content(solid(file=path))))
    assert len(known) == 2
