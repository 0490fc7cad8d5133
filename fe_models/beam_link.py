"""From a beam's link file to its modal body: mesh, modes, their sign, integrals. Importing this loads dolfinx."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..errors import InputError

# First of all that load dolfinx: mesh.compat sets PETSc up.
from ..mesh.interval import graded_nodes, interval_mesh, with_points
from .beam import R_X, U_X, FamilyModel, family_model
from .eigen import lowest_modes
from .invariants import StationSpace, geometric_stiffness, shape_integrals, station_space
from .link_records import FAMILIES, BeamLink, Family
from .modal_body import Interface, ModalBody, PictureMesh, Stations

Floats = NDArray[np.float64]
Progress = Callable[[str], None]


class Mode(NamedTuple):
    """One mode: ω² in rad²/s², its family, and x (m,), the degrees of freedom of that family's model, xᵀMx = 1."""

    omega2: float
    family: Family
    x: Floats


def beam_modal_body(link: BeamLink, path: Path, input_hash: str, progress: Progress) -> ModalBody:
    """Compute the modal body of `link`, read from `path`.

    Raises:
        InputError: more modes are asked for than the mesh has.
        SolveError: the eigensolver did not converge.
    """
    length = link.geometry.length
    named = link.places
    nodes = _element_boundaries(link)
    mesh = interval_mesh(nodes)
    # The fields are read on a mesh of their own: there also the middle and the interfaces are vertices.
    station_mesh = interval_mesh(with_points(nodes, [0.5 * length, *named.values()]))
    stations = station_space(station_mesh)
    models: dict[Family, FamilyModel] = {}
    for family in link.families:
        progress(f"{link.name}: assembling {family}")
        models[family] = family_model(link, family, mesh, stations.x)
    progress(f"{link.name}: solving for the modes")
    modes = select(models, _wanted(link, models, path))
    fields = canonical(station_fields(models, modes, stations.x.size))
    progress(f"{link.name}: integrating the inertia")
    integrals = shape_integrals(link, stations, fields)
    omega = np.sqrt([mode.omega2 for mode in modes])
    translation, rotation = np.moveaxis(fields[:R_X], 0, 1), np.moveaxis(fields[R_X:], 0, 1)
    position = _on_axis(stations.x)
    return ModalBody(
        name=link.name,
        kind=link.geometry.kind,
        reference_condition=link.reference.condition,
        length=length,
        **vars(integrals),
        frequency=omega / (2 * np.pi),
        stiffness=np.diag(omega**2),
        modal_mass=modal_mass(models, modes),
        damping_ratio=_damping_ratio(link, omega),
        family=tuple(mode.family for mode in modes),
        geometric_stiffness=geometric_stiffness(link, stations, fields, named),
        interfaces={name: _interface(stations, fields, place) for name, place in named.items()},
        stations=Stations(position, translation, rotation, _heights(link, stations.x), stations.element),
        mesh=PictureMesh(position, stations.element[:, [0, 3]], translation),
        input_hash=input_hash,
        ffrobot_version=__version__,
    )


def select(models: Mapping[Family, FamilyModel], wanted: Sequence[int]) -> list[Mode]:
    """The modes numbered `wanted` (ascending; 1 is the lowest of all families together).

    Equal frequencies (bending of a square or round section) are told apart by the order of the families, not by
    rounding errors: the choice is the same on every machine.
    """
    modes = []
    for family, model in models.items():
        omega2, X = lowest_modes(model.K, model.M, model.strain, min(wanted[-1], model.K.shape[0]))
        modes += [Mode(square, family, x) for square, x in zip(omega2, X.T, strict=True)]
    modes.sort(key=lambda mode: (float(f"{mode.omega2:.9e}"), FAMILIES.index(mode.family)))
    return [modes[number - 1] for number in wanted]


def station_fields(models: Mapping[Family, FamilyModel], modes: Sequence[Mode], stations: int) -> Floats:
    """(6, k, n) displacement and rotation, rows U_X … R_Z, of n modes at k stations."""
    fields = np.zeros((6, stations, len(modes)))
    for k, mode in enumerate(modes):
        for row, values in models[mode.family].fields.items():
            fields[row, :, k] = values @ mode.x
    return fields


def modal_mass(models: Mapping[Family, FamilyModel], modes: Sequence[Mode]) -> Floats:
    """(n, n) m_ff = xᵀMx as assembled; families do not couple."""
    products = np.zeros((len(modes), len(modes)))
    for i, one in enumerate(modes):
        for j, other in enumerate(modes[: i + 1]):
            if one.family == other.family:
                products[i, j] = products[j, i] = one.x @ (models[one.family].M @ other.x)
    return products


def canonical(fields: Floats) -> Floats:
    """`fields` (6, k, n) with the sign of each mode as formulation.md, section 1, wants it.

    The dominant translation is positive at the station nearest the root where it exceeds half its largest value; of a
    mode without translation, the twist.
    """
    signs = np.ones(fields.shape[2])
    for k in range(signs.size):
        rows = fields[U_X:R_X, :, k]
        if not np.any(rows):
            rows = fields[R_X:, :, k]
        dominant = rows[np.argmax(np.abs(rows).max(axis=1))]
        signs[k] = np.sign(dominant[np.argmax(np.abs(dominant) > 0.5 * np.abs(dominant).max())])
    return fields * signs


def _element_boundaries(link: BeamLink) -> Floats:
    if link.mesh.nodes is not None:
        return np.array(link.mesh.nodes)
    assert link.mesh.elements is not None
    return graded_nodes(link.geometry.breakpoints, link.mesh.elements)


def _wanted(link: BeamLink, models: Mapping[Family, FamilyModel], path: Path) -> Sequence[int]:
    """Numbers of the modes asked for, from 1, ascending."""
    wanted = link.modes.indices or range(1, (link.modes.count or 0) + 1)
    available = sum(model.K.shape[0] for model in models.values())
    if wanted[-1] > available:
        key = "count" if link.modes.indices is None else "indices"
        raise InputError(
            f"{path}: modes.{key}: expected at most {available}, the number of modes available in family "
            f'"{link.modes.family}" on this mesh, found {wanted[-1]}'
        )
    return wanted


def _interface(stations: StationSpace, fields: Floats, position: float) -> Interface:
    station = int(np.argmin(np.abs(stations.x - position)))
    return Interface(_on_axis(np.array([position]))[0], fields[:R_X, station], fields[R_X:, station])


def _on_axis(x: Floats) -> Floats:
    return np.stack([x, np.zeros_like(x), np.zeros_like(x)], axis=1)


def _heights(link: BeamLink, x: Floats) -> Floats:
    """(k,) height of the section from each station on; at the tip, of the last section."""
    heights = np.array([section.height for section in link.sections])
    return heights[np.searchsorted(link.geometry.breakpoints[1:-1], x, side="right")]


def _damping_ratio(link: BeamLink, omega: Floats) -> Floats:
    """(n,) ζ as given, or of Rayleigh damping D = aM + bK: ζ = a/(2ω) + bω/2."""
    if link.damping.rayleigh is not None:
        a, b = link.damping.rayleigh
        return a / (2 * omega) + b * omega / 2
    return np.broadcast_to(np.asarray(link.damping.ratio or 0.0, dtype=np.float64), omega.shape).copy()
