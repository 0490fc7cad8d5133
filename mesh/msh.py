"""Meshes in gmsh's own format. Importing this loads gmsh.

gmsh takes what it does not know for a script, and runs it: so the header is checked, and gmsh sees a copy of the file
in an empty folder alone (beside `x.msh` it would run `x.msh.opt`). Of version 2 gmsh puts all elements of one entity
into all physical groups that any of them has: the copy has entities of one group each. See "MSH file format" in the
manual of gmsh.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import gmsh
import numpy as np

from ..common.arrays import Integers
from ..common.errors import InputError, blaming_file
from .gmsh_session import extract_mesh, gmsh_session, own_entities
from .source import RawMesh

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
        return _by_gmsh(content, float(content[len(_HEADER) :].split(maxsplit=1)[0]) < 4)


def _by_gmsh(content: bytes, is_old: bool) -> RawMesh:
    with TemporaryDirectory() as folder, gmsh_session():
        gmsh.option.setNumber("General.AbortOnError", 3)  # to tell what is wrong
        content, partitions = _by_group(content) if is_old else (content, set())
        alone = Path(folder) / "mesh.msh"
        alone.write_bytes(content)
        gmsh.logger.start()
        gmsh.merge(str(alone))
        if again := [line for line in gmsh.logger.get() if "duplicate" in line]:
            raise InputError("expected nodes with unique numbers", again[0])
        elements = [tags for entity in own_entities() for tags in gmsh.model.mesh.getElements(*entity)[1]]
        read = ("Nodes", [gmsh.model.mesh.getNodes()[0]]), ("Elements", elements)
        for name, tags in () if is_old else read:  # version 2 loses nodes of no element
            announced, counted = _announced(content, name), sum(map(len, tags))
            if announced != counted:
                raise InputError(f"expected the {announced} {name.lower()} that ${name} announces", counted)
        _check_partitions(content)
        remarks = [f"all cells are of partition {number}: others may be in separate files" for number in partitions]
        return replace(extract_mesh(), remarks=remarks if len(remarks) == 1 else ())


def _check_partitions(content: bytes) -> None:
    if b"$PartitionedEntities" not in content:
        return
    entities = [entity for entity in gmsh.model.getEntities(3) if gmsh.model.mesh.getElements(*entity)[0].size]
    partitions = {int(number) for entity in entities for number in gmsh.model.getPartitions(*entity)}
    announced = _announced(content, "PartitionedEntities", 0)
    if len(partitions) < announced:
        raise InputError(f"expected all {announced} partitions of the mesh in one file", len(partitions))


def _announced(content: bytes, name: str, place: int = 1) -> int:
    """How many members a section of version 4 announces: the number at `place`."""
    is_binary = content.split(maxsplit=3)[2] != b"0"
    data = content.partition(f"${name}".encode())[2].partition(b"\n")[2]
    return int(np.frombuffer(data, dtype="<u8", count=2)[place] if is_binary else data.split(maxsplit=2)[place])


def _by_group(content: bytes) -> tuple[bytes, set[int]]:
    """A file of version 2 whose elements have the number of their group for that of their entity, and its partitions.

    Elements of none are in an entity of their own.
    """
    header = _section(content, "MeshFormat").split(b"\n")
    is_binary = header[0].split()[1] != b"0"
    if is_binary and header[1][:4] != np.int32(1).tobytes():
        raise InputError("expected little-endian numbers", "big-endian ones")
    data = _section(content, "Elements")
    blocks = list((_binary_elements if is_binary else _text_elements)(data))
    groups = [np.abs(tags[:, :1]) if tags.size else np.zeros((len(tags), 1), dtype=np.int64) for _, tags, _ in blocks]
    other = max((int(of.max(initial=0)) for of in groups), default=0) + 1
    partitions, written, count = set[int](), list[bytes](), 0
    for (kind, tags, nodes), of in zip(blocks, groups, strict=True):
        if gmsh.model.mesh.getElementProperties(kind)[1] == 3 and tags.shape[1] > 3:
            partitions.update(tags[:, 3].tolist())
        number = count + np.arange(1, len(nodes) + 1)[:, None]
        rows = [number, of, np.where(of, of, other), nodes]
        if is_binary:
            written.append(
                np.array([kind, len(nodes), 2], dtype="<i4").tobytes() + np.hstack(rows).astype("<i4").tobytes()
            )
        else:
            table = np.hstack([number, np.full_like(number, kind), np.full_like(number, 2), *rows[1:]])
            written += [b"%s\n" % " ".join(map(str, row)).encode() for row in table.tolist()]
        count += len(nodes)
    return content.replace(data, b"%d\n" % count + b"".join(written), 1), partitions


def _section(content: bytes, name: str) -> bytes:
    """What stands between $NAME and $EndNAME, without the line end before it."""
    _, mark, rest = content.partition(f"${name}".encode())
    inside, end, _ = rest.partition(f"$End{name}".encode())
    if mark and not end:
        raise InputError(f"expected ${name} to end with $End{name}", "the end of the file")
    return inside.partition(b"\n")[2]


def _text_elements(data: bytes) -> Iterator[tuple[int, Integers, Integers]]:
    """Type, (c, t) tags of each element (physical group first, partition fourth) and (c, v) of its nodes."""
    lines = data.splitlines()
    rows: dict[tuple[int, int, int], list[list[bytes]]] = {}
    count = 0
    for line in filter(None, (line.split() for line in lines[1:])):
        rows.setdefault((int(line[1]), int(line[2]), len(line)), []).append(line)
        count += 1
    if count != int(lines[0]):
        raise InputError(f"expected the {int(lines[0])} elements that $Elements announces", count)
    for (kind, tags, length), of in rows.items():
        values, nodes = np.array(of, dtype=np.int64), gmsh.model.mesh.getElementProperties(kind)[3]
        if length - 3 - tags != nodes:
            raise InputError(f"expected {nodes} nodes of elements of type {kind}", length - 3 - tags)
        yield kind, values[:, 3 : 3 + tags], values[:, 3 + tags :]


def _binary_elements(section: bytes) -> Iterator[tuple[int, Integers, Integers]]:
    announced, _, data = section.partition(b"\n")
    at = done = 0
    while done < int(announced):
        kind, count, tags = (int(value) for value in np.frombuffer(data, dtype="<i4", count=3, offset=at))
        if count < 1 or tags < 0:
            raise InputError("expected elements of a known type", f"{count} of type {kind}")
        width = 1 + tags + gmsh.model.mesh.getElementProperties(kind)[3]
        rows = np.frombuffer(data, dtype="<i4", count=count * width, offset=at + 12).reshape(count, width)
        at, done = at + 12 + 4 * count * width, done + count
        values = rows.astype(np.int64)
        yield kind, values[:, 1 : 1 + tags], values[:, 1 + tags :]
