"""Inertia shape integrals of a flexible body, as files of other programs have them, and back.

Symbols of Wallrapp's standard input data (O. Wallrapp, Standardization of flexible body modeling in multibody system
codes, Mech. Struct. Mach. 22, 1994, 283–304), to first order in the modal coordinates q:

    mdCM = m c + C_tᵀ q       J = J_0 + Σ J_l q_l        C_r = C_r0 + Σ C_rl q_l      of x + Φ q
    G_r l = 2 ∫ρ[(x·Φ_l) E − Φ_l xᵀ] dV     G_e = 2 ∫ρ Φᵀ e~ Φ dV     O_e = ∫ρ Φᵀ ω~ω~ (x + Φ q) dV
"""

import re
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.linalg import eigh

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.rotations import point_inertia
from ...common.structs import struct
from ...common.tables import shown
from ...common.version import VERSION
from ...fe_models.modal_body import Interface, ModalBody, PictureMesh, Stations
from ...fe_models.modal_body.craig_bampton import CONDITION as CRAIG_BAMPTON
from ...fe_models.modal_body.craig_bampton import constraint_modes
from ...fe_models.modal_body.parts import LEVI_CIVITA
from ...mbs.model.body import from_modal_body

POSITIVE = 1e-9  # of the largest entry: less is round-off
EXACT = 1e-12  # of the largest entry: modal masses are those of the shapes, or 1 and the stiffness diagonal
ROUNDED = 1e-3  # likewise, in files of few digits
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
"""ω_a ω_b of the columns of O_e."""


@struct
class ShapeIntegrals:
    """Inertia shape integrals of a body with n modes, shapes Φ in 1/√kg; SI units, axes of the body."""

    mass: float  # m in kg
    first_moment: Array  # (3,) m c in kg·m
    S_bar: Array  # (3, n) √kg, ∫ρ Φ dV = C_tᵀ
    inertia: Array  # (3, 3) J_0 about the origin, kg·m²
    inertia_slope: Array  # (3, 3, n) √kg·m, J_l
    spin: Array  # (3, n) √kg·m, ∫ρ x × Φ_l dV = C_r0ᵀ
    spin_slope: Array  # (3, n, n) ∫ρ Φ_k × Φ_l dV of modes k, l at [l, k], no unit
    modal_mass: Array  # (n, n) M_e, no unit
    centrifugal_slope: Array  # (6, n, n), no unit, ∫ρ Φ_lᵀ ω~ω~ Φ_k dV at [l, k], for ω_a ω_b of `PAIRS`, both orders
    # stiffness, damping: (n, n), of modal coordinates in m·√kg: 1/s² and 1/s
    stiffness: Array
    damping: Array

    @property
    def n_modes(self) -> int:
        """Number n of modes."""
        return len(self.stiffness)

    @property
    def I_bar(self) -> Array:
        """Return ∫ρ x_k Φ_l dV at [k, l] (3, 3, n), √kg·m, with rows Φ_x, Φ_y, Φ_z of Φ (Shabana's Ī_kl)."""
        trace = np.einsum("aan->n", self.inertia_slope) / 4
        symmetric = trace * np.eye(3)[:, :, None] - self.inertia_slope / 2
        return symmetric + 0.5 * np.einsum("abc,an->bcn", LEVI_CIVITA, self.spin)

    @property
    def gyroscopic(self) -> Array:
        """Return G_r (3, 3, n), √kg·m, for the gyroscopic moment Σ_l G_rl q̇_l ω: 2 (tr Ī 1 − Īᵀ) of Ī = `I_bar`."""
        I_bar = self.I_bar
        return 2 * (np.trace(I_bar) * np.eye(3)[:, :, None] - I_bar.transpose(1, 0, 2))

    @property
    def centrifugal(self) -> Array:
        """Return O_e (n, 6), √kg·m: factors of ω_a ω_b (`PAIRS`) in ∫ρ Φ_lᵀ ω~ω~ x dV of the undeformed body."""
        return np.stack([-(0.5 if a == b else 1.0) * self.inertia_slope[a, b] for a, b in PAIRS], axis=1)

    @property
    def translational_mass(self) -> Array:
        """Return ∫ρ Φᵀ Φ dV (n, n), modal masses without the rotation of sections; no unit."""
        return -0.5 * self.centrifugal_slope[:3].sum(axis=0)

    @property
    def S_bar_kl(self) -> Array:
        """Return ∫ρ Φ_kᵀ Φ_l dV at [k, l] (3, 3, n, n), with rows Φ_x, Φ_y, Φ_z of Φ (Shabana's S̄_kl); no unit."""
        n = self.n_modes
        S = np.zeros((3, 3, n, n))
        for k, (a, b) in enumerate(PAIRS):
            if a == b:
                S[a, a] = self.centrifugal_slope[k] + self.translational_mass
                continue
            c = 3 - a - b
            S[a, b] = 0.5 * (self.centrifugal_slope[k] - LEVI_CIVITA[a, b, c] * self.spin_slope[c])
            S[b, a] = S[a, b].T
        return S

    @property
    def about_center(self) -> Array:
        """Return the inertia (3, 3) about the center of mass, kg·m², in axes of the body."""
        return self.inertia - point_inertia(self.mass, self.first_moment / self.mass)

    def transformed(self, T: Array) -> "ShapeIntegrals":
        """Return the integrals in modal coordinates p (m,) with q = T p, T (n, m) in units of q over those of p."""
        linear = {key: getattr(self, key) @ T for key in ("S_bar", "inertia_slope", "spin")}
        squares = ("spin_slope", "modal_mass", "centrifugal_slope", "stiffness", "damping")
        return replace(self, **linear, **{key: T.T @ getattr(self, key) @ T for key in squares})


def integrals_of(body: ModalBody) -> ShapeIntegrals:
    """Return the integrals of a modal body, including the inertia of sections about their axis."""
    spatial = from_modal_body(body.name, body)
    same = ("mass", "first_moment", "S_bar", "inertia", "inertia_slope", "spin", "damping")
    own: dict[str, Any] = {key: getattr(spatial, key) for key in same} | slopes(spatial.S_bar_kl)
    return ShapeIntegrals(**own, modal_mass=body.modal_mass, stiffness=body.stiffness)


def slopes(S: Array) -> dict[str, Array]:
    """Return fields `spin_slope` (3, n, n) and `centrifugal_slope` (6, n, n) by `S_bar_kl` (3, 3, n, n); no unit."""
    centrifugal = [S[a, a] - np.trace(S) if a == b else S[a, b] + S[b, a] for a, b in PAIRS]
    spin = np.einsum("abc,bckl->alk", LEVI_CIVITA, S)
    return {"spin_slope": spin, "centrifugal_slope": np.array(centrifugal)}


def _with_agreed_masses(integrals: ShapeIntegrals) -> tuple[ShapeIntegrals, tuple[str, ...]]:
    """Adjust modal masses to those of the mode shapes; returns the integrals and a remark on the change, if any.

    In files of few digits M_e is off ∫ρΦᵀΦ. This replaces it where no section with inertia about x explains that.
    """
    M, translational = integrals.modal_mass, integrals.translational_mass
    off = np.abs(M - translational).max() / max(np.abs(M).max(), 1e-300)
    if off <= EXACT or np.linalg.eigvalsh(integrals.about_center)[0] > EXACT * np.abs(integrals.inertia).max():
        return integrals, ()
    if off > ROUNDED:
        raise InputError(
            "modal masses: expected the sums over masses and shapes, as nothing has inertia about the axis",
            f"them off by {off:.2g} of the largest",
        )
    remark = f"modal masses are sums over masses and shapes: those in the file are off by {off:.1e} of the largest"
    return replace(integrals, modal_mass=translational), (remark,)


def _section_inertia(integrals: ShapeIntegrals) -> dict[str, Array | float]:
    """J_spin, h_spin, S_spin and second_moment of `ModalBody`, of which formats have sums only.

    Where sections turn (M_e exceeds ∫ρΦᵀΦ), the inertia about x that no mass off the axis needs is theirs:
    J_s = 1/(J⁻¹)_xx about the center of mass, and h_s = C_r0 about x, both exact for a line of mass. If S_s does not
    allow h_s, as for a line with masses that turn, C_r0 stays in I_bar.
    """
    turning = integrals.modal_mass - integrals.translational_mass
    J_spin, h_spin = 0.0, np.zeros(integrals.n_modes)
    if np.abs(turning).max() > EXACT * np.abs(integrals.modal_mass).max(initial=1.0):
        J_spin = float(1 / np.linalg.inv(integrals.about_center)[0, 0])
        rest = np.linalg.eigvalsh(turning - np.outer(integrals.spin[0], integrals.spin[0]) / J_spin)
        if rest[0] >= -POSITIVE * np.abs(turning).max():
            h_spin = integrals.spin[0].copy()
    else:
        turning = np.zeros_like(turning)
    J = integrals.inertia - J_spin * np.diag([1.0, 0.0, 0.0])
    second = 0.5 * np.trace(J) * np.eye(3) - J
    return {"second_moment": second, "J_spin": J_spin, "h_spin": h_spin, "S_spin": turning}


Nodes = Mapping[int, Interface]
"""Points of a body by their numbers in a format."""
PARTS = ("position", "translation", "rotation")


def nodes_of(body: ModalBody) -> tuple[dict[int, Interface], dict[str, int]]:
    """Return stations, then interfaces at other places, by node number from 1; and the node of each interface."""
    stations = zip(*(getattr(body.stations, part) for part in PARTS), strict=True)
    nodes = {number: Interface(*parts) for number, parts in enumerate(stations, 1)}
    numbers = dict[str, int]()
    for name, at in body.interfaces.items():
        same = (
            number
            for number, node in nodes.items()
            if all(np.array_equal(getattr(node, part), getattr(at, part)) for part in PARTS)
        )
        numbers[name] = next(same, len(nodes) + 1)
        nodes.setdefault(numbers[name], at)
    return nodes, numbers


def note(body: ModalBody, numbers: Mapping[str, int]) -> str:
    """Return a comment with the reference condition and the node number of each interface, which formats lack."""
    return f"ffrobot: {body.reference_condition}; {', '.join(f'{name}={number}' for name, number in numbers.items())}"


def _noted(text: str, nodes: Nodes) -> tuple[str | None, dict[str, int]]:
    """Reference condition and number of each interface from a `note` in `text`; None and {} without one."""
    match = re.search(r"ffrobot: ([\w-]+); (.*)", text)
    if match is None:
        return None, {}
    numbers = dict[str, int]()
    for pair in match[2].strip().split(", "):
        name, _, number = pair.rpartition("=")
        if not name or not number.isdecimal() or int(number) not in nodes:
            raise InputError("interfaces: expected NAME=NUMBER of nodes in the file", f'"{shown(pair)}"')
        numbers[name] = int(number)
    return match[1], numbers


def _interfaces(nodes: Nodes, numbers: Mapping[str, int]) -> dict[str, Interface]:
    """By name: those of `numbers`, `root`, `tip` (nearest, farthest), else "node_NUMBER"."""
    by_distance = sorted(nodes, key=lambda number: float(np.linalg.norm(nodes[number].position)))
    ends = {"root": by_distance[0], "tip": by_distance[-1]}
    names = {number: name for name, number in reversed(ends.items())}
    named = dict(numbers) or {names.get(number, f"node_{number}"): number for number in nodes}
    for name, number in ends.items():
        named.setdefault(name, number)
    return {name: nodes[number] for name, number in named.items()}


ON_AXIS = 1e-9  # of the body's size
FAMILIES = ("axial", "in-plane-bending", "out-of-plane-bending", "torsion")
NOT_IN_THE_FILE = (
    "not in the file: geometric stiffness, stresses, sections (so no patches on this body), the surface for pictures,"
    " names of mode families, which are inferred from the direction of most mass"
)


def modal_body(name: str, integrals: ShapeIntegrals, nodes: Nodes, text: str) -> tuple[ModalBody, tuple[str, ...]]:
    """Return a modal body, with modes of unit mass, of integrals and nodes in a file; and remarks on losses.

    `text`: the file's, perhaps with a `note`. Raises `InputError` for masses or stiffnesses that contradict each other.
    """
    condition, numbers = _noted(text, nodes)
    integrals, remarks = _with_agreed_masses(integrals)
    T, omega2 = _orthonormal(integrals)
    if condition is None:  # ffrobot has its own order
        order = np.argsort(omega2, kind="stable")
        T, omega2 = T[:, order], omega2[order]
    integrals, n = integrals.transformed(T), len(omega2)
    root = omega2**0.25
    Z = integrals.damping / np.outer(root, root)
    if np.abs(Z * (1 - np.eye(n))).max() > ROUNDED * np.abs(Z).max():
        remarks += ("damping that couples modes is left out",)
    nodes = {number: Interface(at.position, at.translation @ T, at.rotation @ T) for number, at in nodes.items()}
    interfaces = _interfaces(nodes, numbers)
    ends = [interfaces["root"], interfaces["tip"]]
    span = ends[1].position - ends[0].position
    length = float(span[0])
    if length <= ON_AXIS * np.linalg.norm(span):
        raise InputError("nodes: expected the tip at larger x than the root", "another place: turn the body's frame")
    sections = _section_inertia(integrals)
    S_bar_kl, S_spin = integrals.S_bar_kl, np.asarray(sections["S_spin"])
    # Families are those of the direction in which most of a mode's mass moves.
    shares = [*(np.diag(S_bar_kl[a, a]) for a in range(3)), np.diag(S_spin)]
    families = tuple(FAMILIES[k] for k in np.argmax(shares, axis=0))
    S_bar_kl[2, 2] += S_spin  # as `ModalBody` books it
    without_sections = replace(integrals, spin=integrals.spin - np.outer([1.0, 0.0, 0.0], sections["h_spin"]))
    constraint = constraint_modes(omega2, families, interfaces) if condition == CRAIG_BAMPTON else 0
    if condition == CRAIG_BAMPTON and not constraint:
        condition = "cantilever"  # which holds the root alike
    omega, stations = np.sqrt(omega2), _stations(nodes, ends, length)
    if len(stations.position) == 2:
        remarks += ("shapes between root and tip are cubics: no node lies on a line along x",)
    body = ModalBody(
        name=name,
        kind="beam" if sections["J_spin"] else "solid",
        reference_condition=condition or _condition(interfaces),
        length=length,
        residual=np.repeat([0, 1], [n - constraint, constraint]),
        mass=integrals.mass,
        first_moment=integrals.first_moment,
        frequency=omega / (2 * np.pi),
        stiffness=np.diag(omega2),
        modal_mass=np.eye(n),
        damping_ratio=np.diag(integrals.damping) / (2 * omega),
        family=families,
        S_bar=integrals.S_bar,
        I_bar=without_sections.I_bar,
        S_bar_kl=S_bar_kl,
        interfaces=interfaces,
        stations=stations,
        mesh=PictureMesh(stations.position[[0, -1]], np.array([[0, 1]]), stations.translation[[0, -1]]),
        ffrobot_version=VERSION,
        **sections,  # type: ignore[arg-type]
    )
    return body, (NOT_IN_THE_FILE, *remarks)


def _orthonormal(integrals: ShapeIntegrals) -> tuple[Array, Array]:
    """T (n, n) with TᵀM_eT = E, TᵀK_eT = diag(ω²), and ω² (n,)."""
    M, K, n = integrals.modal_mass, integrals.stiffness, integrals.n_modes
    squares = np.diag(K)
    if np.any(squares <= 0):
        raise InputError(
            "K_e: expected a positive stiffness of every mode", f"{squares.min():g}: leave out rigid modes"
        )
    size = np.sqrt(np.outer(squares, squares))
    if np.abs((K - K.T) / size).max() > ROUNDED:
        raise InputError("K_e: expected a symmetric matrix", "another")
    if np.abs(M - np.eye(n)).max() <= EXACT and np.abs((K - np.diag(squares)) / size).max() <= EXACT:
        return np.eye(n), squares
    try:
        omega2, T = eigh(0.5 * (K + K.T), 0.5 * (M + M.T))
    except np.linalg.LinAlgError:
        raise InputError("M_e: expected a positive definite matrix of modal masses", "one that is not") from None
    if omega2[0] <= 0:
        raise InputError("K_e: expected a positive definite stiffness", f"an eigenvalue of {omega2[0]:g}")
    return T, omega2


def _condition(interfaces: Mapping[str, Interface]) -> str:
    """Cantilever if the root does not move in the frame; else the other name."""
    sizes = {name: np.abs(at.translation).max() for name, at in interfaces.items()}
    return "cantilever" if sizes["root"] <= 1e-9 * max(sizes.values()) else "simply-supported"


def _stations(nodes: Nodes, ends: list[Interface], length: float) -> Stations:
    """The nodes on the line along x through the root, ascending, where the tip is on it, else these two."""
    root, limit = ends[0].position, ON_AXIS * length
    on_axis = [at for at in [*ends, *nodes.values()] if np.abs(at.position - root)[1:].max() <= limit]
    points = sorted(on_axis if on_axis[:2] == ends else ends, key=lambda at: float(at.position[0]))
    points = [points[0], *(b for a, b in pairwise(points) if b.position[0] - a.position[0] > limit)]
    position, translation, rotation = (np.array([getattr(at, part) for at in points]) for part in PARTS)
    return Stations(position, translation, rotation, np.zeros(len(points)))
