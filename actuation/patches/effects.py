"""What a volt on each patch does to the modes of a link: by how its sections move, or faces outlined in a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ...fe_models.modal_body import ModalBody
from .composite import Placed, composite, place_of
from .records import PztLayout
from .sections import LinkSections, link_sections, load_per_volt, own_row, potentials, straight_loads

STEP = 0.1  # of the extent, from one station to the next; less is a taper


class Effects(NamedTuple):
    """Of k patches on the n modes of a modal body.

    Attributes:
        extent: (k,) t_b, of the link along their normal under each patch, its mean, m.
        per_volt: (k,) c, the load that each is there for, N·m/V.
        lever: (k,) strain of the surface by unit curvature and distance; by twist, β/2, of its diagonals.
        turn: (k, n) by how much the sections at the patch's ends turn against each other in its own sense, rad.
        Phi_V: (k, n) modal forces per volt, less what the layers' own stiffness takes.
    """

    extent: Array
    per_volt: Array
    lever: Array
    turn: Array
    Phi_V: Array


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
    stretches = [_stretches(key, layout, body, sections, k + 1, *edge) for k, edge in enumerate(edges)]
    starts, ends = (np.concatenate([x[side] for x, _ in stretches]) for side in (slice(None, -1), slice(1, None)))
    first = np.cumsum([0, *(len(stations) for _, stations in stretches[:-1])])
    alike, which = np.unique(sections.alike[np.concatenate([on for _, on in stretches])], return_inverse=True)
    places = np.array([place_of(layout, sections, station) for station in alike.tolist()])
    loads = np.array([straight_loads(layout, *place) for place in places])[which]
    differences = potentials(body, ends) - potentials(body, starts)
    of_stretch = np.stack([places[:, 0], load_per_volt(layout, *places.T), places[:, 1]])[:, which]
    extent, c, lever = np.add.reduceat(of_stretch * (ends - starts), first, axis=1) / np.add.reduceat(
        ends - starts, first
    )
    turn = np.add.reduceat(differences[:, own], first)
    Phi_V = np.add.reduceat(np.einsum("ir,irn->in", loads, differences), first)
    if layout.coupling == "surface":
        Phi_V = (c / (layout.width * extent / 2))[:, None] * _outlined(key, layout, body, edges)
    return Effects(extent, c, lever / 2 if layout.acts_in == "twist" else np.ones(len(edges)), turn, Phi_V)


def _stretches(
    key: str, layout: PztLayout, body: ModalBody, sections: LinkSections, number: int, start: float, end: float
) -> tuple[Array, Array]:
    """The ends (m + 1,) of stretches into which a change of the link's extent cuts a patch, and their stations (m,)."""
    x = body.stations.position[:, 0]
    slack = min(1e-9 * body.length, 0.25 * (end - start))
    covered = np.flatnonzero((x[1:] > start + slack) & (x[:-1] < end - slack))
    if not len(covered):  # rounding: it begins where it ends
        raise InputError(f"{key}: length: expected patches that can be seen on a link of {body.length:g} m, found less")
    extents = sections.extent(layout.normal)[covered]
    jump = np.abs(np.diff(extents)) / np.maximum(extents[1:], extents[:-1])
    if jump.max(initial=0.0) > STEP:
        k = int(jump.argmax())
        what = "height" if layout.normal == "y" else "width"
        raise InputError(
            f"{key}: expected patches on one section each, found patch {number} ({start:g} to {end:g} m) across a step"
            f" of the {what} from {extents[k]:g} to {extents[k + 1]:g} m at {x[covered[k + 1]]:g} m"
        )
    changes = np.flatnonzero(jump > 1e-9)
    ends = np.concatenate([[max(start, 0.0)], x[covered[changes + 1]], [min(end, body.length)]])
    return ends, covered[np.append(changes, len(extents) - 1)]


def _outlined(key: str, layout: PztLayout, body: ModalBody, edges: Array) -> Array:
    """(k, n) modal forces of unit membrane force (N/m): pressing the upper face, pulling the lower, halved on both."""
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
    faces = [sign * face for sign, face in ((-1.0, patches.top), (1.0, patches.bottom)) if face is not None]
    return np.asarray(sum(faces) / len(faces))


def _places(edges: Array) -> str:
    return ", ".join(f"{start:g} to {end:g}" for start, end in edges)
