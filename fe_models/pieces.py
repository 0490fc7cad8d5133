"""A beam link cut into pieces of equal length, each a link of its own, for large deflections.

docs/theory.md, Subdivided links: pieces are simply supported, with one eigenmode (in space one of each plane) and the
static shapes of what their neighbors do to them.
"""

from collections.abc import Mapping, Sequence
from math import ceil
from pathlib import Path
from typing import Any

from ..common.errors import InputError, quoted
from ..common.structs import struct
from .link_file import read_link
from .link_records.families import Family
from .link_records.link import BeamLink, Link
from .link_source import LinkSource, LinkTable, link_path

BENDING: tuple[Family, ...] = ("in-plane-bending", "out-of-plane-bending")
ON_A_CUT = 1e-9  # of the length


@struct
class CutLink:
    """A link in pieces that begin at `starts`, m from the root."""

    tables: tuple[LinkTable, ...]  # the link of each piece, from the root to the tip
    starts: tuple[float, ...]
    places: Mapping[str, tuple[int, str]]  # of each interface, and of "mid", the number of the piece and the name there


IN_PLANE: tuple[Family, ...] = ("in-plane-bending", "axial")
"""The families of pieces of planar scenes."""


def cut(source: LinkSource, count: int, families: Sequence[Family] = IN_PLANE) -> CutLink:
    """Cut the link of `source` into `count` pieces, with modes of those `families` that the link has.

    Raises `InputError` where it cannot be cut.
    """
    link, path = read_link(source), link_path(source)
    beam = _beam(link, path, families)
    length = beam.geometry.length / count
    starts = tuple(k * length for k in range(count))
    positions = beam.places | {"mid": beam.geometry.length / 2}
    places = {name: _place(x, length, count) for name, x in positions.items()}
    places |= {name: (k, label or name) for name, (k, label) in places.items()}
    tables = tuple(
        LinkTable(
            _piece(beam, path, k, count, places, families), path.with_name(f"{path.name}: piece {k + 1} of {count}")
        )
        for k in range(count)
    )
    return CutLink(tables, starts, places)


def _beam(link: Link, path: Path, families: Sequence[Family]) -> BeamLink:
    if not isinstance(link, BeamLink):
        raise InputError(f'{path}: geometry.kind: expected "beam" of a subdivided body', '"solid"')
    bending = [family for family in families if family in BENDING]
    if not set(bending) & set(link.families):
        raise InputError(
            f"{path}: modes.family: expected {quoted(bending)} among those of a subdivided body",
            ", ".join(link.families),
        )
    if link.measured is not None:
        raise InputError(
            f"{path}: measured: expected none of a subdivided body (they apply to modes of the whole link)",
            link.measured.table,
        )
    return link


def _place(x: float, length: float, count: int) -> tuple[int, str]:
    """The piece in which x is, and the name of its end there; no name between its ends."""
    nearest = round(x / length)
    if abs(x - nearest * length) <= ON_A_CUT * length * count:
        return (0, "root") if nearest == 0 else (nearest - 1, "tip")
    return min(int(x / length), count - 1), ""


def _piece(
    link: BeamLink, path: Path, k: int, count: int, places: Mapping[str, tuple[int, str]], allowed: Sequence[Family]
) -> dict[str, Any]:
    record = link.model_dump(mode="json", exclude_none=True)
    length, start = link.geometry.length / count, k * link.geometry.length / count
    families = [family for family in link.families if family in allowed]
    bending = sum(family in BENDING for family in families)
    segments = [
        {"until": min(segment.until, start + length) - start, "section": segment.section.model_dump(mode="json")}
        for segment, before in zip(link.geometry.segment or (), link.geometry.breakpoints, strict=False)
        if segment.until > start + ON_A_CUT * length and before < start + length * (1 - ON_A_CUT)
    ]
    if segments:
        segments[-1]["until"] = length
    section = {"segment": segments} if segments else {"section": record["geometry"]["section"]}
    elements = link.mesh.elements or len(link.mesh.nodes or ()) - 1
    return {
        "name": f"{link.name}, piece {k + 1}",
        "material": record["material"],
        "geometry": {"kind": "beam", "length": length} | section,
        "mesh": {"elements": max(2, len(segments), ceil(elements / count))},
        "model": record["model"],
        "reference": {"condition": "simply-supported"},
        "modes": {"count": bending, "family": families, "attachment_modes": True},
        "damping": {"rayleigh": [0.0, _stiffness_damping(link, path)]},
        "interface": _interfaces(link, k, start, places),
        "stress": {"points": _stress_points(link, k, start, count)},
    }


def _stiffness_damping(link: BeamLink, path: Path) -> float:
    """B of D = bK, the damping that pieces and link have alike."""
    ratio, rayleigh = link.damping.ratio, link.damping.rayleigh
    ratios = ratio if isinstance(ratio, tuple) else (ratio or 0.0,)
    if any(ratios) or (rayleigh is not None and rayleigh[0]):
        raise InputError(
            f"{path}: damping: expected none or rayleigh = [0.0, b] of a subdivided body, since ratios are those of"
            " the modes of the whole link",
            f"{'ratio' if any(ratios) else 'rayleigh'} = {ratio if any(ratios) else list(rayleigh or ())}",
        )
    return rayleigh[1] if rayleigh else 0.0


def _interfaces(link: BeamLink, k: int, start: float, places: Mapping[str, tuple[int, str]]) -> list[dict[str, Any]]:
    """The interfaces of the link that are in piece k; masses of those on one cut are one."""
    interfaces: dict[str, dict[str, Any]] = {}
    for record in link.interface:
        piece, name = places[record.name]
        if piece != k:
            continue
        entry = interfaces.setdefault(name, {"name": name, "mass": 0.0, "inertia": [0.0, 0.0, 0.0]})
        if name not in ("root", "tip"):
            entry["position"] = link.places[record.name] - start
        entry["mass"] += record.mass
        entry["inertia"] = [a + b for a, b in zip(entry["inertia"], record.inertia, strict=True)]
    return list(interfaces.values())


def _stress_points(link: BeamLink, k: int, start: float, count: int) -> dict[str, list[float]]:
    """The stress points of the link that are in piece k; at a cut, like at a step, the section beyond it counts."""
    length, points = link.geometry.length / count, {}
    for name, (x, y, z) in link.stress.points.items():
        if min(int(x / length + ON_A_CUT * count), count - 1) == k:
            points[name] = [min(max(x - start, 0.0), length), y, z]
    return points
