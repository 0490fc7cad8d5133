"""Stress histories of flexible bodies by mode acceleration: static stresses of all loads, and what modes add.

    σ(t) = Σ_j s_j f_j(t) + Σ_k σ_k (p_k − p_s,k),    p_s = K⁻¹ Φᵀ Σ_j b_j f_j

with the static stress s_j of each unit load b_j and its size f_j: docs/theory.md, Stresses. Where static stresses or
loads are not known p_s = 0: the mode displacement method.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Indices, Integers, in_parts
from ...common.structs import struct
from ...fe_models.modal_body import ModalBody
from ...fe_models.modal_body.unit_loads import work_on_modes

METHODS = ("mode displacement", "mode acceleration")
CHUNK_BYTES = 32e6  # of surface stresses at a time; more leaves the cache


class PointStress(NamedTuple):
    """Stress at a point over time, in the body frame; columns xx, yy, zz, yz, xz, xy."""

    stress: Array  # (T, 6) Pa
    von_mises: Array  # (T,) Pa


class SurfaceStress(NamedTuple):
    """Largest von Mises stress on the surface over time, and its position."""

    von_mises_max: Array  # (T,) Pa
    position_of_max: Array  # (T, 3) m, undeformed, in the link's frame


@struct
class BodyStress:
    """Stresses of one body in one analysis, at the points and surface for which its file has modal stresses."""

    points: Mapping[str, PointStress]
    surface: SurfaceStress | None
    recovery: "Recovery"

    def largest(self) -> tuple[float, int, str]:
        """Largest von Mises stress in Pa, at which output, and where: a point's name or a position on the surface."""
        histories = [(point.von_mises, name) for name, point in self.points.items()]
        if self.surface is not None:
            histories.append((self.surface.von_mises_max, ""))
        values, name = max(histories, key=lambda history: float(history[0].max()))
        k = int(values.argmax())
        if self.surface is not None and not name:
            name = f"({', '.join(f'{c:.4g}' for c in self.surface.position_of_max[k])}) m"
        return float(values[k]), k, name


@struct
class SectionLoads:
    """Moments and forces on the sections of a link under k patches, by layers such as patches that stiffen it."""

    edges: Array  # (k, 2) x where each patch begins and ends, m
    patch: Integers  # (g,) number of the patch of each place, from 0
    x: Array  # (g,) the places, ascending within a patch, m
    moment: Array  # (T, g) of the section at each place, N·m, positive with φ'
    force: Array  # (T, g) along the link, N, positive in tension
    modal_force: Array  # (T, n) of both on the modes of the modal body file, N/√kg

    def shares(self, x: Array) -> Array:
        """Weights (s, g), no unit, of places for sections at x (s,), m: linear below one patch, else 0."""
        shares = np.zeros((len(x), len(self.x)))
        for k, (start, end) in enumerate(self.edges):
            own, under = np.flatnonzero(self.patch == k), np.flatnonzero((x >= start) & (x <= end))
            unit = np.eye(own.size)
            shares[np.ix_(under, own)] = np.stack([np.interp(x[under], self.x[own], row) for row in unit], axis=1)
        return shares


@struct
class Recovery:
    """Data for the stresses of a body, one row per output."""

    method: str  # one of `METHODS`
    modal: Array  # (T, n) √kg·m, p less its static part p_s, in the modes of the modal body file
    loads: tuple[str, ...]  # names of l unit loads that are not zero; none in the mode displacement method
    sizes: Array  # (T, l) SI, of these
    sections: SectionLoads | None = None  # of layers on the link; None where there are none

    @property
    def cases(self) -> Array:
        """Sizes (T, n + l + …) of modes (√kg·m), loads and sections (N, N·m), each with its own stress."""
        sections = () if self.sections is None else (self.sections.moment, self.sections.force)
        return np.concatenate([self.modal, self.sizes, *sections], axis=1)

    def at(self, rows: Indices) -> "Recovery":
        """The recovery of the outputs with numbers `rows` (k,)."""
        of = self.sections
        if of is not None:
            of = replace(of, moment=of.moment[rows], force=of.force[rows], modal_force=of.modal_force[rows])
        return Recovery(self.method, self.modal[rows], self.loads, self.sizes[rows], of)


def mode_displacement(p: Array) -> Recovery:
    """The recovery from modal coordinates p (T, n), √kg·m, of the file: no loads."""
    return Recovery(METHODS[0], p, (), np.zeros((len(p), 0)))


def mode_acceleration(
    body: ModalBody, T: Array, p: Array, loads: Mapping[str, Array], sections: SectionLoads | None
) -> Recovery:
    """The recovery by mode acceleration: modes without their static part, and loads with static stresses.

    p (outputs, n), √kg·m, are coordinates of the modes of `body`, its modal body file: T (n, m), no unit, times those
    of the equations. `loads`: sizes (outputs,) of unit loads by name, SI. `sections`: loads of layers.
    """
    known = [name for name in body.stress_loads if name in loads]
    if not known:
        return mode_displacement(p)
    names = tuple(name for name in known if np.any(loads[name]))
    # Static stresses count the inertia of a line of mass about it, but for files of 0.1
    column = body.stress_loads.index("r_x") if "r_x" in body.stress_loads else None
    static = [point.static for point in body.stress.values() if point.static is not None]
    has_spin = column is not None and any(np.any(stress[:, column]) for stress in static)
    work = work_on_modes(body.S_bar, body.I_bar, body.interfaces, body.h_spin if has_spin else None)
    sizes = np.array([loads[name] for name in names]).reshape(-1, len(p)).T
    forces = sizes @ np.array([work[name] for name in names]).reshape(-1, body.mode_count)
    if sections is not None:
        forces = forces + sections.modal_force
    p_s = forces @ T @ np.linalg.solve(T.T @ body.stiffness @ T, T.T)
    return Recovery(METHODS[1], p - p_s, names, sizes, sections)


def body_stress(body: ModalBody, recovery: Recovery) -> BodyStress:
    """Stresses over a motion at the points, and on the surface, for which `body` has modal stresses."""
    points = {}
    for name, point in body.stress.items():
        stress = recovery.cases @ _cases(body, recovery, point.position[:1], point.stress[None], point.static)[0].T
        points[name] = PointStress(stress, von_mises(stress))
    surface = None
    if body.surface_stress is not None:
        surface = _surface(_surface_cases(body, recovery), body.mesh.points, recovery.cases)
    return BodyStress(points, surface, recovery)


def surface_stress(body: ModalBody, recovery: Recovery) -> Array:
    """Stresses (T, p, 6), Pa, body axes, on the surface of a body whose file has surface stresses."""
    return np.einsum("pin,tn->tpi", _surface_cases(body, recovery), recovery.cases, optimize=True)


def _surface_cases(body: ModalBody, recovery: Recovery) -> Array:
    assert body.surface_stress is not None
    return _cases(body, recovery, body.mesh.points[:, 0], body.surface_stress, body.surface_static)


def _cases(body: ModalBody, recovery: Recovery, x: Array, modal: Array, static: Array | None) -> Array:
    """(m, 6, n + l + …) stresses at m places x (m) of all that `recovery` has sizes of.

    Unit loads that pull at both ends, or bend them, are the unit force and moment in every section.
    """
    if static is None or (not recovery.loads and recovery.sections is None):
        return modal
    of = dict(zip(body.stress_loads, np.moveaxis(static.reshape(len(modal), 6, -1), 2, 0), strict=True))
    parts = [modal, *(of[name][..., None] for name in recovery.loads)]
    if recovery.sections is not None:
        shares = recovery.sections.shares(x)[:, None]
        for load in ("moment/{}/z", "force/{}/x"):
            unit = of[load.format("tip")] - of[load.format("root")]
            parts.append(unit[..., None] * shares)
    return np.concatenate(parts, axis=-1)


def von_mises(stress: Array) -> Array:
    """Von Mises stress (…,), Pa, of stresses (…, 6), Pa: xx, yy, zz, yz, xz, xy."""
    return np.linalg.norm(stress @ _distortion().T, axis=-1)


def _distortion() -> Array:
    """(5, 6) what makes of a stress five numbers whose squares add up to the square of its von Mises stress.

    σ_v² = [σ_xx − (σ_yy + σ_zz)/2]² + ¾ (σ_yy − σ_zz)² + 3 (σ_yz² + σ_xz² + σ_xy²): von Mises 1913, squares completed.
    """
    rows = np.zeros((5, 6))
    rows[0, :3] = 1.0, -0.5, -0.5
    rows[1, 1:3] = np.sqrt(0.75), -np.sqrt(0.75)
    rows[2:, 3:] = np.sqrt(3.0) * np.eye(3)
    return rows


def _surface(modal: Array, positions: Array, p: Array) -> SurfaceStress:
    """From stresses (p, 6, n) of n cases at positions (p, 3) and their sizes (T, n), some outputs at a time."""
    count, _, n = modal.shape
    rows = np.einsum("ab,pbn->apn", _distortion(), modal).reshape(-1, n)
    largest, place = np.zeros(len(p)), np.zeros(len(p), dtype=np.int64)
    for some in in_parts(len(p), max(1, int(CHUNK_BYTES / (8 * len(rows))))):
        parts = (rows @ p[some].T).reshape(5, count, -1)
        squares = np.einsum("apt,apt->pt", parts, parts)
        worst = squares.argmax(axis=0)
        place[some] = worst
        largest[some] = np.sqrt(np.take_along_axis(squares, worst[None], axis=0)[0])
    return SurfaceStress(largest, positions[place])
