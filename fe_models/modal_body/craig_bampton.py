"""Craig–Bampton: a link by the motion of its interfaces and by modes of the link fixed at all of them. NumPy only.

docs/theory.md, eqs. 10 and 11: the frame moves with the root, the other interfaces move by d = q − R r relative to it.
The link has the modes of the floating frame, coordinates p; p = T (d, η) follows from their motion at the interfaces.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.structs import struct
from ..link_records.families import FAMILIES, LOCAL
from .attachment_modes import ModeSet, ascending, moving, uncoupled
from .body import ModalBody
from .parts import LEVI_CIVITA, Interface

CONDITION, ROOT = "craig-bampton", "root"
AXES = ("x", "y", "z", "rx", "ry", "rz")


def in_order(K: Array, families: Sequence[str], is_static: Sequence[bool]) -> ModeSet:
    """Ritz modes in the space of fixed-interface modes and static shapes X, XᵀMX = I, in coordinates of these.

    First come those that count as eigenmodes, then the highest: of each family, unless the link couples families, as
    many as it has static shapes. K (n, n) in rad²/s² is XᵀKX; `families` and `is_static` are of the columns of X.
    """
    names: list[str] = [*FAMILIES, LOCAL]
    of = np.array([names.index(family) for family in families])
    squares, turn, of_modes = uncoupled(K, of)
    residual = np.zeros(of.size, dtype=np.int64)
    for family in set(of.tolist()):
        static = int(np.count_nonzero(of[np.array(is_static)] == family))
        own = np.flatnonzero(of_modes == family)
        residual[own[np.argsort(squares[own], kind="stable")[::-1]][:static]] = 1
    others = np.flatnonzero(residual == 0)
    lacking = sum(is_static) - int(residual.sum())
    residual[others[np.argsort(squares[others], kind="stable")[::-1]][:lacking]] = 1
    order = ascending(squares, of_modes)
    order = order[np.argsort(residual[order], kind="stable")]
    return ModeSet(squares[order], tuple(names[of_modes[k]] for k in order), turn[:, order])


ALONE = 1e-12  # eigenvalues of flexibility, each scaled to 1: less is of interfaces at one place


class FixedInterfaceFlexibility:
    """F − F Bᵀ (B F Bᵀ)⁻¹ B F: displacements u, m, under loads with interfaces fixed, B u = 0, B (k, m) the `rows`, SI.

    F is the `flexibility`, of a `rank`, under the supports of the root. Of vectors that several processes share, each
    has its own m entries; `total` sums an array over the processes.
    """

    def __init__(self, flexibility: Any, rows: Array, total: Callable[[Array], Array] = np.asarray) -> None:
        self._free, self._rows, self._total = flexibility, rows, total
        self.rank = flexibility.rank - len(rows)
        self._shapes = flexibility @ np.ascontiguousarray(rows.T)
        gram = total(rows @ self._shapes)
        size = np.sqrt(np.outer(np.diag(gram), np.diag(gram)))
        self._inverse = np.linalg.pinv(gram / size, rcond=ALONE, hermitian=True) / size

    def __matmul__(self, loads: Array) -> Array:
        """Displacements (m, k), m, under loads (m, k), N; collective."""
        U = self._free @ loads
        return U - self._shapes @ (self._inverse @ self._total(self._rows @ U))


@struct
class InterfaceCoordinates:
    """Interface coordinates d, m and rad, by n modal coordinates p, m·√kg, of the floating frame; SI units."""

    names: list[str]  # of the c coordinates d: "tip/y" … "tip/rz", of interfaces other than the root
    rows: Array  # (c, n) d = rows p
    constraint: Array  # (n, c) p of each constraint mode, rows constraint = 1
    fixed: Array  # (n, n − c) p of each fixed-interface mode, rows fixed = 0, orthonormal in M, uncoupled in K


# Of the largest motion of its kind: less is round-off, of a coordinate that modes do not move.
IMMOBILE = 1e-9
INDEPENDENT = 1e-6  # singular values of interface coordinates, each scaled to 1


def constraint_modes(omega2: Array, families: Sequence[str], interfaces: Mapping[str, Interface]) -> int:
    """Return how many of n modes are constraint modes (unit motions of interfaces); 0 if interfaces cannot move so.

    For bodies of other programs, whose modes say no more than ω² (n,), rad²/s², families, and how interfaces move.
    """
    free = moving([str(family) for family in families])
    others = [at for name, at in interfaces.items() if name != ROOT]
    rows = np.concatenate([at.motion for at in others]) / np.sqrt(omega2)
    size = np.linalg.norm(rows, axis=1).reshape(-1, 2, 3)
    moved = (size > IMMOBILE * size.max(axis=(0, 2), keepdims=True)).ravel()
    expected = np.tile([k in free for k in range(6)], len(others))
    if not np.array_equal(moved, expected):
        return 0
    values = np.linalg.svd(rows[moved] / size.ravel()[moved, None], compute_uv=False)
    count = int(np.count_nonzero(values > INDEPENDENT * values.max(initial=0.0)))
    return count if count == np.count_nonzero(moved) else 0


def interface_coordinates(
    omega2: Array, families: Sequence[str], static: int, interfaces: Mapping[str, Interface]
) -> InterfaceCoordinates:
    """Interface coordinates from ω² (n,) in rad²/s², families of n modes and the number of `static` shapes.

    Raises `InputError` for interfaces so near to each other that they cannot move by themselves.
    """
    free = moving(families)
    names = [f"{name}/{AXES[k]}" for name in interfaces if name != ROOT for k in free]
    rows = np.concatenate([at.motion[free] for name, at in interfaces.items() if name != ROOT])
    if len(rows) != static:
        raise InputError(
            f"craig-bampton: expected interfaces that can move freely ({', '.join(names)})",
            f"only {static} independent static shapes: interfaces too near to each other, or to the root",
        )
    omega = np.sqrt(omega2)
    size = np.linalg.norm(rows / omega, axis=1)  # √ of the flexibility
    left, values, right = np.linalg.svd(rows / size[:, None] / omega)
    constraint = (right[:static].T / values) @ left.T / size / omega[:, None]
    fixed = np.linalg.qr(right[static:].T / omega[:, None])[0]
    _, turn = np.linalg.eigh(fixed.T @ (omega2[:, None] * fixed))
    return InterfaceCoordinates(names, rows, constraint, fixed @ turn)


def interface_loads(
    omega2: Array, families: Sequence[str], static: int, interfaces: Mapping[str, Interface]
) -> tuple[Array, dict[str, Array]]:
    """W (n, n), rad²/s², and by interface c (6, n), N and N·m per mode: K X = M X W + B c for the n modes X of a link.

    B are unit loads at interfaces. `omega2` (n,) is ω², rad²/s², `static` the number of static shapes.
    """
    # K φ = ω² M φ + B c of fixed-interface modes φ = X N, K ψ = B c of constraint modes: W = N Nᵀ Ω², Xᵀ K X yields c.
    coordinates = interface_coordinates(omega2, families, static, interfaces)
    W = coordinates.fixed @ (coordinates.fixed.T * omega2)
    c = coordinates.constraint.T @ (np.diag(omega2) - W)
    loads: dict[str, Array] = {name: np.zeros((6, len(omega2))) for name in interfaces}
    for name, row in zip(coordinates.names, c, strict=True):
        place, component = name.split("/")
        loads[place][AXES.index(component)] = row
    return W, loads


@struct
class CraigBampton:
    """A link in interface coordinates and fixed-interface modes, for other programs; SI units, the link's frame."""

    coordinates: list[str]  # names of the m coordinates: "root/x" … "root/rz", "tip/y" …, then "mode/1" …
    mass: Array  # (m, m)
    stiffness: Array  # (m, m); zero for rigid motions
    recovery: Array  # (n, m) modal coordinates p of the floating frame, which moves with the root


def craig_bampton(body: ModalBody) -> CraigBampton:
    """Craig–Bampton matrices of a body with interface modes, exactly from its invariants."""
    omega2 = np.diag(body.stiffness)
    static = body.mode_count - body.eigenmode_count
    coordinates = interface_coordinates(omega2, body.family, static, body.interfaces)
    carried = {name: _carried(at.position) for name, at in body.interfaces.items()}
    parts = [name.split("/") for name in coordinates.names]
    rigid = np.array([carried[name][AXES.index(component)] for name, component in parts]).reshape(-1, 6)
    of_root = np.linalg.inv(carried[ROOT])  # a root beside the origin: the frame turns about it
    recovery = np.concatenate(
        [-coordinates.constraint @ rigid @ of_root, coordinates.constraint, coordinates.fixed], axis=1
    )
    frame = np.zeros((6, recovery.shape[1]))
    frame[:, :6] = of_root
    turn = np.einsum("akl,kln->an", LEVI_CIVITA, body.I_bar)  # ∫ρ x × Φ dV
    if body.h_spin is not None:
        turn[0] += body.h_spin  # of a line of mass, about itself
    coupling = np.concatenate([body.S_bar, turn])
    cross = frame.T @ coupling @ recovery
    J = np.trace(body.second_moment) * np.eye(3) - body.second_moment
    J[0, 0] += body.J_spin or 0.0
    of_first = np.einsum("akl,k->al", LEVI_CIVITA, body.first_moment)  # ∫ρ x × e_l dV, (rotation, translation)
    rigid_mass = np.block([[body.mass * np.eye(3), of_first.T], [of_first, J]])
    mass = frame.T @ rigid_mass @ frame + cross + cross.T + recovery.T @ recovery
    names = [f"{ROOT}/{axis}" for axis in AXES] + coordinates.names
    names += [f"mode/{k + 1}" for k in range(coordinates.fixed.shape[1])]
    return CraigBampton(names, mass, recovery.T @ (omega2[:, None] * recovery), recovery)


def _carried(x: Array) -> Array:
    """(6, 6) motion of a point at x (3,), m, under unit translations and rotations of the frame."""
    motion = np.eye(6)
    motion[:3, 3:] = np.einsum("kab,b->ka", LEVI_CIVITA, x)  # θ × x
    return motion
