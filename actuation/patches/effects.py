"""What a volt on each patch does to the modes of a link: by how its sections move, or faces outlined in a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError
from ...fe_models.modal_body import ModalBody
from .composite import Placed, composite, place_of
from .records import PztLayout
from .sections import LinkSections, link_sections, load_per_volt, own_row, potentials, side, straight_loads

STEP = 0.1  # of the extent, from one station to the next; less is a taper


class Effects(NamedTuple):
    """Of k patches on the n modes of a modal body."""

    extent: Array  # (k,) t_b, of the link along their normal under each patch, its mean, m: see `LinkSections.extent`
    per_volt: Array  # (k,) c, the load that each is there for, N·m/V
    lever: Array  # (k,) strain of the surface by unit curvature and distance; by twist, β/2, of its diagonals
    turn: Array  # (k, n) by how much the sections at the patch's ends turn against each other in its own sense, rad
    Phi_V: Array  # (k, n) modal forces per volt, less what the layers' own stiffness takes


def effects(key: str, placed: Sequence[Placed], body: ModalBody) -> list[Effects]:
    """Of the layouts of one link, which their stiffness makes feel each other where it counts."""
    found = [_straight(key, one, body) for one in placed]
    stiff = [k for k, one in enumerate(placed) if one.layout.adds_stiffness]
    if not stiff:
        return found
    shortfall = composite([placed[k] for k in stiff], body).shortfall
    ends = np.cumsum([len(placed[k].edges) for k in stiff])
    for k, lacking in zip(stiff, np.split(shortfall, ends[:-1]), strict=True):
        found[k] = found[k]._replace(Phi_V=found[k].Phi_V - lacking)
    return found


def _straight(key: str, placed: Placed, body: ModalBody) -> Effects:
    """On a link held straight: the loads of a volt times the differences of what they work on, stretch by stretch."""
    layout, edges = placed
    own, sections = own_row(layout), link_sections(body)
    starts, ends, stations, first = _stretches(key, layout, body, sections, edges)
    alike, which = np.unique(sections.alike[stations], return_inverse=True)
    places = np.array([place_of(layout, sections, station) for station in alike.tolist()])
    loads = np.array([straight_loads(layout, *place) for place in places])[which]
    before, after = np.split(potentials(body, np.concatenate([starts, ends])), 2)
    differences = after - before
    of_stretch = np.stack([places[:, 0], load_per_volt(layout, *places.T), places[:, 1]])[:, which]
    extent, c, lever = np.add.reduceat(of_stretch * (ends - starts), first, axis=1) / np.add.reduceat(
        ends - starts, first
    )
    turn = np.add.reduceat(differences[:, own], first)
    Phi_V = np.add.reduceat(np.einsum("ir,irn->in", loads, differences), first)
    if layout.coupling == "surface":
        Phi_V = (c / (layout.width * extent / 2))[:, None] * _outlined(key, layout, body, edges)
    return Effects(extent, c, lever / 2 if layout.acts_in == "twist" else np.ones(len(edges)), turn, Phi_V)


class _Stretches(NamedTuple):
    """Of k patches, one after the other, each m of one extent: `starts`, `ends` (m,), m; `first` (k,) of each patch."""

    starts: Array
    ends: Array
    stations: Indices
    first: Indices


def _stretches(key: str, layout: PztLayout, body: ModalBody, sections: LinkSections, edges: Array) -> _Stretches:
    """Stretches into which changes of the link's extent cut patches between `edges` (k, 2), and their stations."""
    x, (starts, ends) = body.stations.position[:, 0], edges.T
    slack = np.minimum(1e-9 * body.length, 0.25 * (ends - starts))
    covered = (x[1:] > (starts + slack)[:, None]) & (x[:-1] < (ends - slack)[:, None])
    if not covered.any(axis=1).all():  # rounding: it begins where it ends
        raise InputError(f"{key}: length: expected patches that can be seen on a link of {body.length:g} m, found less")
    extents = sections.extent(layout.normal, side(layout))[:-1]
    jump = np.abs(np.diff(extents)) / np.maximum(extents[1:], extents[:-1])
    jumps = np.where(covered[:, 1:] & covered[:, :-1], jump, 0.0)
    if jumps.max(initial=0.0) > STEP:
        number = int((jumps > STEP).any(axis=1).argmax())
        k = int(jumps[number].argmax())
        what = "height" if layout.normal == "y" else "width"
        raise InputError(
            f"{key}: expected patches on one section each, found patch {number + 1} ({starts[number]:g} to"
            f" {ends[number]:g} m) across a step of the {what} from {extents[k]:g} to {extents[k + 1]:g} m at"
            f" {x[k + 1]:g} m"
        )
    last, cut = covered.copy(), covered.copy()
    last[:, :-1] &= ~covered[:, 1:]
    cut[:, :-1] &= last[:, :-1] | (jumps > 1e-9)
    patch, stations = np.nonzero(cut)
    is_last = last[patch, stations]
    found = np.where(is_last, np.minimum(ends, body.length)[patch], x[stations + 1])
    first = np.append(0, np.flatnonzero(is_last)[:-1] + 1)
    begin = np.append(0.0, found[:-1])
    begin[first] = np.maximum(starts, 0.0)
    return _Stretches(begin, found, stations, first)


def _outlined(key: str, layout: PztLayout, body: ModalBody, edges: Array) -> Array:
    """(k, n) modal forces of unit membrane force (N/m): pressing the upper face, pulling the lower, halved on both.

    On the layout's face; all that are outlined where it names none. Raises `InputError` where they are not outlined.
    """
    patches = body.surface_patches
    if patches is None:
        raise InputError(
            f'{key}: coupling: expected "rotation", or a link whose file outlines the patches ([surface_patch]), found'
            ' "surface" and none outlined'
        )
    found = (*edges.ravel(), layout.width)
    outlined = (*patches.edges.ravel(), patches.width)
    if len(found) != len(outlined) or not np.allclose(found, outlined, rtol=0.0, atol=1e-6 * body.length):
        raise InputError(
            f"{key}: coupling: expected the {len(patches.edges)} patches that the link file outlines, from"
            f" {_places(patches.edges)} m and {patches.width:g} m wide, found {len(edges)}, from {_places(edges)} m and"
            f" {layout.width:g} m wide"
        )
    outlined_on = {"+y": patches.top, "-y": patches.bottom}
    wanted = ["+y", "-y"] if layout.face == "both" else [layout.face] if layout.face else []
    if missing := [face for face in wanted if outlined_on[face] is None]:
        raise InputError(
            f"{key}: face: expected patches on faces that the link file outlines ([surface_patch] faces), found"
            f' "{layout.face}", of which {missing[0]} has none outlined'
        )
    signs = {"+y": -1.0, "-y": 1.0}
    faces = [signs[name] * of for name, of in outlined_on.items() if of is not None and (not wanted or name in wanted)]
    return np.asarray(sum(faces) / len(faces))


def _places(edges: Array) -> str:
    return ", ".join(f"{start:g} to {end:g}" for start, end in edges)
