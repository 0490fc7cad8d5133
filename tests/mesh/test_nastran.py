"""Nastran decks: cards in all forms and coordinate systems describe the same bar, or are rejected by name and line."""

import numpy as np
import pytest
from decks import EDGES, VOLUME, bar, fixed, free, tetrahedra, with_middles
from solid_parts import face_area, integrate

from ffrobot.common.errors import InputError
from ffrobot.mesh.included import files_of
from ffrobot.mesh.records import PlaceRecord

NAME = "part.bdf"
POINTS, CELLS = bar()
PLAIN = free(POINTS, CELLS)
HEAD = "SOL 103\nCEND\nTITLE = GRID of a bar\nBEGIN BULK\n"


def marked(text):
    """Every line that goes on with the next one by a mark of its own, and all cards sorted."""
    lines, cards = text.splitlines(), []
    for number, line in enumerate(lines):
        goes_on = number + 1 < len(lines) and lines[number + 1].startswith("        ")
        if line.startswith("        "):
            line = f"+{number:<7}" + line[8:]
        cards.append(f"{line:72}+{number + 1:<7}" if goes_on else line)
    return "\n".join(sorted(cards)) + "\n"


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        HEAD + PLAIN + "ENDDATA\nGRID,1,,9.,9.,9.\n",
        HEAD.lower() + PLAIN.lower(),
        free(POINTS, CELLS).replace("\n,", ",+\n+,"),
        fixed(POINTS, CELLS),
        fixed(POINTS, CELLS, mark="+"),
        "$ head\n" + fixed(POINTS, CELLS, mark="+A").replace("\n", " $ tail\n", 3),
        fixed(POINTS, CELLS, wide=True),
        marked(fixed(POINTS, tetrahedra(CELLS), "CTETRA") + fixed(POINTS[:0], CELLS[:0])),
        PLAIN.replace("0.333333333", "3.33333333-1").replace("0.1", "1.D-1"),
        PLAIN.replace("GRID,1,,0,-0.1,-0.05", "GRID\t1\t\t0.0\t-0.1\t-0.05"),
        PLAIN.replace("\n", "\r\n"),
        PLAIN + "GRDSET,,7\nCORD2R,7,0,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\n",
        PLAIN + "PLOTEL,9,1,2\nPSOLID,1,1\nMAT1,1,7.+10,,.3,2700.\nSPC1,1,123456,1\n",
    ],
)
def test_cards_in_all_forms(read, text):
    part = read(text)
    assert integrate(part) == pytest.approx(VOLUME, rel=2e-6)  # fixed field of 8 columns has 6 digits
    assert part.remarks == ()
    assert list(part.regions) == ["1"]


def spherical(points):
    """r, θ from z, φ from x; degrees."""
    r = np.linalg.norm(points, axis=1)
    across = np.hypot(points[:, 0], points[:, 1])
    around = np.degrees(np.arctan2(points[:, 1], points[:, 0]))
    return np.stack([r, np.degrees(np.arctan2(across, points[:, 2])), around], axis=1)


def cylindrical(points):
    r, theta = np.hypot(points[:, 0], points[:, 1]), np.degrees(np.arctan2(points[:, 1], points[:, 0]))
    return np.stack([r, theta, points[:, 2]], axis=1)


# The system 7: origin at (1, 2, 3), its z along x, its x along y.
CORD2 = "CORD2{},7,{},1.,2.,3.,2.,2.,3.\n,1.,3.,3.\n"
INTO_7 = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]])


@pytest.mark.parametrize(("kind", "as_given"), [("R", lambda x: x), ("C", cylindrical), ("S", spherical)])
def test_coordinate_systems(read, kind, as_given):
    local = as_given((POINTS - [1, 2, 3]) @ INTO_7.T)
    part = read(free(local, CELLS, cp="7") + CORD2.format(kind, 0))
    np.testing.assert_allclose(part.points, POINTS, atol=1e-7)


def test_nested_coordinate_systems(read):
    """9 by grid points given in the cylindrical 8, which stands in 7; the bar's own axes come out again."""
    inner = "CORD2C,8,7,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\nCORD1R,9,501,502,503\n"
    grids = "GRID,501,8,0.,0.,0.\nGRID,502,8,0.,0.,1.\nGRID,503,8,1.,0.,0.\n"
    local = (POINTS - [1, 2, 3]) @ INTO_7.T
    part = read(free(local, CELLS, cp="9") + inner + grids + CORD2.format("R", 0))
    np.testing.assert_allclose(part.points, POINTS, atol=1e-7)


LOWER, UPPER = [(0, 1), (1, 2), (2, 3), (3, 0)], [(4, 5), (5, 6), (6, 7), (7, 4)]


@pytest.mark.parametrize(
    ("card", "cells", "edges"),
    [
        ("CTETRA", tetrahedra(CELLS), EDGES),
        ("CHEXA", CELLS, [*LOWER, (0, 4), (1, 5), (2, 6), (3, 7), *UPPER]),
    ],
)
def test_nodes_on_edges(read, card, cells, edges):
    part = read(free(*with_middles(POINTS, cells, edges), card))
    assert part.degree == 1  # in the middle: straight
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-6)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (PLAIN.replace("GRID,2,,", "GRID,2,5,"), "GRID, line 2: expected a coordinate system .*, found 5"),
        (PLAIN.replace("GRID,2,,", "GRID,2,7,") + CORD2.format("R", 7), "do not refer to themselves, found 7"),
        (PLAIN + "GRID,2,,9.,9.,9.\n", r"with unique numbers, found 2 again \(line 2\)"),
        (PLAIN.replace("GRID,2,,0", "GRID,2,,0,0,0,,,,0", 1), "line 2: expected 8 fields in a line at most, found 11"),
        (PLAIN + "GRID,99,,0,0,0,0,0,0\n,1,1,1\n", "expected 8 fields of a grid point at most, found 11"),
        (HEAD + PLAIN + "BEGIN SUPER=1\n", "expected one BEGIN BULK, found another"),
        (PLAIN.replace("GRID,2,,", "GRID,2000,,"), r"CHEXA, line \d+: expected existing grid points, found 2"),
        (PLAIN + "CTETRA,99,1,1,2,3,4,5\n", "expected midside grid points on all edges or none, found 1"),
        (PLAIN.replace("-0.1", "-0.x", 1), 'GRID, line 1: expected a finite number, found "-0.x"'),
        (fixed(POINTS, CELLS, wide=True).replace("*       -0.05           \n", "", 1), "line 1: .* continues this one"),
        (PLAIN + "=,*(1),=,*(.1)\n", r"line \d+: expected cards one by one, found replicated ones"),
        ("SOL 103\nCEND\n" + PLAIN, "expected BEGIN BULK after CEND, found none"),
        (fixed(POINTS, CELLS, mark="+A").replace("\n+A ", "\n+B ", 1), "one card .* that line 26 continues"),
        (PLAIN.replace("CHEXA,4,", "CIHEX1,4,"), r"CIHEX1, line \d+: expected solids of CTETRA, CHEXA"),
        (PLAIN + "CPENTA,99,1,1,2,3,4,5,6\n", "found unsupported elements: 6 hexahedron, 1 wedge"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_rejected_by_name(read, text, says):
    with pytest.raises(InputError, match=rf"part\.bdf: (.|\n)*{says}"):
        read(text)


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ("CONM2,99,2,,5.\n", "CONM2 99, line 37: mass 5 at (0, -0.1, 0.05) is left out"),
        ("CONM2,99,1,,2.,.1,.2,.3\n", "mass 2 at (0.1, 0.1, 0.25) is left out"),
        ("CONM2,99,1,7,2.,.1,.2,.3\nCORD2R,7,0,1.,0.,0.,1.,1.,0.\n,2.,0.,0.\n", "mass 2 at (0.1, 0.2, -0.25)"),
        ("CONM2,99,1,7,2.,.1\nCORD2C,7,0,,,,,,1.\n,1.\n", "CONM2 99 and its offset in cylindrical axes, line 37"),
        ("CONM2,99,1,-1,2.,.1,.2,.3\n", "mass 2 at (0.1, 0.2, 0.3) is left out"),
        ("CONM2,99,1,,2.,,,,,\n,1.,,1.\n", "CONM2 99 and its inertia, line 37: mass 2 at (0, -0.1, -0.05)"),
        ("".join(f"CONM1,{k},1,,2.\n" for k in range(91, 99)), "3 more concentrated masses, 6 in all, are left out"),
        ("PARAM,WTMASS,.00259\n", "not read: PARAM WTMASS"),
        ("CBAR,99,3,1,2,0.,0.,1.\n", "1 CBAR"),
        ("CQUAD4,99,4,1,2,8,7\n", "1 CQUAD4"),
        ("RBE2,99,1,123456,2,3\n", "1 RBE2"),
        ("CHEAX,99,1,1,2,3,4,5,6\n", "not read: CHEAX"),
        ("CHEXA,99,1,1,7,9,3,2,8\n,10,4\n", "1 of 7 cells are duplicates in the file"),
    ],
)
def test_what_is_left_out_is_told(read, more, says):
    part = read(PLAIN + more)
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-6)
    assert any(says in remark for remark in part.remarks)


def test_properties_name_regions_and_faces(read):
    text = PLAIN.replace("CHEXA,1,1,", "CHEXA,1,8,") + "CQUAD4,99,4,1,2,4,3\nCQUAD4,98,4,3,4,6,5\n"
    part = read(text, (PlaceRecord(name="root", group="4"),))
    assert list(part.regions) == ["1", "8"]
    assert face_area(part, "root") == pytest.approx(VOLUME)


@pytest.mark.parametrize("name", ["part.nas", "part.fem", "part.dat", "PART.BDF"])
def test_endings(read, name):
    assert integrate(read(HEAD + PLAIN, name=name)) == pytest.approx(VOLUME, rel=1e-6)


def test_included_files_count(read, tmp_path):
    (tmp_path / "grids.bdf").write_text(PLAIN[: PLAIN.index("CHEXA")])
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "more.bdf").write_text("$\n")
    windows = "include sub\\more.bdf $ without quotes\n"
    part = read(HEAD + "include 'gri\nds.bdf'\n" + windows + PLAIN[PLAIN.index("CHEXA") :], name="part.nas")
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-6)
    assert [path.name for path in files_of(tmp_path / "part.nas")] == ["part.nas", "grids.bdf", "more.bdf"]
