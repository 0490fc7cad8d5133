"""Meshes in gmsh's format: never run as a script; groups of elements, not of entities; every element once."""

import numpy as np
import pytest
from decks import VOLUME, bar, tetrahedra
from solid_parts import face_area, integrate

from ffrobot.common.errors import InputError
from ffrobot.mesh.records import PlaceRecord

NAME = "part.msh"
POINTS, CELLS = bar()
LEFT = [(1, 2, 4, 3), (3, 4, 6, 5)]


def version_2(cells, groups, kind=5, binary=False):
    """A mesh of one elementary entity, with a physical group for each element, and two quadrilaterals at x = 0."""
    text = (
        b"$MeshFormat\n2.2 %d 8\n" % binary + (np.int32(1).tobytes() + b"\n" if binary else b"") + b"$EndMeshFormat\n"
    )
    text += b'$PhysicalNames\n3\n3 8 "all"\n3 9 "insert"\n2 4 "left"\n$EndPhysicalNames\n'
    text += b"$Nodes\n%d\n" % len(POINTS)
    rows = [(3, 4, np.array(row) - 1) for row in LEFT] + list(zip([kind] * len(cells), groups, cells, strict=True))
    if binary:
        nodes = np.zeros(len(POINTS), dtype=[("tag", "<i4"), ("x", "<f8", 3)])
        nodes["tag"], nodes["x"] = 10 * np.arange(1, len(POINTS) + 1), POINTS
        text += nodes.tobytes() + b"\n$EndNodes\n$Elements\n%d\n" % len(rows)
        for k, (of, group, cell) in enumerate(rows):
            text += np.array([of, 1, 2, k + 1, group, 1, *(10 * (cell + 1))], dtype="<i4").tobytes()
    else:
        text += "".join(f"{10 * (k + 1)} {x!r} {y!r} {z!r}\n" for k, (x, y, z) in enumerate(POINTS.tolist())).encode()
        text += b"$EndNodes\n$Elements\n%d\n" % len(rows)
        for k, (of, group, cell) in enumerate(rows):
            text += f"{k + 1} {of} 2 {group} 1 {' '.join(str(10 * (node + 1)) for node in cell)}\n".encode()
    return text + b"\n$EndElements\n"


@pytest.mark.parametrize("binary", [False, True])
def test_elements_of_one_entity_in_two_groups(read, binary):
    """gmsh would put all of the entity's elements into both groups."""
    part = read(version_2(CELLS, [8, 8, 9, 9, 8, 0], binary=binary), (PlaceRecord(name="root", group="left"),))
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-12)
    assert list(part.regions) == ["all", "insert"]
    assert part.overlaps == {}
    middles, ours = POINTS[CELLS].mean(axis=1), part.points[part.cells].mean(axis=1)
    tags = part.cell_tag[np.linalg.norm(middles[:, None] - ours, axis=2).argmin(axis=1)]
    assert tags.tolist() == [part.regions["all"]] * 2 + [part.regions["insert"]] * 2 + [part.regions["all"], 0]
    assert face_area(part, "root") == pytest.approx(VOLUME)


@pytest.mark.parametrize(("cells", "binary"), [(CELLS, True), (tetrahedra(CELLS), False)])
def test_elements_that_stand_in_the_file_twice_count_once(read, cells, binary):
    half = len(cells) // 2
    kind = 5 if cells.shape[1] == 8 else 4
    groups = [8] * len(cells) + [9] * half
    part = read(version_2(np.concatenate([cells, cells[:half]]), groups, kind, binary))
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-12)
    assert len(part.cells) == len(cells)
    assert [len({part.regions[name], *part.overlaps.get(name, ())}) for name in ("all", "insert")] == [2, 1]
    assert np.sum(part.cell_tag == part.regions["insert"]) == half
    assert f"{half} of {len(cells) + half} cells are duplicates in the file" in part.remarks[-1]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ((b"$Elements\n8", b"$Elements\n9"), "the 9 elements that .Elements announces, found 8"),
        ((b"\n20 0.0", b"\n10 0.0"), "found a damaged one: Wrong node index 20"),
        ((b"$Nodes\n24\n", b"$Nodes\n25\n10 9. 9. 9.\n"), "nodes with unique numbers, found .* 10"),
        ((b" 240 180\n", b" 250 180\n"), "found a damaged one: Wrong node index 250"),
        ((b"\n2.2 0", b"\n2.2 1"), "found big-endian ones"),
        ((b"-0.05", b"x"), "damaged one"),
    ],
)
def test_damaged_files_are_rejected(read, change, says):
    content = version_2(CELLS, [8] * 6)
    assert change[0] in content
    with pytest.raises(InputError, match=rf"part\.msh: expected .*{says}"):
        read(content.replace(*change, 1))


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("partitions", [(1, 1), (1, 2)])
def test_partitions_of_version_2(read, partitions, binary):
    """Tags: physical group, entity, number of partitions, partition. One alone may be a part of the mesh."""
    content = version_2(CELLS, [8] * 6, binary=binary)
    for number, (cell, partition) in enumerate(zip(CELLS[:2], partitions, strict=True), start=3):
        nodes = [10 * (node + 1) for node in cell]
        old, new = [8, 1, *nodes], [8, 1, 1, partition, *nodes]
        if binary:
            before, after = (np.array([5, 1, t, number, *of], "<i4").tobytes() for t, of in ((2, old), (4, new)))
        else:
            before, after = (f" 5 {t} {' '.join(map(str, of))}\n".encode() for t, of in ((2, old), (4, new)))
        assert before in content
        content = content.replace(before, after)
    part = read(content)
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-9)
    alone = "all cells are of partition 1: others may be in separate files"
    assert part.remarks == (() if partitions == (1, 2) else (alone,))


@pytest.mark.parametrize("binary", [False, True])
def test_nodes_of_no_element(read, binary):
    more = np.int32(7).tobytes() + np.zeros(3).tobytes() if binary else b"7 0. 0. 0.\n"
    announced = b"$Nodes\n%d\n"
    content = version_2(CELLS, [8] * 6, binary=binary)
    part = read(content.replace(announced % len(POINTS), announced % (len(POINTS) + 1) + more))
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-12)


@pytest.mark.parametrize("binary", [False, True])
def test_nodes_with_parameters(read, binary):
    """Each has the dimension of its entity, the tag of that, and as many parameters, of curves and surfaces only."""
    content = version_2(CELLS, [8] * 6, binary=binary)
    head, _, rest = content.partition(b"$Nodes\n%d\n" % len(POINTS))
    data, _, rest = rest.partition(b"$EndNodes")
    if binary:
        rows = [data[28 * k : 28 * k + 28] for k in range(len(POINTS))]
        more = [
            np.array([k % 4, 7], dtype="<i4").tobytes() + np.full(k % 4 % 3, 0.5).tobytes() for k in range(len(rows))
        ]
        nodes = b"".join(map(bytes.__add__, rows, more)) + b"\n"
    else:
        lines = data.splitlines()
        nodes = b"".join(b"%s %d 7%s\n" % (line, k % 4, b" 0.5" * (k % 4 % 3)) for k, line in enumerate(lines))
    part = read(b"%s$ParametricNodes\n%d\n%s$EndParametricNodes%s" % (head, len(POINTS), nodes, rest))
    assert integrate(part) == pytest.approx(VOLUME, rel=1e-9)


def test_scripts_do_not_run(read, tmp_path):
    """gmsh runs what it does not know, comments before it or not, and NAME.opt beside a mesh."""
    ran = tmp_path / "ran"
    script = f'SystemCall "touch {ran}";\nPrintf("x") > "{ran}";\nMerge "{tmp_path}/other.geo";\n'
    sound = version_2(CELLS, [8] * 6)
    for text in (script, f"// mesh\n{script}", f"$Comments\n$EndComments\n{script}"):
        with pytest.raises(InputError, match=r"expected a mesh in gmsh's format, .* \$MeshFormat, found"):
            read(text)
    (tmp_path / "part.msh.opt").write_text(script)
    assert integrate(read(sound)) == pytest.approx(VOLUME)
    fourth = b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n" + script.encode()
    for text in (fourth, fourth.replace(b"4.1", b"2.2")):
        with pytest.raises(InputError, match="expected a mesh"):
            read(text)
    assert not ran.exists()


def test_what_stands_before_the_header(read):
    content = version_2(CELLS, [8] * 6)
    for before in (b"\xef\xbb\xbf", b"\n \n", b"$Comments\nby hand\n$EndComments\n"):
        assert integrate(read(before + content)) == pytest.approx(VOLUME)
