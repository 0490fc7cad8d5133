"""Solid parts for the tests of the meshes: what a link file's tables would ask for, and files as users bring them."""

from pathlib import Path

import gmsh
import pytest
from solid_parts import rectangle

from ffrobot.mesh.gmsh_session import gmsh_session
from ffrobot.mesh.part import part_mesh
from ffrobot.mesh.records import PartTables, SolidGeometry, SolidMeshRecord

LINK = Path("link.toml")


@pytest.fixture
def solid():
    """The geometry table of a link 1 m long: `file` or, if none, the paper's section."""

    def make(**keys):
        if "file" in keys:
            return SolidGeometry.model_validate({"kind": "solid", "length": 1.0} | keys, strict=False)
        return SolidGeometry(**({"kind": "solid", "length": 1.0, "section": rectangle()} | keys))

    return make


@pytest.fixture
def mesh_part():
    """The part that the tables of a link file describe."""

    def make(geometry, interfaces=(), patches=None, said=None, **mesh):
        tell = said.append if said is not None else lambda _: None
        return part_mesh(PartTables(LINK, geometry, SolidMeshRecord(**mesh), interfaces, patches), tell)

    return make


@pytest.fixture
def read(solid, mesh_part, tmp_path, request):
    """The part that a deck describes, text or bytes; by default in the file `NAME` of the module."""

    def make(deck, interfaces=(), name=None, **keys):
        path = tmp_path / (name or request.module.NAME)
        path.write_bytes(deck if isinstance(deck, bytes) else deck.encode())
        return mesh_part(solid(file=path, **keys), interfaces)

    return make


@pytest.fixture
def step_file(tmp_path):
    """A STEP file of what `build` makes of OpenCASCADE's kernel."""

    def write(build, name="part.step"):
        path = tmp_path / name
        with gmsh_session():
            build(gmsh.model.occ)
            gmsh.model.occ.synchronize()
            gmsh.write(str(path))
        return path

    return write
