"""Meshes in gmsh's own format. Importing this loads gmsh.

gmsh takes what it does not know for a script, and runs it: so the header is checked, and gmsh sees a copy of the file
in an empty folder alone (beside `x.msh` it would run `x.msh.opt`). Version 2 is read here, since gmsh puts all elements
of one elementary entity into all physical groups that any of them has. See "MSH file format" in the manual of gmsh.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import gmsh
import numpy as np

from ..common.arrays import Array, Integers
from ..common.errors import InputError, blaming_file
from .cells import GMSH_CORNERS, GMSH_NODES, VOLUME_ELEMENTS
from .gmsh_session import extract_mesh, gmsh_session, own_entities
from .source import MeshBlocks, RawMesh

_HEADER = b"$MeshFormat"


def read_msh(path: Path) -> RawMesh:
    """A mesh in gmsh's format of version 2 or 4. Raises `InputError` for what is wrong in it."""
    content = path.read_bytes().removeprefix(b"\xef\xbb\xbf").lstrip()
    while content.startswith(b"$Comments"):
        content = content.partition(b"$EndComments")[2].lstrip()
    if not content.startswith(_HEADER):
        began = content[:20].decode("ascii", errors="replace").split("\n")[0]
        raise InputError(
            "expected a mesh in gmsh's format, which begins with $MeshFormat",
            f'"{began}" (gmsh\'s scripts are not run: save the mesh that they make)',
        )
    with blaming_file(
        lambda error: f"expected a mesh in gmsh's format, found a damaged one: {' '.join(str(error).split())}"
    ):
        version = float(content[len(_HEADER) :].split(maxsplit=1)[0])
        return _Version2(content).mesh() if version < 4 else _by_gmsh(content)


def _by_gmsh(content: bytes) -> RawMesh:
    with TemporaryDirectory() as folder, gmsh_session():
        alone = Path(folder) / "mesh.msh"
        alone.write_bytes(content)
        gmsh.merge(str(alone))
        elements = [tags for entity in own_entities() for tags in gmsh.model.mesh.getElements(*entity)[1]]
        for name, tags in ((b"Nodes", [gmsh.model.mesh.getNodes()[0]]), (b"Elements", elements)):
            announced, counted = _counts(content, name)[1], sum(map(len, tags))
            if announced != counted:
                what = name.decode()
                raise InputError(f"expected the {announced} {what.lower()} that ${what} announces", counted)
        _check_partitions(content)
        return extract_mesh()


def _check_partitions(content: bytes) -> None:
    """Check that a file of version 4 has all partitions of a mesh."""
    if b"$PartitionedEntities" not in content:
        return
    entities = [entity for entity in gmsh.model.getEntities(3) if gmsh.model.mesh.getElements(*entity)[0].size]
    partitions = {int(number) for entity in entities for number in gmsh.model.getPartitions(*entity)}
    announced = _counts(content, b"PartitionedEntities")[0]
    if len(partitions) < announced:
        raise InputError(f"expected all {announced} partitions of the mesh in one file", len(partitions))


def _counts(content: bytes, name: bytes) -> tuple[int, int]:
    """The first two numbers of a section of version 4."""
    is_binary = content.split(maxsplit=3)[2] != b"0"
    data = content.partition(b"$" + name)[2].partition(b"\n")[2]
    first, second = np.frombuffer(data, dtype="<u8", count=2) if is_binary else data.split(maxsplit=2)[:2]
    return int(first), int(second)


_NODE = np.dtype([("tag", "<i4"), ("x", "<f8", 3)])


def _plain_nodes(data: bytes, count: int) -> Iterator[bytes]:
    """Of binary nodes with dimension, tag and as many parameters (of curves and surfaces) each: tag and place alone."""
    at = 0
    for _ in range(count):
        yield data[at : at + _NODE.itemsize]
        (dim,) = np.frombuffer(data, dtype="<i4", count=1, offset=at + _NODE.itemsize)
        at += _NODE.itemsize + 8 + 8 * {1: 1, 2: 2}.get(int(dim), 0)


class _Version2:
    """A file of version 2: `$Nodes`, `$Elements` with the tag of their physical group first, `$PhysicalNames`."""

    def __init__(self, content: bytes) -> None:
        header = self._section(content, b"MeshFormat").split(b"\n")
        self._is_binary = header[0].split()[1] != b"0"
        if self._is_binary and header[1][:4] != np.int32(1).tobytes():
            raise InputError("expected little-endian numbers", "big-endian ones")
        self._content = content

    def mesh(self) -> RawMesh:
        number, points = self._nodes()
        names = self._names()
        blocks, partitions = MeshBlocks(), set[int]()
        for kind, tags, nodes in (self._binary_elements if self._is_binary else self._text_elements)():
            cells, volume = number(nodes), kind in VOLUME_ELEMENTS
            of = tags[:, 0] if tags.size else np.zeros(len(cells), dtype=np.int64)
            partitions.update(tags[:, 3].tolist() if volume and tags.shape[1] > 3 else ())
            groups = [
                (names.get((3 if volume else 2, abs(tag)), str(abs(tag))), np.flatnonzero(of == tag))
                for tag in np.unique(of[of != 0]).tolist()
            ]
            if volume:
                blocks.add_solids(VOLUME_ELEMENTS[kind], cells, groups)
            elif kind in GMSH_CORNERS:
                blocks.add_surfaces(cells[:, : GMSH_CORNERS[kind]], groups)
            elif GMSH_NODES[kind] > 1:
                blocks.lines.append(cells[:, :2])
        remarks = [f"all cells are of partition {number}: others may be in separate files" for number in partitions]
        return blocks.mesh(points, {}, remarks if len(remarks) == 1 else ())

    @staticmethod
    def _section(content: bytes, name: bytes) -> bytes:
        """What stands between $NAME and $EndNAME, without the line ends around it; empty where there is none."""
        _, mark, rest = content.partition(b"$" + name)
        inside, end, _ = rest.partition(b"$End" + name)
        if mark and not end:
            raise InputError(f"expected ${name.decode()} to end with $End{name.decode()}", "the end of the file")
        return inside.partition(b"\n")[2]

    def _nodes(self) -> tuple[Callable[[Integers], Integers], Array]:
        """How tags of nodes become places among them, and (p, 3) coordinates."""
        parametric = b"$ParametricNodes" in self._content
        name = b"ParametricNodes" if parametric else b"Nodes"
        count, _, data = self._section(self._content, name).partition(b"\n")
        if self._is_binary:
            data = b"".join(_plain_nodes(data, int(count))) if parametric else data
            rows = np.frombuffer(data, dtype=_NODE, count=int(count))
            tags, points = rows["tag"].astype(np.int64), rows["x"].astype(np.float64)
        else:
            lines = [line.split() for line in data.splitlines() if line.strip()] if parametric else [data.split()]
            entries = [entry for line in lines for entry in (line[:4] if parametric else line)]
            values = np.array(entries, dtype=np.float64).reshape(int(count), 4)
            tags, points = values[:, 0].astype(np.int64), values[:, 1:]
        order = np.argsort(tags, kind="stable")
        ordered = tags[order]
        if np.any(ordered[1:] == ordered[:-1]):
            raise InputError("expected nodes with unique numbers", "two nodes of one number")

        def number(wanted: Integers) -> Integers:
            place = np.minimum(np.searchsorted(ordered, wanted), max(len(ordered) - 1, 0))
            if not len(ordered) or np.any(ordered[place] != wanted):
                raise InputError("expected elements of the nodes in $Nodes", "some of others")
            return order[place]

        return number, points

    def _names(self) -> dict[tuple[int, int], str]:
        lines = self._section(self._content, b"PhysicalNames").decode("utf-8", errors="replace").splitlines()[1:]
        rows = [line.split(maxsplit=2) for line in lines if line.strip()]
        return {(int(row[0]), int(row[1])): row[2].strip().strip('"') for row in rows}

    def _text_elements(self) -> Iterator[tuple[int, Integers, Integers]]:
        """Type, (c, t) tags of each element (physical group first, partition fourth) and (c, v) of its nodes."""
        lines = self._section(self._content, b"Elements").splitlines()
        rows: dict[tuple[int, int, int], list[list[bytes]]] = {}
        count = 0
        for line in filter(None, (line.split() for line in lines[1:])):
            rows.setdefault((int(line[1]), int(line[2]), len(line)), []).append(line)
            count += 1
        if count != int(lines[0]):
            raise InputError(f"expected the {int(lines[0])} elements that $Elements announces", count)
        for (kind, tags, length), of in rows.items():
            data = np.array(of, dtype=np.int64)
            if length - 3 - tags != GMSH_NODES.get(kind):
                known = GMSH_NODES.get(kind, "elements of a known type, not")
                raise InputError(f"expected {known} nodes of elements of type {kind}", length - 3 - tags)
            yield kind, data[:, 3 : 3 + tags], data[:, 3 + tags :]

    def _binary_elements(self) -> Iterator[tuple[int, Integers, Integers]]:
        announced, _, data = self._section(self._content, b"Elements").partition(b"\n")
        at = done = 0
        while done < int(announced):
            kind, count, tags = (int(value) for value in np.frombuffer(data, dtype="<i4", count=3, offset=at))
            if kind not in GMSH_NODES or count < 1 or tags < 0:
                raise InputError("expected elements of a known type", f"{count} of type {kind}")
            width = 1 + tags + GMSH_NODES[kind]
            rows = np.frombuffer(data, dtype="<i4", count=count * width, offset=at + 12).reshape(count, width)
            at, done = at + 12 + 4 * count * width, done + count
            values = rows.astype(np.int64)
            yield kind, values[:, 1 : 1 + tags], values[:, 1 + tags :]
