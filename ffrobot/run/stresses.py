"""Stresses of links over a motion, where their files hold those of modes."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..common.arrays import Array
from ..fe_models.modal_body import ModalBody
from ..mbs.model.body import Body
from ..mbs.quantities.link_loads import LinkLoads, loads_on_links
from ..mbs.quantities.motion import modal_coordinates
from ..mbs.quantities.stress import (
    METHODS,
    BodyStress,
    SectionLoads,
    body_stress,
    mode_acceleration,
    mode_displacement,
)
from ..mbs.run.record import Run
from ..scene.pieces import BodyInPieces
from .bodies import LoadedBody, links_of

if TYPE_CHECKING:
    from ..actuation.patches.link_patches import LinkPatches
    from ..actuation.patches.patches import PatchArray


def find_stresses(
    run: Run,
    bodies: Mapping[str, LoadedBody],
    patches: "Mapping[str, LinkPatches]",
    divided: Mapping[str, BodyInPieces],
) -> dict[str, BodyStress]:
    """Compute stresses (Pa) of a run by body; those of links in pieces from their pieces, which are among `bodies`.

    By mode acceleration where files and loads allow it. By mode displacement for links with forces elsewhere than at
    interfaces, and for those, and their pieces, that patches stiffen otherwise than in bending in the plane.
    """
    links = {name: link for name, link in links_of(bodies).items() if link.stress or link.surface_stress is not None}
    stiff = {name: of for name, of in patches.items() if any(one.layout.adds_stiffness for one in of.arrays.values())}
    unknown = {name for name in stiff.keys() & links.keys() if _in_plane(stiff[name], bodies[name].spatial) is None}
    unknown |= {piece for name in stiff.keys() & divided.keys() for piece in divided[name].names}
    known = [name for name, link in links.items() if link.stress_loads and name not in unknown]
    loads = loads_on_links(run, known) if known else {}
    stresses = {}
    for name, link in links.items():
        p, spatial = modal_coordinates(run, name), bodies[name].spatial
        recovery = mode_displacement(p)
        sizes = loads[name].sizes if name in loads else None
        if sizes is not None and all(load in link.stress_loads or not size.any() for load, size in sizes.items()):
            sections = _sections(stiff[name], link, spatial, p, loads[name]) if name in stiff else None
            recovery = mode_acceleration(link, spatial.modal_transform, p, sizes, sections)
        stresses[name] = body_stress(link, recovery)
    for name, pieces in divided.items():
        if of_pieces := [stresses.pop(piece) for piece in pieces.names if piece in stresses]:
            points = {label: point for stress in of_pieces for label, point in stress.points.items()}
            method = min((stress.recovery.method for stress in of_pieces), key=METHODS.index)
            recovery = replace(mode_displacement(modal_coordinates(run, name)), method=method)
            stresses[name] = BodyStress(points, None, recovery)
    return stresses


def _in_plane(of_link: "LinkPatches", spatial: Body) -> "PatchArray | None":
    """The patches of a link where all that they do to its sections is to bend them in the plane, and to stretch."""
    array, *others = of_link.arrays.values()
    layout, moves = array.layout, spatial.modal_transform.any(axis=1)
    feels_across = layout.face and any(
        moves[k] for k, of in enumerate(array.link.family) if of == "out-of-plane-bending"
    )
    is_plain = layout.bends == "in-plane" and layout.fibre_angle is None and not layout.gives_way and not feels_across
    return array if is_plain and not others else None


def _sections(
    of_link: "LinkPatches", link: ModalBody, spatial: Body, p: Array, loads: LinkLoads
) -> SectionLoads | None:
    """What the patches do to the sections of their link at file coordinates p (T, n); None of old files.

    Voltages are those whose modal forces the motion shows.
    """
    from ..actuation.patches.composite import PlacedLayout, section_loads
    from ..actuation.patches.patches import voltage_gain

    array = _in_plane(of_link, spatial)
    if array is None or not np.isfinite(array.authority).all():
        return None
    F_p = of_link.reach.modes.forces(loads.modal_force @ spatial.on_file)
    return section_loads(PlacedLayout(array.layout, array.edges), link, p, F_p @ voltage_gain(of_link.reach).T)
