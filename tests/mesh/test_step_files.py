"""Parts from STEP files become the part that they describe, or a clear error."""

import re

import gmsh
import numpy as np
import pytest
from solid_parts import VOLUME, bar, integrate, two_bars

from ffrobot.common.errors import InputError
from ffrobot.mesh.gmsh_session import gmsh_session


def test_step_in_millimetres(solid, mesh_part, step_file):
    part = mesh_part(solid(file=step_file(bar), unit="mm"))
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-9)
    np.testing.assert_allclose(part.points.min(axis=0), [0, -0.0075, -0.0125], atol=1e-9)


@pytest.mark.parametrize(
    ("declared", "length", "unit"),
    [("SI_UNIT($,.METRE.)", 1.0, "m"), ("SI_UNIT(.CENTI.,.METRE.)", 1000.0, "mm"), ("inch", 1000 / 25.4, "in")],
)
def test_the_unit_is_that_of_the_numbers_in_the_file(solid, mesh_part, step_file, declared, length, unit):
    """OpenCASCADE would convert what the file declares to millimetres."""
    scale = length / 1000
    path = step_file(lambda occ: occ.addBox(0, -7.5 * scale, -12.5 * scale, length, 15 * scale, 25 * scale))
    text = path.read_text()
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    if declared == "inch":
        number = 900_000
        unit_text = (
            f"#{number} = ( CONVERSION_BASED_UNIT('INCH',#{number + 1}) LENGTH_UNIT() NAMED_UNIT(#{number + 2}) );\n"
        )
        unit_text += f"#{number + 1} = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#{number + 3});\n"
        unit_text += f"#{number + 2} = DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);\n"
        unit_text += f"#{number + 3} = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );\n"
        start = text.index("( LENGTH_UNIT() NAMED_UNIT(*)")
        old = text[text.rindex("#", 0, start) : start].split()[0]
        text = text.replace(f"({old},", f"(#{number},").replace("ENDSEC;\nEND-ISO", unit_text + "ENDSEC;\nEND-ISO")
    else:
        text = text.replace("SI_UNIT(.MILLI.,.METRE.)", declared)
    path.write_text(text)
    assert integrate(mesh_part(solid(file=path, unit=unit))) == pytest.approx(VOLUME, rel=1e-6)


def test_a_part_is_put_into_the_frame_of_the_link(solid, mesh_part, step_file):
    """Drawn upright along −z, its top at (10, 20, 30); the link's y is the drawing's −x."""
    path = step_file(lambda occ: occ.addBox(10 - 7.5, 20 - 12.5, 30 - 1000, 15, 25, 1000))
    placed = solid(file=path, unit="mm", origin=(10.0, 20.0, 30.0), x_axis=(0.0, 0.0, -2.0), y_axis=(-1.0, 0.0, 0.3))
    part = mesh_part(placed)
    np.testing.assert_allclose(part.points.min(axis=0), [0, -0.0075, -0.0125], atol=1e-9)
    np.testing.assert_allclose(part.points.max(axis=0), [1, 0.0075, 0.0125], atol=1e-9)


def test_volumes_that_touch_become_one_part(solid, mesh_part, step_file):
    assert integrate(mesh_part(solid(file=step_file(two_bars), unit="mm"))) == pytest.approx(VOLUME, rel=1e-9)


def test_labels_of_a_step_file_name_regions(solid, mesh_part, tmp_path):
    path = tmp_path / "named.step"
    with gmsh_session():
        two_bars(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        gmsh.write(str(path))
    text = path.read_text()
    names = sorted({line.split("'")[1] for line in text.splitlines() if "= PRODUCT(" in line})
    for old, new in zip(names[-2:], ("arm", "hub"), strict=True):
        text = text.replace(f"'{old}'", f"'{new}'")
    path.write_text(text)
    part = mesh_part(solid(file=path, unit="mm"))
    assert set(part.regions) == {"arm", "hub"}
    assert set(np.unique(part.cell_tag)) == set(part.regions.values())


def test_an_open_step_surface_is_refused(solid, mesh_part, step_file):
    def opened(occ):
        bar(occ)
        occ.remove([(3, 1)])
        occ.remove([(2, 1)])

    with pytest.raises(InputError, match=r"geometry.file: part.step: expected a closed volume, found 5 faces that"):
        mesh_part(solid(file=step_file(opened), unit="mm"))


DAMAGE = {
    "a corner elsewhere": (r"(VERTEX_POINT\('',#(\d+)\);\s+#\2 = CARTESIAN_POINT\('',\()[^,]*,", r"\g<1>1500.,",
                           r"edges that lie on their faces and end at their vertices, found one \S+ mm off, near"),
    "an edge less": (r"#\d+ = EDGE_CURVE[^;]*;", "", r"found one damaged: unresolved reference \(\d+\)"),
    "no number": (r"(CARTESIAN_POINT\('',\()0\.,", r"\1,", r"found one damaged: incorrect syntax \(1\)"),
    "a solid less": ("= MANIFOLD_SOLID_BREP", "= MANIFOLD_SOLID_BREP('',$);\n#9999 = MANIFOLD_SOLID_BREP",
                     "expected the 3 solids of the file, found 1 that can be read"),
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGE)
def test_damaged_step_files_are_refused(solid, mesh_part, step_file, damage):
    """OpenCASCADE makes closed volumes of all of these, with up to a third of the volume less."""
    old, new, says = DAMAGE[damage]
    path = step_file(two_bars)
    text, count = re.subn(old, new, path.read_text(), count=1)
    assert count == 1
    path.write_text(text)
    with pytest.raises(InputError, match=says):
        mesh_part(solid(file=path, unit="mm"))


def test_faces_of_a_step_file_in_no_shape_are_told(solid, mesh_part, step_file):
    path = step_file(bar)
    face = re.search(r"= ADVANCED_FACE[^;]*;", path.read_text())
    path.write_text(path.read_text().replace("ENDSEC;\nEND-ISO", f"#9999 {face[0]}\nENDSEC;\nEND-ISO"))
    part = mesh_part(solid(file=path, unit="mm"))
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-9)
    assert part.remarks == ("1 of the 7 faces in the file are in no shape that OpenCASCADE makes of it",)


def test_a_size_for_another_unit_is_refused_at_once(solid, mesh_part, step_file):
    geometry = solid(file=step_file(lambda cad: cad.addBox(0, -20, -5, 300, 40, 10)), length=0.3)
    with pytest.raises(InputError, match=r"mesh\.size that fits the part, found 0\.012 m .* another unit"):
        mesh_part(geometry, size=0.012)
