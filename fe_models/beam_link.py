"""From a beam's link file to its modal body: mesh, modes, their sign, integrals. Importing this loads dolfinx."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..errors import InputError
from ..mesh.interval import graded_nodes, interval_mesh, with_points
from .beam import R_X, U_X, FamilyModel, family_model
from .eigen import lowest_modes
from .invariants import StationSpace, geometric_stiffness, shape_integrals, station_space
from .link_file import BeamLink, Family
from .modal_body import Interface, ModalBody, PictureMesh, Stations

Floats = NDArray[np.float64]
Progress = Callable[[str], None]


@dataclass(frozen=True)
class Modes:
    """n modes: ω² (n,) in rad²/s², the family of each, the six rows U_X … R_Z at k stations (6, k, n), XᵀMX (n, n)."""

    omega2: Floats
    family: tuple[Family, ...]
    fields: Floats
    modal_mass: Floats


def beam_modal_body(link: BeamLink, path: Path, input_hash: str, progress: Progress) -> ModalBody:
    """Compute the modal body of `link`, read from `path`.

    Raises:
        InputError: more modes are asked for than the mesh has.
        SolveError: the eigensolver did not converge.
    """
    length = link.geometry.length
    named = {"root": 0.0, "tip": length, **{item.name: item.position for item in link.interface}}
    nodes = _element_boundaries(link)
    mesh = interval_mesh(nodes)
    # The fields are read on a mesh of their own: there also the middle and the interfaces are vertices.
    station_mesh = interval_mesh(with_points(nodes, [0.5 * length, *named.values()]))
    stations = station_space(station_mesh)
    models = {}
    for family in link.families:
        progress(f"{link.name}: assembling {family}")
        models[family] = family_model(link, family, mesh, stations.x)
    progress(f"{link.name}: solving for the modes")
    modes = canonical(select(models, _wanted(link, models, path)))
    progress(f"{link.name}: integrating the inertia")
    integrals = shape_integrals(link, stations, modes.fields)
    omega = np.sqrt(modes.omega2)
    interfaces = {name: _interface(stations, modes.fields, position) for name, position in named.items()}
    translation, rotation = (np.moveaxis(rows, 0, 1) for rows in (modes.fields[:R_X], modes.fields[R_X:]))
    position = _on_axis(stations.x)
    vertices = stations.element[:, [0, 3]]
    return ModalBody(
        name=link.name,
        kind=link.geometry.kind,
        reference_condition=link.reference.condition,
        length=length,
        **vars(integrals),
        frequency=omega / (2 * np.pi),
        stiffness=np.diag(modes.omega2),
        modal_mass=modes.modal_mass,
        damping_ratio=_damping_ratio(link, omega),
        family=modes.family,
        geometric_stiffness=geometric_stiffness(link, stations, modes.fields, named),
        interfaces=interfaces,
        stations=Stations(position, translation, rotation, _heights(link, stations.x), stations.element),
        mesh=PictureMesh(position, vertices, translation),
        input_hash=input_hash,
        ffrobot_version=__version__,
    )


def select(models: dict[Family, FamilyModel], wanted: Sequence[int]) -> Modes:
    """The modes numbered `wanted` (1 is the lowest of all families together, ascending), mass-orthonormal.

    Equal frequencies (bending of a square or round section) are told apart by the order of the families, not by
    rounding errors: the choice is the same on every machine.
    """
    candidates = []
    for number, (family, model) in enumerate(models.items()):
        count = min(wanted[-1], model.K.shape[0])
        omega2, X = lowest_modes(model.K, model.M, model.strain, count)
        candidates += [(float(f"{omega2[k]:.9e}"), number, family, omega2[k], X[:, k]) for k in range(count)]
    candidates.sort(key=lambda candidate: candidate[:2])
    chosen = [candidates[index - 1] for index in wanted]
    stations = next(iter(next(iter(models.values())).fields.values())).shape[0]
    fields = np.zeros((6, stations, len(chosen)))
    modal_mass = np.eye(len(chosen))
    for k, (_, _, family, _, x) in enumerate(chosen):
        for row, values in models[family].fields.items():
            fields[row, :, k] = values @ x
        for j, (_, _, other, _, y) in enumerate(chosen[: k + 1]):
            if other == family:
                modal_mass[j, k] = modal_mass[k, j] = y @ (models[family].M @ x)
    return Modes(np.array([entry[3] for entry in chosen]), tuple(entry[2] for entry in chosen), fields, modal_mass)


def canonical(modes: Modes) -> Modes:
    """Signs as in formulation.md, section 1; a mode without translation has its twist positive in the same sense."""
    signs = np.ones(len(modes.family))
    for k in range(signs.size):
        rows = modes.fields[U_X:R_X, :, k]
        if not np.any(rows):
            rows = modes.fields[R_X:, :, k]
        dominant = rows[np.argmax(np.abs(rows).max(axis=1))]
        signs[k] = np.sign(dominant[np.argmax(np.abs(dominant) > 0.5 * np.abs(dominant).max())])
    return Modes(modes.omega2, modes.family, modes.fields * signs, modes.modal_mass * np.outer(signs, signs))


def _element_boundaries(link: BeamLink) -> Floats:
    if link.mesh.nodes is not None:
        return np.array(link.mesh.nodes)
    assert link.mesh.elements is not None
    return graded_nodes(link.geometry.breakpoints, link.mesh.elements)


def _wanted(link: BeamLink, models: dict[Family, FamilyModel], path: Path) -> Sequence[int]:
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
