"""A modal body from what a foreign file says: integrals, nodes, stiffness; modes are made orthonormal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.linalg import eigh

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.version import VERSION
from ...fe_models.modal_body import Interface, ModalBody, PictureMesh, Stations
from ...fe_models.modal_body.craig_bampton import CONDITION as CRAIG_BAMPTON
from ...fe_models.modal_body.craig_bampton import constraint_modes
from .integrals import Node, ShapeIntegrals, interfaces_of, section_inertia

ORTHONORMAL = 1e-12  # of M_e = E and of K_e diagonal: then modes stay as they are
ON_AXIS = 1e-9  # of the body's size

NOT_IN_THE_FILE = (
    "not in the file: geometric stiffness, stresses, sections (so no patches on this body), the surface for pictures,"
    " names of mode families, which are inferred from the direction of most mass"
)


def modal_body(
    name: str, found: ShapeIntegrals, nodes: Sequence[Node], numbers: Mapping[str, int], condition: str | None = None
) -> ModalBody:
    """The body of foreign integrals and nodes.

    Raises:
        InputError: a mode has no stiffness, or the integrals cannot be those of a body.
    """
    T, omega2 = _orthonormal(found)
    found = _transformed(found, T, omega2)
    turned = (Interface(at.position, at.translation @ T, at.rotation @ T) for at in (node.at for node in nodes))
    nodes = [Node(node.number, at) for node, at in zip(nodes, turned, strict=True)]
    interfaces = interfaces_of(nodes, numbers)
    length = float(np.linalg.norm(interfaces["tip"].position - interfaces["root"].position))
    S_bar_kl = found.S_bar_kl
    sections = section_inertia(found)
    S_bar_kl[2, 2] += sections["S_spin"]  # as `ModalBody` books it
    without_sections = replace(found, spin=found.spin - np.outer(np.eye(3)[0], sections["h_spin"]))
    omega = np.sqrt(omega2)
    families = _families(S_bar_kl, np.asarray(sections["S_spin"]))
    constraint = constraint_modes(omega2, families, interfaces) if condition == CRAIG_BAMPTON else 0
    if condition == CRAIG_BAMPTON and not constraint:
        condition = "cantilever"  # which holds the root alike
    return ModalBody(
        name=name,
        kind="beam" if sections["J_spin"] else "solid",
        reference_condition=condition or _condition(interfaces),
        length=length,
        residual=np.repeat([0, 1], [found.n_modes - constraint, constraint]),
        mass=found.mass,
        first_moment=found.first_moment,
        frequency=omega / (2 * np.pi),
        stiffness=np.diag(omega2),
        modal_mass=np.eye(found.n_modes),
        damping_ratio=np.diag(found.damping) / (2 * omega),
        family=families,
        S_bar=found.S_bar,
        I_bar=without_sections.I_bar,
        S_bar_kl=S_bar_kl,
        interfaces=interfaces,
        stations=_stations(nodes, interfaces, length),
        mesh=_line(interfaces, found.n_modes),
        ffrobot_version=VERSION,
        **sections,  # type: ignore[arg-type]
    )


def _orthonormal(found: ShapeIntegrals) -> tuple[Array, Array]:
    """T (n, n) with TᵀM_eT = E, TᵀK_eT = diag(ω²), and ω² (n,)."""
    M, K, n = found.modal_mass, found.stiffness, found.n_modes
    squares = np.diag(K)
    if np.any(squares <= 0):
        raise InputError(
            f"K_e: expected a positive stiffness of every mode, found {squares.min():g}: leave out rigid modes"
        )
    size = np.sqrt(np.outer(squares, squares))
    plain = np.abs(M - np.eye(n)).max() <= ORTHONORMAL and np.abs((K - np.diag(squares)) / size).max() <= ORTHONORMAL
    if plain:
        return np.eye(n), squares
    try:
        omega2, T = eigh(0.5 * (K + K.T), 0.5 * (M + M.T))
    except np.linalg.LinAlgError:
        raise InputError("M_e: expected a positive definite matrix of modal masses, found one that is not") from None
    if omega2[0] <= 0:
        raise InputError(f"K_e: expected a positive definite stiffness, found an eigenvalue of {omega2[0]:g}")
    return np.asarray(T), np.asarray(omega2)


def _transformed(found: ShapeIntegrals, T: Array, omega2: Array) -> ShapeIntegrals:
    """In modal coordinates p, q = T p."""
    return replace(
        found,
        S_bar=found.S_bar @ T,
        inertia_slope=found.inertia_slope @ T,
        spin=found.spin @ T,
        spin_slope=np.einsum("alk,lm,kn->amn", found.spin_slope, T, T),
        modal_mass=T.T @ found.modal_mass @ T,
        centrifugal_slope=np.einsum("alk,lm,kn->amn", found.centrifugal_slope, T, T),
        stiffness=np.diag(omega2),
        damping=T.T @ found.damping @ T,
    )


def _condition(interfaces: Mapping[str, Interface]) -> str:
    """Cantilever where the root does not move in the frame; the other name stands for all else."""
    root = interfaces["root"]
    size = max(np.abs(at.translation).max(initial=0.0) for at in interfaces.values())
    return "cantilever" if np.abs(root.translation).max(initial=0.0) <= 1e-9 * size else "simply-supported"


def _families(S_bar_kl: Array, S_spin: Array) -> tuple[str, ...]:
    """By the direction in which most of a mode's mass moves."""
    shares = [np.diag(S_bar_kl[a, a]) for a in range(3)]
    shares[2] = shares[2] - np.diag(S_spin)
    names = ("axial", "in-plane-bending", "out-of-plane-bending", "torsion")
    return tuple(names[k] for k in np.argmax(np.array([*shares, np.diag(S_spin)]), axis=0))


def _stations(nodes: Sequence[Node], interfaces: Mapping[str, Interface], length: float) -> Stations:
    """The nodes on the line from root to tip, ascending in x; root and tip where the body lies otherwise."""
    on_axis = [node.at for node in nodes if np.abs(node.at.position[1:]).max() <= ON_AXIS * length]
    ends = [interfaces["root"], interfaces["tip"]]
    points = sorted(on_axis if len(on_axis) > 1 else ends, key=lambda at: float(at.position[0]))
    kept = [points[0]]
    kept += [b for a, b in pairwise(points) if b.position[0] - a.position[0] > ON_AXIS * length]
    if len(kept) < 2:
        raise InputError("nodes: expected root and tip at different x, found them at the same: turn the body's frame")
    position, translation, rotation = (
        np.array([vars(at)[key] for at in kept]) for key in ("position", "translation", "rotation")
    )
    return Stations(position, translation, rotation, np.zeros(len(kept)))


def _line(interfaces: Mapping[str, Interface], n: int) -> PictureMesh:
    ends = [interfaces["root"], interfaces["tip"]]
    shapes = np.array([at.translation for at in ends]).reshape(2, 3, n)
    return PictureMesh(np.array([at.position for at in ends]), np.array([[0, 1]], dtype=np.int64), shapes)
