"""MED files as gmsh 4.15 and medcoupling 9.15 write them: cells are left-handed, some families have no groups."""

import h5py
import numpy as np
import pytest
from decks import VOLUME, bar, tetrahedra
from solid_parts import face_area, integrate

from ffrobot.common.errors import InputError
from ffrobot.mesh.records import PlaceRecord

STEP = "-0000000000000000001-0000000000000000001"
FACES = ((0, 1, 2, 3), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (0, 3, 7, 4), (4, 5, 6, 7))  # of H27, in their order
EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
POINTS, HEXAHEDRA = bar()
MIRRORED = {8: [4, 5, 6, 7, 0, 1, 2, 3], 4: [0, 2, 1, 3]}


def write(path, blocks, points=POINTS, families=(), node_family=None, node_families=(), name="mesh", **attributes):
    """`blocks`: type → cells, and families of these; `families`: (number, groups)."""
    with h5py.File(path, "a") as file:
        mesh = file.create_group(f"ENS_MAA/{name}")
        mesh.attrs.update({"ESP": 3, "REP": 0, "TYP": 0, "UNI": np.bytes_("")} | attributes)
        nodes = mesh.create_group(f"{STEP}/NOE")
        nodes["COO"] = points.ravel(order="F")
        if node_family is not None:
            nodes["FAM"] = node_family
        for kind, (cells, family) in blocks.items():
            of = mesh.create_group(f"{STEP}/MAI/{kind}")
            of["NOD"] = np.asarray(cells).ravel(order="F") + 1
            if family is not None:
                of["FAM"] = family
        for kind, all_families in (("ELEME", families), ("NOEUD", node_families)):
            for number, groups in all_families:
                family = file.create_group(f"FAS/{name}/{kind}/F{number}")
                family.attrs["NUM"] = number
                if groups:
                    text = np.array([np.frombuffer(group.encode().ljust(80, b"\0"), dtype="i1") for group in groups])
                    family.create_dataset("GRO/NOM", (len(groups),), np.dtype(("i1", (80,))))[...] = text
    return path


def left_handed(cells):
    return cells[:, MIRRORED[cells.shape[1]]]


@pytest.mark.parametrize(("kind", "cells"), [("HE8", HEXAHEDRA), ("TE4", tetrahedra(HEXAHEDRA))])
def test_groups_of_families(solid, mesh_part, tmp_path, kind, cells):
    """Family -3 belongs to two groups, -2 to none; so do nodes."""
    x = POINTS[cells].mean(axis=1)[:, 0]
    family = np.select([x < 0.3, x < 0.6], [-1, -3], -2)
    left = np.where(POINTS[:, 0] == 0, 5, 6)
    path = write(
        tmp_path / "part.med", {kind: (left_handed(cells), family), "PO1": ([[0]], None)},
        families=[(-1, ["arm"]), (-2, []), (-3, ["arm", "größe"])],
        node_family=left, node_families=[(5, ["left"]), (6, [])],
    )  # fmt: skip
    part = mesh_part(solid(file=path), (PlaceRecord(name="root", group="left"),))
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-12)
    assert face_area(part, "root") == pytest.approx(0.02, rel=1e-12)
    tags = {name: [tag, *part.overlaps.get(name, ())] for name, tag in part.regions.items()}
    cells_of = {name: np.isin(part.cell_tag, of).tolist() for name, of in tags.items()}
    assert cells_of == {"arm": (x < 0.6).tolist(), "größe": ((x > 0.3) & (x < 0.6)).tolist()}
    assert not part.remarks


def test_faces_of_groups(solid, mesh_part, tmp_path):
    points = np.flatnonzero(POINTS[:, 0] == 0)
    quads = np.array([[points[k] for k in (0, 1, 3, 2)], [points[k] for k in (2, 3, 5, 4)]])
    blocks = {"HE8": (HEXAHEDRA, None), "QU4": (quads, np.array([-7, -7])), "SE2": (HEXAHEDRA[:1, :2], None)}
    path = write(tmp_path / "part.med", blocks, families=[(-7, ["left"])])
    part = mesh_part(solid(file=path), (PlaceRecord(name="root", group="left"),))
    assert face_area(part, "root") == pytest.approx(0.02, rel=1e-12)


@pytest.mark.parametrize("mirror", [False, True])
def test_curved_hexahedra_of_27_nodes(solid, mesh_part, tmp_path, mirror):
    """y times 1 + 0.3 x² is a parabola along each cell: ∫ 1 + 0.3 x² dx = 1.1."""
    hexahedra = left_handed(HEXAHEDRA) if mirror else HEXAHEDRA
    corners = POINTS[hexahedra]
    middles = [corners[:, of].mean(axis=1) for of in (*EDGES, *FACES, tuple(range(8)))]
    whole = np.concatenate([corners, np.stack(middles, axis=1)], axis=1)
    points, flat = np.unique(np.round(whole.reshape(-1, 3), 12), axis=0, return_inverse=True)
    points[:, 1] *= 1 + 0.3 * points[:, 0] ** 2
    part = mesh_part(solid(file=write(tmp_path / "part.med", {"H27": (flat.reshape(-1, 27), None)}, points)))
    assert part.degree == 2
    assert integrate(part) == pytest.approx(1.1 * VOLUME, rel=1e-12)


@pytest.mark.parametrize(
    ("blocks", "attributes", "says"),
    [
        ({}, {"REP": 1}, "expected Cartesian coordinates, found cylindrical"),
        ({}, {"TYP": 1}, "expected a mesh of cells, found a structured grid"),
        ({}, {"ESP": 2}, "expected a mesh in 3D, found one in 2 dimensions"),
        ({"POE": (HEXAHEDRA[:1], None)}, {}, "found POE"),
    ],
)
def test_meshes_of_other_kinds(solid, mesh_part, tmp_path, blocks, attributes, says):
    path = write(tmp_path / "part.med", {"HE8": (HEXAHEDRA, None)} | blocks, **attributes)
    with pytest.raises(InputError, match=says):
        mesh_part(solid(file=path))
    write(path, {"HE8": (HEXAHEDRA, None)}, name="other")
    with pytest.raises(InputError, match="expected one mesh, found 2: mesh, other"):
        mesh_part(solid(file=path))


def test_a_unit_of_the_file_is_told(solid, mesh_part, tmp_path):
    unit = np.bytes_("mm".ljust(16) * 3)
    path = write(tmp_path / "part.med", {"HE8": (HEXAHEDRA, None)}, 1000 * POINTS, UNI=unit)
    part = mesh_part(solid(file=path, unit="mm"))
    assert part.remarks == ("the file says that its unit is mm: `unit` in the link file counts",)


@pytest.mark.parametrize("damage", ["text", "NOD", "COO", "FAM"])
def test_damaged_files(solid, mesh_part, tmp_path, damage):
    path = write(tmp_path / "part.med", {"HE8": (HEXAHEDRA, np.zeros(len(HEXAHEDRA), dtype=int))})
    if damage == "text":
        path.write_text("no HDF5")
    else:
        with h5py.File(path, "a") as file:
            name = f"ENS_MAA/mesh/{STEP}/{'NOE/COO' if damage == 'COO' else f'MAI/HE8/{damage}'}"
            content = file[name][:-1]
            del file[name]
            file[name] = content
    with pytest.raises(InputError, match=r"geometry.file: part.med: expected .*, found "):
        mesh_part(solid(file=path))
