"""From a beam's link file to its modal body: mesh, modes, their sign, integrals."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from ...common.arrays import Array, as_floats
from ...common.errors import InputError
from ...common.version import VERSION
from ...mesh.structured import graded_nodes, with_points
from ..link_records.families import DEFAULT_COUNT, FAMILIES, Family
from ..link_records.link import BeamLink
from ..modal_body import Interface, ModalBody, PictureMesh, Stations
from ..modal_body.attachment_modes import ascending
from ..modal_body.damping import canonical_signs, damping_ratio
from ..modal_body.lumped_masses import lump_weights, lumps, with_lumped_masses, with_lumped_stiffness
from .attachment_modes import attachment_modes, fixed_interfaces, ritz_modes
from .beam import FamilyModel, family_model
from .dolfinx_forms import BeamForms
from .eigen import lowest_modes
from .geometric_stiffness import geometric_stiffness
from .invariants import shape_integrals
from .line import R_X, Functions, lagrange, on_axis
from .sections import section_outlines, shear_modulus
from .stress import beam_stresses, segments, stress_loads

# Elements are not cut closer to their ends than this fraction of their length.
SLIVER = 0.01

Progress = Callable[[str], None]


class Mode(NamedTuple):
    """One mode: ω² in rad²/s², its family, and x (m,), the degrees of freedom of that family's model, xᵀMx = 1."""

    omega2: float
    family: Family
    x: Array


def beam_modal_body(link: BeamLink, path: Path, progress: Progress) -> ModalBody:
    """Compute the modal body of `link`, read from `path`; its hashes are left empty.

    Raises `InputError` for more modes than the mesh has, `SolveError` where round-off errors spoil the modes.
    """
    length = link.geometry.length
    named = link.places
    models, stations = loaded_models(link, link.families, progress)
    progress(f"{link.name}: solving for the modes")
    places = [int(np.argmin(np.abs(stations.x - place))) for place in named.values()]
    modes, static = _modes(link, models, places, path)
    count = len(modes)
    modes += static
    fields = station_fields(models, modes, stations.x.size)
    fields = fields * canonical_signs(fields)
    progress(f"{link.name}: integrating the inertia")
    interfaces = {name: _interface(stations, fields, place) for name, place in named.items()}
    attached = lumps(link.interface, interfaces)
    integrals = with_lumped_masses(shape_integrals(link, stations, fields), attached)
    omega: Array = np.sqrt([mode.omega2 for mode in modes])
    translation, rotation = np.moveaxis(fields[:R_X], 0, 1), np.moveaxis(fields[R_X:], 0, 1)
    position = on_axis(stations.x)
    families = tuple(mode.family for mode in modes)
    residual = np.repeat([0, 1], [count, omega.size - count])
    kept = _with_sections(link, stations, position, translation, rotation)
    return ModalBody(
        name=link.name,
        kind=link.geometry.kind,
        reference_condition=link.reference.condition,
        length=length,
        **vars(integrals),
        frequency=as_floats(omega / (2 * np.pi)),
        stiffness=np.diag(omega**2),
        modal_mass=modal_mass(models, modes),
        damping_ratio=damping_ratio(link, omega),
        damping_of=link.damping.of,
        family=families,
        residual=residual,
        geometric_stiffness=with_lumped_stiffness(geometric_stiffness(link, stations, fields, named), attached),
        interfaces=interfaces,
        stations=kept,
        stress=beam_stresses(
            link, kept, omega**2, families, attached=attached, residual=residual, interfaces=interfaces
        ),
        stress_loads=stress_loads(link, interfaces),
        mesh=PictureMesh(position, stations.element[:, [0, 3]], translation),
        ffrobot_version=VERSION,
    )


def loaded_models(
    link: BeamLink, families: Sequence[Family], progress: Progress = lambda _: None
) -> tuple[dict[Family, FamilyModel], Functions]:
    """The eigenproblems of `families` with the masses on interfaces, and the stations at which they are read."""
    nodes = _element_boundaries(link)
    # The fields are read on elements of their own: there also the middle and the interfaces are nodes.
    stations = lagrange(with_points(nodes, [0.5 * link.geometry.length, *link.places.values()]), 3)
    forms, models = BeamForms(nodes), dict[Family, FamilyModel]()
    for family in families:
        progress(f"{link.name}: assembling {family}")
        models[family] = _loaded(family_model(link, family, forms, stations.x), link, stations.x)
    return models, stations


def _with_sections(
    link: BeamLink, stations: Functions, position: Array, translation: Array, rotation: Array
) -> Stations:
    """The stations, with extents, outlines and rigidities of the sections from each on; GJ where there is a ν."""
    segment = segments(link, stations.x)
    sections, E = link.sections, link.material.youngs_modulus
    height, width = (np.array([getattr(section, key) for section in sections]) for key in ("height", "width"))
    rigidity = E * np.array([[section.area, section.I_yy, section.I_zz] for section in sections])[segment]
    twist = None
    if link.material.poissons_ratio is not None:
        twist = (shear_modulus(link) * np.array([section.torsion for section in sections]))[segment]
    outlines = section_outlines(link.shapes)[segment]
    return Stations(
        position,
        translation,
        rotation,
        height[segment],
        stations.element,
        outline=outlines,
        rigidity=rigidity[:, :2],
        width=width[segment],
        out_of_plane_rigidity=rigidity[:, 2],
        torsional_rigidity=twist,
    )


def _modes(
    link: BeamLink, models: Mapping[Family, FamilyModel], places: Sequence[int], path: Path
) -> tuple[list[Mode], list[Mode]]:
    """Eigenmodes, or what stands for them, and attachment modes; interfaces are at the stations `places`."""
    is_fixed = link.reference.condition == "craig-bampton"
    fixed, Z = dict(models), dict[Family, sp.csr_matrix]()
    if is_fixed:
        for family, model in models.items():
            fixed[family], Z[family] = fixed_interfaces(model, family, places)
    modes = select_default(fixed) if link.modes.are_default else select(fixed, _wanted(link, fixed, path))
    if is_fixed:
        modes = [mode._replace(x=Z[mode.family] @ mode.x) for mode in modes]
    if not link.modes.attachment_modes:
        return modes, []
    known = {family: _together(models[family], family, modes) for family in models}
    static = [Mode(*mode) for mode in attachment_modes(models, known, places, link.geometry.length, not is_fixed)]
    return _ritz(models, modes, static) if is_fixed else (modes, _by_frequency(static))


def _ritz(
    models: Mapping[Family, FamilyModel], modes: Sequence[Mode], static: Sequence[Mode]
) -> tuple[list[Mode], list[Mode]]:
    """Modes of the floating frame in the space of fixed-interface modes and static shapes, family by family."""
    lower, higher = list[Mode](), list[Mode]()
    for family, model in models.items():
        pair = ritz_modes(model, family, _together(model, family, modes), _together(model, family, static))
        for kept, of_family in zip((lower, higher), pair, strict=True):
            kept += [Mode(*mode) for mode in of_family]
    return _by_frequency(lower), _by_frequency(higher)


def _loaded(model: FamilyModel, link: BeamLink, stations: Array) -> FamilyModel:
    """The eigenproblem with the masses on interfaces: M ← M + Σ m w wᵀ + J θ θᵀ, w and θ the motion there."""
    M = model.M
    for record in link.interface:
        station = np.argmin(np.abs(stations - link.places[record.name]))
        weights = lump_weights(record.mass, record.inertia)
        for row, values in model.fields.items():
            if weights[row]:
                M = M + weights[row] * (values[station].T @ values[station])
    return replace(model, M=M.tocsr())


def select(models: Mapping[Family, FamilyModel], wanted: Sequence[int]) -> list[Mode]:
    """The modes numbered `wanted` (ascending; 1 is the lowest of all families together).

    Equal frequencies (bending of a square or round section) are distinguished by the order of the families, not by
    round-off errors: the choice is the same on every machine.
    """
    modes = []
    for family, model in models.items():
        omega2, X = lowest_modes(model.K, model.M, model.strain, min(wanted[-1], model.K.shape[0]))
        modes += [Mode(square, family, x) for square, x in zip(omega2, X.T, strict=True)]
    modes = _by_frequency(modes)
    return [modes[number - 1] for number in wanted]


def select_default(models: Mapping[Family, FamilyModel]) -> list[Mode]:
    """Select the default number of modes of each family for a link with attachment modes, ascending."""
    modes = []
    for family, model in models.items():
        count = min(DEFAULT_COUNT[family], model.K.shape[0])
        modes += select({family: model}, range(1, count + 1))
    return _by_frequency(modes)


def _by_frequency(modes: Sequence[Mode]) -> list[Mode]:
    families = np.array([FAMILIES.index(mode.family) for mode in modes], dtype=np.int64)
    return [modes[k] for k in ascending(np.array([mode.omega2 for mode in modes]), families)]


def _together(model: FamilyModel, family: Family, modes: Sequence[Mode]) -> Array:
    """(m, n) those of `modes` that belong to a family."""
    return np.array([mode.x for mode in modes if mode.family == family]).reshape(-1, model.K.shape[0]).T


def station_fields(models: Mapping[Family, FamilyModel], modes: Sequence[Mode], stations: int) -> Array:
    """Return displacement and rotation (6, k, n), rows U_X … R_Z, of n modes at k stations."""
    fields = np.zeros((6, stations, len(modes)))
    for k, mode in enumerate(modes):
        for row, values in models[mode.family].fields.items():
            fields[row, :, k] = values @ mode.x
    return fields


def modal_mass(models: Mapping[Family, FamilyModel], modes: Sequence[Mode]) -> Array:
    """Return m_ff (n, n) = xᵀMx as assembled; families do not couple."""
    products = np.zeros((len(modes), len(modes)))
    for i, one in enumerate(modes):
        for j, other in enumerate(modes[: i + 1]):
            if one.family == other.family:
                products[i, j] = products[j, i] = one.x @ (models[one.family].M @ other.x)
    return products


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


def _wanted(link: BeamLink, models: Mapping[Family, FamilyModel], path: Path) -> Sequence[int]:
    """Numbers of the modes asked for, from 1, ascending."""
    wanted = link.modes.indices or range(1, (link.modes.count or 0) + 1)
    available = sum(model.K.shape[0] for model in models.values())
    if wanted[-1] > available:
        key = "count" if link.modes.indices is None else "indices"
        raise InputError(
            f"{path}: modes.{key}: expected at most {available}, the number of modes available in family"
            f' "{link.modes.family if isinstance(link.modes.family, str) else " + ".join(link.families)}" on this mesh',
            wanted[-1],
        )
    return wanted


def _interface(stations: Functions, fields: Array, position: float) -> Interface:
    station = int(np.argmin(np.abs(stations.x - position)))
    return Interface(on_axis(np.array([position]))[0], fields[:R_X, station], fields[R_X:, station])
