"""Abaqus and CalculiX decks: what they say is read, or rejected by keyword and line; nothing is dropped silently."""

import numpy as np
import pytest
from decks import HEIGHT, VOLUME, bar, elements, nodes, tetrahedra
from solid_parts import face_area, integrate

from ffrobot.common.errors import InputError
from ffrobot.mesh.abaqus import read_abaqus
from ffrobot.mesh.included import files_of
from ffrobot.mesh.records import PlaceRecord

NAME = "part.inp"
POINTS, CELLS = bar()
PLAIN = nodes(POINTS) + elements(CELLS)
TETRAHEDRA = nodes(POINTS) + elements(tetrahedra(CELLS), "C3D4")
HALF, HALF_CELLS = bar(ny=1, y=(-HEIGHT / 2, 0.0))
PART = "*Part, name=HALF\n" + nodes(HALF) + elements(HALF_CELLS) + "{}*End Part\n*Assembly, name=A\n"
SECOND = "*Instance, name=H-2, part=HALF\n0., 0.1, 0.\n*End Instance\n"
TWO = PART + "*Instance, name=H-1, part=HALF\n*End Instance\n" + SECOND
# Sides of the hexahedra: S5 looks along +y, S3 along −y, by the order of corners in decks.py.
SURFACES = "*Surface, name=UP, type=ELEMENT\nH-1.E, S5\n*Surface, name=DOWN\nH-2.E, S3\n"


def moved_first(text):
    """The nodes in two blocks."""
    lines = text.splitlines(keepends=True)
    return "".join([*lines[:9], "*NODE\n", *lines[9:]])


@pytest.mark.parametrize(
    "text",
    [
        PLAIN.lower(),
        "\n".join(line + "," if line[0].isdigit() else line for line in PLAIN.splitlines()),
        b"\xef\xbb\xbf" + PLAIN.encode(),
        PLAIN.replace("\n", "\r\n"),
        PLAIN.replace("\n", "\r"),
        PLAIN.encode("utf-16"),
        PLAIN.replace("C3D8", "DC3D8"),  # of heat
        PLAIN.replace("*ELEMENT, TYPE=C3D8, ELSET=E", "** comment\n\n * element , type = c3d8 ,\n  elset = E"),
        PLAIN.replace("*NODE", "*HEADING\na bar\n*NODE, NSET=ALL"),
        moved_first(PLAIN),
        "\n".join(  # elements over several lines, as C3D20 are
            line.replace(", ", ",\n", 5) if line.count(",") == 8 else line for line in PLAIN.splitlines()
        ),
        PLAIN.replace("0.333333333333", "3.33333333333D-01"),
        PLAIN.replace("-0.05", "-0.05, 0., 0., 1."),  # direction cosines of a normal
        "*Part, name=BAR\n" + PLAIN + "*End Part\n*Assembly, name=A\n*Instance, name=B-1, part=bar\n*End Instance\n"
        "*Node\n1, 5., 0., 0.\n*Nset, nset=RP\n1,\n*End Assembly\n*Step\n*Static\n*Node file\nU\n*End step\n",
        "*Part, name=BAR\n*End Part\n*Assembly, name=A\n*Instance, name=B-1, part=BAR\n" + PLAIN + "*End Instance\n",
    ],
)  # fmt: skip
def test_dialects(read, text):
    part = read(text)
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-9)
    assert part.remarks == ()
    assert set(part.regions) <= {"E", "e"}


@pytest.mark.parametrize(
    "tie",
    [SURFACES + "*Tie, name=glue, adjust=yes\nDOWN, UP\n",
     "*Nset, nset=U, instance=H-1, generate\n1, 16\n*Surface, name=UP, type=NODE\nU,\n"
     "*Surface, name=DOWN\nH-2.E, S3\n*Tie, name=glue\nDOWN, UP\n"],
)  # fmt: skip
def test_tied_instances_share_their_nodes(read, tie):
    part = read((TWO + tie).format(""))
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-9)
    assert len(part.points) == len(POINTS)
    assert len(part.regions) == 1
    assert part.remarks == ()


def test_undefined_surfaces_of_a_tie_are_told(read):
    part = read(TWO.format("") + "*Tie, name=glue\nS2, S1\n")
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-9)
    assert "*TIE" in part.remarks[0]
    assert "all nodes of instances that coincide" in part.remarks[0]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (TWO.format(""), "one connected part, found 2"),  # they touch, and nothing ties them
        (TWO.format("") + SURFACES.replace("S5", "S3") + "*Tie, name=g\nDOWN, UP\n", "nodes of DOWN where"),
        (TWO.format("").replace("0.1, 0.", "0.1, 0.01") + SURFACES + "*Tie, name=g\nDOWN, UP\n", "cannot be tied"),
        (TWO.format("").replace("H-2", "H-1"), "instances with unique names, found H-1"),
        (PART[: PART.index("{}")], "expected \\*END PART or \\*END INSTANCE, found the end"),
        (PLAIN.replace("*NODE", "*NODE, SYSTEM=S"), r"\*NODE, line 1: expected SYSTEM=R or C, found S"),
        (PLAIN + "*NGEN\n1, 5, 1\n", r"\*NGEN, line \d+: expected nodes and elements one by one"),
        (PLAIN + elements(CELLS[:1, ::-1]), "elements with unique numbers, found 1 again"),
        (PLAIN + "*ELEMENT, TYPE=C3D8\n50, 1, 2, 3, 4, 5, 6, 7, 8, 9\n", "expected 8 nodes of an element, found 9"),
        (TWO.format("").replace("0., 0.1, 0.", "0., 0.1, 0., 0., 0., 0., 90."), r"\*INSTANCE, line \d+: "),
        (PLAIN + "*INCLUDE, INPUT=nowhere.txt\n", "expected a file to include, found none called nowhere.txt"),
        (PLAIN + "*INCLUDE, INPUT=part.inp\n", "files that do not include themselves"),
        (PLAIN + "*NODE\n3, 9., 9., 9.\n", "expected one place of each node, found another one of node 3"),
        (PLAIN + elements(CELLS[:1] + 100, first=50), "element 50: expected existing nodes, found node 101"),
        (PLAIN + "*ELEMENT, TYPE=C3D8\n50, 1, 2, 3, 4\n", "line .*: expected 8 nodes of an element, found 4"),
        (PLAIN.replace("TYPE=C3D8", "TYPE=SC8R"), r"\*ELEMENT, line \d+: expected solids .*, found TYPE=SC8R"),
        (PLAIN + "*ELSET, ELSET=F\nF\n", 'expected elements or a set of them, found "F"'),
        (PLAIN + "*ELSET, ELSET=F\n77\n", "F: expected existing elements, found element 77"),
        (PLAIN + "*NSET, NSET=N, GENERATE\n1, 9, 0\n", "expected first, last and step of nodes"),
        (PLAIN.replace("0.333333333333", "1e200"), "expected nodes with finite coordinates"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_rejected_by_name(read, text, says):
    with pytest.raises(InputError, match=rf"part\.inp: (.|\n)*{says}"):
        read(text)


@pytest.mark.parametrize(
    ("lines", "axes"),
    [
        ("1., 2., 3.\n", ((1, 0, 0), (0, 1, 0))),
        ("1., 2., 3.\n1., 2., 3., 1., 2., 4., 90.\n", ((0, 1, 0), (-1, 0, 0))),  # about z, through where it is
        ("0., 0., 0.\n0., 0., 0., 1., 0., 0., 90.\n", ((1, 0, 0), (0, 0, 1))),
    ],
)
def test_instances_are_moved_then_turned(read, lines, axes):
    """Abaqus: the translation first, then the rotation about an axis in the assembly."""
    text = f"*Part, name=P\n{PLAIN}*End Part\n*Assembly, name=A\n*Instance, name=I, part=P\n{lines}*End Instance\n"
    origin = tuple(float(value) for value in lines.splitlines()[0].split(","))
    part = read(text, origin=origin, x_axis=axes[0], y_axis=axes[1])
    np.testing.assert_allclose(part.points, POINTS, atol=1e-12)


def test_local_axes(read):
    """*SYSTEM with a turn of 90° about z and a shift; then without data: global again; cylindrical ones within."""
    system = "*SYSTEM\n0.5, 0.25, 0.125, 0.5, -1., 0.125\n2., 0.25, 0.125\n"
    r, theta = np.hypot(POINTS[:, 0], POINTS[:, 1]), np.degrees(np.arctan2(POINTS[:, 1], POINTS[:, 0]))
    text = system + nodes(np.stack([r, theta, POINTS[:, 2]], axis=1)[:11], "*NODE, SYSTEM=C")
    text += nodes(POINTS[11:], "*NODE", 12) + "*SYSTEM\n" + "*NODE\n99, 7., 7., 7.\n" + elements(CELLS)
    part = read(text, origin=(0.5, 0.25, 0.125), x_axis=(0.0, -1.0, 0.0), y_axis=(1.0, 0.0, 0.0))
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-9)
    np.testing.assert_allclose(part.points, POINTS, atol=1e-9)


def test_sets_of_sets_and_surfaces(read):
    text = PLAIN + (
        "*ELSET, ELSET=ROOT, GENERATE\n1, 2\n*ELSET, ELSET=BOTH\nroot,\n3, 4\n*NSET, NSET=LEFT\n1, 2, 3, 4, 5, 6\n"
        "*NSET, NSET=ENDS\nLEFT, 19, 20, 21, 22, 23, 24\n*SURFACE, NAME=SIDE, TYPE=ELEMENT\nROOT, S6\n"
    )
    part = read(text, (PlaceRecord(name="left", group="LEFT"),))
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-9)
    assert list(part.regions) == ["E", "BOTH", "ROOT"]
    owners = {name: {part.regions[name], *part.overlaps.get(name, ())} for name in part.regions}
    counts = {name: int(np.isin(part.cell_tag, list(tags)).sum()) for name, tags in owners.items()}
    assert counts == {"E": 6, "BOTH": 4, "ROOT": 2}
    assert face_area(part, "left") == pytest.approx(VOLUME)
    ends = read(text, (PlaceRecord(name="root", group="ENDS"), PlaceRecord(name="tip", group="ENDS")))
    assert face_area(ends, "root") == pytest.approx(2 * VOLUME)


@pytest.mark.parametrize("option", ["GENERATE", "GEN", "GENER"])
def test_shortened_options(read, option):
    text = PLAIN.replace("ELSET=E", "ELS=E") + f"*SURFACE, NAME=S, TYPE=NODE\nLEFT,\n*NSET, NSET=LEFT, {option}\n1, 6\n"
    for name in ("LEFT", "S"):
        part = read(text, (PlaceRecord(name="root", group=name),))
        assert face_area(part, "root") == pytest.approx(VOLUME)
    assert list(part.regions) == ["E"]


def test_sets_of_the_assembly_name_those_of_an_instance(read):
    part = PART.format("*Nset, nset=L, generate\n1, 4\n") + "*Instance, name=H-1, part=HALF\n*End Instance\n"
    part = read(part + SECOND + SURFACES + "*Tie, name=g\nDOWN, UP\n*Nset, nset=ROOT, instance=H-2\n L,\n",
                (PlaceRecord(name="root", group="ROOT"),))  # fmt: skip
    assert face_area(part, "root") == pytest.approx(VOLUME / 2)


def test_sets_of_whole_instances(read, tmp_path):
    """As HyperMesh writes them."""
    first = "*Instance, name=H-1, part=HALF, elset=LOW, nset=LOW_NODES\n*End Instance\n"
    text = PART.format("") + first + SECOND + SURFACES + "*Tie, name=g\nDOWN, UP\n"
    part = read(text)
    low = part.points[part.corners[np.isin(part.cell_tag, [part.regions["LOW"], *part.overlaps.get("LOW", ())])]]
    assert (len(low), low[..., 1].max()) == (3, pytest.approx(0.0, abs=1e-12))
    assert len(read_abaqus(tmp_path / "part.inp").point_groups["LOW_NODES"]) == len(HALF)


def test_masses_of_parts_whose_sets_have_one_name(read, tmp_path):
    mass = "*ELEMENT, TYPE=MASS, ELSET=M\n99, 1\n*MASS, ELSET=M\n{}.\n"
    other = PART.partition("*Assembly")[0].replace("HALF", "OTHER").format(mass.format(7))
    text = other + PART.format(mass.format(5)) + "*Instance, name=O, part=OTHER\n*End Instance\n" + SECOND
    read(text + SURFACES.replace("H-1", "O") + "*Tie, name=g\nDOWN, UP\n")
    assert [one.mass for one in read_abaqus(tmp_path / "part.inp").masses] == [7, 5]


def test_nodes_of_a_set_of_elements(read):
    """The two elements at the tip have the nodes of x = 2/3 and 1."""
    text = PLAIN + "*ELSET, ELSET=TIP\n5, 6\n*NSET, NSET=END, ELSET=TIP\n"
    assert face_area(read(text, (PlaceRecord(name="tip", group="END"),)), "tip") > VOLUME


def test_sides_of_a_surface(read):
    """S6 of a hexahedron has the corners 4, 8, 5, 1: here x = 0."""
    text = PLAIN + "*SURFACE, NAME=SIDE, TYPE=ELEMENT\n1, S6\n2, S6\n"
    assert face_area(read(text, (PlaceRecord(name="side", group="SIDE"),)), "side") == pytest.approx(VOLUME)
    text = TETRAHEDRA + "*SURFACE, NAME=SIDE\n" + "".join(f"{k}, S{s}\n" for k, s in ((3, 3), (4, 1)))
    with pytest.raises(InputError, match="expected a face on the boundary"):  # sides inside the bar
        read(text, (PlaceRecord(name="side", group="SIDE"),))


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ("*ELEMENT, TYPE=B31, ELSET=RIB\n9001, 1, 7\n9002, 7, 13\n", "2 B31"),
        ("*ELEMENT, TYPE=S4R, ELSET=SKIN\n9001, 1, 2, 8, 7\n*SHELL SECTION, ELSET=SKIN\n0.002\n", "1 S4R"),
        (
            "*ELEMENT, TYPE=MASS, ELSET=M\n9001, 2\n*MASS, ELSET=M\n5.\n",
            "element 9001: mass 5 at (0, -0.1, 0.05) is left",
        ),
        ("*SURFACE, NAME=SKIN\nE,\n", 'of surface SKIN 1 lines are not read: "E"'),
        (
            "*SURFACE, NAME=A\n1, S6\n*SURFACE, NAME=B, COMBINE=UNION\nA, A\n",
            'of surface B 1 lines are not read: "A, A"',
        ),
        ("*MPC\nBEAM, 1, 2\n", r"not read: \*MPC"),
        ("*ELEMNT, TYPE=C3D8\n9, 1, 2, 3, 4, 5, 6, 7, 8\n", r"not read: \*ELEMNT"),
        (elements(CELLS[2:4], elset="AGAIN", first=101), "2 of 8 cells are duplicates in the file"),
    ],
)
def test_what_is_left_out_is_told(read, more, says):
    part = read(PLAIN + more)
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-9)
    assert any(says.replace("\\", "") in remark for remark in part.remarks)


def test_included_files_count(read, tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "mesh.txt").write_text(nodes(POINTS) + "*INCLUDE, INPUT=cells.txt\n")
    (tmp_path / "sub" / "cells.txt").write_text(elements(CELLS))
    part = read('*include,\ninput = "sub/mesh.txt"\n*NSET, NSET=N\n1, 2\n')
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-9)
    (tmp_path / "part.inp").write_text("*INCLUDE, INPUT=sub/mesh.txt\n")
    assert [path.name for path in files_of(tmp_path / "part.inp")] == ["part.inp", "mesh.txt", "cells.txt"]
    assert integrate(read("*INCLUDE, INPUT=sub\\mesh.txt\n")) == pytest.approx(VOLUME, rel=1e-9)  # Windows'
    (tmp_path / "part.inp").write_text("*INCLUDE, INP=sub\\mesh.txt\n", encoding="utf-16")
    assert len(files_of(tmp_path / "part.inp")) == 3
    (tmp_path / "rows.txt").write_text(nodes(POINTS).partition("\n")[2])
    assert integrate(read("*NODE, INPUT=rows.txt\n" + elements(CELLS))) == pytest.approx(VOLUME, rel=1e-9)
