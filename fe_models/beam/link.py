"""From a beam's link file to its modal body: mesh, modes, their sign, integrals."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ...mesh.structured import graded_nodes, with_points
from ..link_records.families import DEFAULT_COUNT, FAMILIES, Family
from ..link_records.link import BeamLink
from ..modal_body import Interface, ModalBody, PictureMesh, Stations
from ..modal_body.attachment_modes import ascending
from ..modal_body.craig_bampton import FixedInterfaceFlexibility
from ..modal_body.lumped_masses import lump_weights, lumps
from ..modal_body.measured import canonical_signs
from ..modal_body.of_link import modal_body_of
from .beam import BeamForms, FamilyModel, family_model
from .invariants import geometric_stiffness, shape_integrals
from .line import R_X, Functions, lagrange
from .modes import BeamFlexibility, Mode, attachment_modes, lowest_modes, modes_of, ritz_modes
from .sections import section_outlines, section_property, segments, shear_modulus
from .stress import beam_stresses

# Elements are not cut closer to their ends than this fraction of their length.
SLIVER = 0.01

Progress = Callable[[str], None]


def beam_modal_body(link: BeamLink, path: Path, progress: Progress) -> ModalBody:
    """Compute the modal body of `link`, read from `path`; its hashes are left empty.

    Raises `InputError` for more modes than the mesh has, `SolveError` where round-off errors spoil the modes.
    """
    named = link.places
    models, stations = _loaded_models(link, progress)
    progress(f"{link.name}: solving for the modes")
    places = [int(np.argmin(np.abs(stations.x - place))) for place in named.values()]
    modes, static = _modes(link, models, places, path)
    count = len(modes)
    modes += static
    fields, modal_mass = np.zeros((6, stations.x.size, len(modes))), np.zeros((len(modes), len(modes)))
    for family, model in models.items():
        own, X = [k for k, one in enumerate(modes) if one.family == family], _together(model, family, modes)
        modal_mass[np.ix_(own, own)] = X.T @ (model.M @ X)
        for row, values in model.fields.items():
            fields[row][:, own] = values @ X
    fields = fields * canonical_signs(fields)
    progress(f"{link.name}: integrating the inertia")
    interfaces = {
        name: Interface(np.array([x, 0.0, 0.0]), fields[:R_X, k], fields[R_X:, k])
        for (name, x), k in zip(named.items(), places, strict=True)
    }
    attached = lumps(link.interface, interfaces)
    omega2, families = np.array([mode.omega2 for mode in modes]), tuple(mode.family for mode in modes)
    translation, rotation = np.moveaxis(fields[:R_X], 0, 1), np.moveaxis(fields[R_X:], 0, 1)
    position = np.outer(stations.x, [1.0, 0.0, 0.0])
    kept = _with_sections(link, stations, position, translation, rotation)
    return modal_body_of(
        link,
        omega2,
        families,
        count,
        interfaces,
        attached,
        integrals=shape_integrals(link, stations, fields),
        geometric_stiffness=geometric_stiffness(link, stations, fields, named),
        modal_mass=modal_mass,
        stations=kept,
        stress=beam_stresses(link, kept, omega2, families, count, attached=attached, interfaces=interfaces),
        mesh=PictureMesh(position, stations.element[:, [0, 3]], translation),
    )


def _loaded_models(link: BeamLink, progress: Progress) -> tuple[dict[Family, FamilyModel], Functions]:
    """The eigenproblems of the families with the masses on interfaces, and the stations at which they are read."""
    nodes = _element_boundaries(link)
    # The fields are read on elements of their own: there also the middle and the interfaces are nodes.
    stations = lagrange(with_points(nodes, [0.5 * link.geometry.length, *link.places.values()]), 3)
    forms, models = BeamForms(nodes), dict[Family, FamilyModel]()
    for family in link.families:
        progress(f"{link.name}: assembling {family}")
        model = family_model(link, family, forms, stations.x)
        M = model.M
        for record in link.interface:  # M ← M + Σ m w wᵀ + J θ θᵀ, w and θ the motion there
            station = np.argmin(np.abs(stations.x - link.places[record.name]))
            weights = lump_weights(record.mass, record.inertia)
            for row, values in model.fields.items():
                if weights[row]:
                    M = M + weights[row] * (values[station].T @ values[station])
        models[family] = replace(model, M=M.tocsr())
    return models, stations


def _with_sections(
    link: BeamLink, stations: Functions, position: Array, translation: Array, rotation: Array
) -> Stations:
    """The stations, with extents, outlines and rigidities of the sections from each on; GJ where there is a ν."""
    names = ("height", "width", "area", "I_yy", "I_zz", "torsion")
    height, width, area, I_yy, I_zz, J = (section_property(link, stations.x, name) for name in names)
    E = link.material.youngs_modulus
    return Stations(
        position,
        translation,
        rotation,
        height,
        stations.element,
        outline=section_outlines(link.shapes)[segments(link, stations.x)],
        rigidity=E * np.stack([area, I_yy], axis=1),
        width=width,
        out_of_plane_rigidity=E * I_zz,
        torsional_rigidity=None if link.material.poissons_ratio is None else shear_modulus(link) * J,
    )


def _modes(
    link: BeamLink, models: Mapping[Family, FamilyModel], places: Sequence[int], path: Path
) -> tuple[list[Mode], list[Mode]]:
    """Eigenmodes, or what stands for them, and attachment modes; interfaces are at the stations `places`."""
    is_fixed = link.reference.condition == "craig-bampton"
    flexibility = {family: _flexibility(model, places if is_fixed else ()) for family, model in models.items()}
    wanted = _wanted(link, sum(one.rank for one in flexibility.values()), path)
    modes = list[Mode]()
    for family, model in models.items():
        count = min(wanted[-1] if wanted else DEFAULT_COUNT[family], flexibility[family].rank)
        modes += modes_of(family, *lowest_modes(model, count, flexibility[family]))
    modes = _by_frequency(modes)
    modes = [modes[number - 1] for number in wanted] if wanted else modes
    if not link.modes.attachment_modes:
        return modes, []
    lower, higher = list[Mode](), list[Mode]()
    for family, model in models.items():
        X = _together(model, family, modes)
        static = attachment_modes(model, family, X, places, link.geometry.length, not is_fixed)
        if is_fixed:
            of_family, static = ritz_modes(model, family, X, _together(model, family, static))
            lower += of_family
        higher += static
    return _by_frequency(lower) if is_fixed else modes, _by_frequency(higher)


def _flexibility(model: FamilyModel, fixed: Sequence[int]) -> BeamFlexibility | FixedInterfaceFlexibility:
    """Under the supports, and with the stations `fixed`."""
    free, rows = BeamFlexibility(model), model.motion(fixed)
    return FixedInterfaceFlexibility(free, rows[np.any(rows, axis=1)]) if len(fixed) else free


def _by_frequency(modes: Sequence[Mode]) -> list[Mode]:
    """Ascending; equal ones (bending of square or round sections) by family, not by round-off: the same anywhere."""
    families = np.array([FAMILIES.index(mode.family) for mode in modes], dtype=np.int64)
    return [modes[k] for k in ascending(np.array([mode.omega2 for mode in modes]), families)]


def _together(model: FamilyModel, family: Family, modes: Sequence[Mode]) -> Array:
    """(m, n) those of `modes` that belong to a family."""
    return np.array([mode.x for mode in modes if mode.family == family]).reshape(-1, model.K.shape[0]).T


def _element_boundaries(link: BeamLink) -> Array:
    """As the link file wants them, and one more at each attached mass, or load with a shape of its own: shear jumps."""
    if link.mesh.nodes is not None:
        nodes = np.array(link.mesh.nodes)
    else:
        assert link.mesh.elements is not None
        nodes = graded_nodes(link.geometry.breakpoints, link.mesh.elements)
    for record in link.interface:
        place = link.places[record.name]
        i = int(np.clip(np.searchsorted(nodes, place), 1, nodes.size - 1))
        nearest = np.min(np.abs(nodes[i - 1 : i + 1] - place))
        # Next to a node that jump does no harm, a sliver of an element does: its stiffness is all round-off.
        loaded = link.modes.attachment_modes or any(lump_weights(record.mass, record.inertia))
        if loaded and nearest > SLIVER * (nodes[i] - nodes[i - 1]):
            nodes = with_points(nodes, [place])
    return nodes


def _wanted(link: BeamLink, available: int, path: Path) -> Sequence[int]:
    """Numbers of the modes asked for, from 1, ascending; none where the program selects their number."""
    wanted = link.modes.indices or range(1, (link.modes.count or 0) + 1)
    if wanted and wanted[-1] > available:
        key = "count" if link.modes.indices is None else "indices"
        raise InputError(
            f"{path}: modes.{key}: expected at most {available}, the number of modes available in family"
            f' "{link.modes.family if isinstance(link.modes.family, str) else " + ".join(link.families)}" on this mesh',
            wanted[-1],
        )
    return wanted
