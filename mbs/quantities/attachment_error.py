"""Errors of too few eigenmodes, estimated by attachment modes, and of chains of stiffened pieces. SI units.

Pieces end to second order in their modal coordinates p (`model.body`), rods with the same strains where their sections
take them (Simo, Comput. Methods Appl. Mech. Eng. 49, 1985). The difference, carried to the end of the chain, is the
estimate: docs/theory.md, Limits.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.rotations import exponential, left_jacobian, logarithm
from ...fe_models.modal_body import ModalBody
from ..linear.vibration import elastic_shapes
from ..model.body import Body, bent_section
from ..model.known_motion import mass_matrices
from ..model.nodes import Node
from ..model.system import MultibodySystem
from ..run.record import Run
from .motion import X, constraint_rows, node_of, section_motion

ROUND_OFF = 1e-12  # of a link's size
JOLT = 0.01  # of the largest deformation: where more begins to ring at once, modes that are not there would ring, too


class Start(NamedTuple):
    """Start of a run, coordinates divided by `Model.natural_sizes`, no unit.

    M (n_v, n_v), kg·m², C_q (constraints, n_v), no unit, accelerations a (n_v,), 1/s². Of modes alone, else 0:
    `stiffness` (n_v,), J, `damping` (n_v, n_v), J·s, and `late` (n_v,), s², their estimated error per acceleration.
    """

    M: Array
    C_q: Array
    a: Array
    stiffness: Array
    damping: Array
    late: Array
    largest: float  # J, most of Σ pᵀ K p, over bodies, in the run
    duration: float  # s


def mode_error(run: Run) -> float | None:
    """Estimated error of torques, reactions and deflections for too few modes, as a share of their peaks.

    None for rigid robots, or links without attachment modes. Phase errors of vibrations from the start on are in
    `start_errors`.
    """
    # Attachment modes contain the static part of omitted eigenmodes. The dynamic part is about that of a vibration at
    # ω_m between the highest eigenmode kept, ω_k, and the lowest attachment mode above it, ω_a (Rayleigh): ω_m² = ω_k
    # ω_a. So δp = (1/ω_m² − 1/ω²) p̈, limited to the largest p where attachment modes ring at their own ω, as after a
    # jump of the acceleration. The estimate is the largest √(δpᵀ K δp) of a link against the largest √(pᵀ K p).
    ratios = []
    for node in run.model.tree.nodes:
        body, p, p_ddot = node.body, _deformation(run, node), run.a[:, node.p_v]
        if not body.n_modes:
            continue
        if not body.attachment_modes or not body.n_eigenmodes:
            return None
        late = _late(body)
        most = np.abs(p).max(axis=0, initial=0.0)
        wrong = np.sqrt((np.minimum(late * np.abs(p_ddot), most) ** 2 * body.stiffness).sum(axis=1).max(initial=0.0))
        whole = np.sqrt((p**2 * body.stiffness).sum(axis=1).max(initial=0.0))
        ratios.append(float(wrong / whole) if whole else 0.0)
    return max(ratios, default=None)


def _deformation(run: Run, node: Node) -> Array:
    """Modal coordinates (T, n), √kg·m; 0 where they are round-off."""
    p = run.q[:, node.p_q]
    return p * (np.abs(p).max(initial=0.0) > ROUND_OFF * node.body.second_moment.trace() ** 0.5)


def _late(body: Body) -> Array:
    """1/ω_m² − 1/ω² (n,), s², of `mode_error`, where that is above 0."""
    highest, lowest_after = np.sort(body.stiffness)[body.n_eigenmodes - 1 : body.n_eigenmodes + 1]
    return np.maximum(1.0 / np.sqrt(highest * lowest_after) - 1.0 / body.stiffness, 0.0)


def start_errors(start: Start) -> tuple[float, float]:
    """The share of the links' largest deformation that vibrates from the start on, and its phase error.

    Deformation is the root of strain energy. The phase error, a share of the same, is that of too few modes. Vibrations
    are 0 on smooth paths from equilibrium, 0.1 to 1 where links start undeformed under gravity, or a path with a jump
    of its acceleration.
    """
    # Vibration i of shape φ_i and frequency ω_i has the share z̈_i = φ_iᵀ K q̈/ω_i² of the first accelerations q̈. It
    # begins z̈_i/ω_i² away from its center; its amplitude is z̈_i/ω_i in √(2 J). With ω_m of attachment modes
    # (`mode_error`), Rayleigh's quotient lowers ω_i by δω_i/ω_i = ½ Σ_a K_a φ_ia² (1/ω_m² − 1/ω_a²). The phase is off
    # by δω_i T at the end of the run, and matters most when damping δ_i has left 1/e of it: by δω_i/(e δ_i) at most.
    if not start.largest:
        return 0.0, 0.0
    squares, shapes = elastic_shapes(start.M, np.diag(start.stiffness), start.C_q)
    amplitudes = shapes.T @ (start.stiffness * start.a) / squares**1.5
    slower = 0.5 * (start.stiffness * start.late) @ shapes**2
    decay = 0.5 * np.einsum("ki,kl,li->i", shapes, start.damping, shapes)
    time = start.duration / np.maximum(1.0, np.e * decay * start.duration)
    late = amplitudes * np.minimum(2.0, np.sqrt(squares) * slower * time)
    jolt, off = (float(np.sqrt((of**2).sum() / start.largest)) for of in (amplitudes, late))
    return jolt, off


def start_of_motion(run: Run) -> Start:
    """Data of a run for `start_errors`."""
    tree, n_v = run.model.tree, run.model.tree.n_v
    stiffness, late, damping = np.zeros(n_v), np.zeros(n_v), np.zeros((n_v, n_v))
    energy = np.zeros(len(run.time))
    for node in tree.nodes:
        stiffness[node.p_v], damping[node.p_v, node.p_v] = node.body.stiffness, node.body.damping
        energy += _deformation(run, node) ** 2 @ node.body.stiffness
        if node.body.attachment_modes and node.body.n_eigenmodes:
            late[node.p_v] = _late(node.body)
    (M,), sizes = mass_matrices(MultibodySystem(run.model), run.q[:1], float(run.time[0])), run.model.natural_sizes
    both = np.outer(sizes, sizes)
    return Start(
        M=M * both,
        C_q=constraint_rows(run)[1][0] * sizes / run.model.row_sizes[:, None],
        a=run.a[0] / sizes,
        stiffness=stiffness * sizes**2,
        damping=damping * both,
        late=late,
        largest=float(energy.max(initial=0.0)),
        duration=float(run.time[-1] - run.time[0]),
    )


INTERVALS = 16  # of a piece, over each of which curvature is constant but for its share in the direction


def missed_by_pieces(run: Run, pieces: Mapping[str, ModalBody]) -> Array:
    """The position error (T, 3), m, global axes, at the tip of a link in `pieces`, named from the root on."""
    ends = {piece: [section_motion(run, f"{piece}.{end}") for end in ("root", "tip")] for piece in pieces}
    end = [*ends.values()][-1][1].r
    missed = np.zeros_like(end)
    for piece, (root, tip) in ends.items():
        node = node_of(run, piece)
        p = run.q[:, node.p_q]
        A, r = rod_ends(pieces[piece], p @ node.body.modal_transform.T)
        A_known, r_known = ends_in_equations(node.body, p)
        turn = logarithm(A @ np.swapaxes(A_known, -1, -2))
        moved, turned = (np.einsum("tij,tj->ti", root.F, off) for off in (r - r_known, turn))
        missed += moved + np.cross(turned, end - tip.r)
    return missed


def ends_in_equations(body: Body, p: Array) -> tuple[Array, Array]:
    """Axes (T, 3, 3) and place (T, 3), m, of a piece's tip, seen from its root, by its equations.

    At p (T, n), √kg·m.
    """
    root, tip = (bent_section(body, end, p) for end in ("root", "tip"))
    back = np.swapaxes(exponential(root.phi), -1, -2)
    return back @ exponential(tip.phi), np.einsum("tij,tj->ti", back, tip.u - root.u)


def rod_ends(modal: ModalBody, p: Array) -> tuple[Array, Array]:
    """Axes (T, 3, 3) and place (T, 3), m, of the tip, seen from the root, of a rod with the strains of p (T, n).

    p, √kg·m, are coordinates of the modes of the modal body file.
    """
    x = np.linspace(0.0, modal.length, 2 * INTERVALS + 1)  # with the middles of intervals
    places, h = [modal.interpolate(at) for at in x], x[2]
    phi, u = (np.array([p @ getattr(at, kind).T for at in places]) for kind in ("rotation", "translation"))
    A, r = np.tile(np.eye(3), (len(p), 1, 1)), np.zeros((len(p), 3))
    for k in range(0, 2 * INTERVALS, 2):
        turn, mean = phi[k + 2] - phi[k], (phi[k] + 4 * phi[k + 1] + phi[k + 2]) / 6
        strain = u[k + 2] - u[k] - np.cross(mean, h * X)
        uneven = np.cross(mean - phi[k] - turn / 2, h * X)  # of curvature
        step = np.einsum("tij,tj->ti", left_jacobian(turn), h * X + strain) + uneven
        r, A = r + np.einsum("tij,tj->ti", A, step), A @ exponential(turn)
    return A, r
