"""Small vibrations of an assembly about rest, and along a path, under its constraints; damping wanted of them."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, null_space
from ...common.errors import InputError, quoted
from ..model.gears import friction_damping, gear_matrices, with_prescribed_motors
from ..model.known_motion import State, mass_matrices
from ..model.model import Model
from ..model.system import MultibodySystem
from ..posture.redundancy import resolved
from ..posture.start import relaxed_gears, undeformed_posture

DEPENDENT = 1e-9  # of the largest singular value: below it a row repeats others
RIGID = 1e-9  # of the largest strain of a unit motion, in units of its spring: less is none


class Vibrations(NamedTuple):
    """Vibrations of M q̈ + D q̇ + K q = −C_vᵀλ, C_v q̇ = 0 about rest, without rigid motion. SI units.

    frequency ω (n,) rad/s ascending; damping_ratio (n,), no unit; shape (n_v, n), M-orthonormal; springs K (n_v, n_v).
    """

    frequency: Array
    damping_ratio: Array
    shape: Array
    springs: Array


def vibrations_of(system: MultibodySystem, t: float, q: Array) -> Vibrations:
    """Vibrations about q (n_q,), rad and m, under the constraint equations at time t, s.

    K are the stiffnesses of links and gears, D their damping and viscous friction; neither gravity nor dry friction.
    """
    model, sizes = system.model, system.model.natural_sizes
    both = np.outer(sizes, sizes)
    M = mass_matrices(system, q[None], t)[0] * both
    (C_v,) = model.constraints.natural_gradients(q[None], np.array([t]), sizes)
    K, D = gear_matrices(model.tree, q)
    D += friction_damping(model, q)
    for node in model.tree.nodes:
        K[node.p_v, node.p_v] = np.diag(node.body.stiffness)
        D[node.p_v, node.p_v] += node.body.damping
    squares, shape = elastic_shapes((M + M.T) / 2, K * both, C_v)
    omega, shape = np.sqrt(squares), sizes[:, None] * shape
    ratio = np.einsum("in,ij,jn->n", shape, D, shape) / (2 * omega)
    return Vibrations(omega, ratio, shape, K)


def elastic_shapes(M: Array, K: Array, C_v: Array) -> tuple[Array, Array]:
    """ω² (n,), 1/s², and M-orthonormal shapes (n_v, n) that strain springs while C_v q̇ = 0; units: those of M, K."""
    free = null_space(C_v, DEPENDENT)
    L_inverse = np.linalg.inv(np.linalg.cholesky(free.T @ M @ free))
    squares, vectors = np.linalg.eigh(L_inverse @ free.T @ K @ free @ L_inverse.T)
    # Motions that strain springs, each of which counts by its own size: a soft link beside a stiff one vibrates, too
    own = np.sqrt(K.diagonal())
    unit = np.divide(1.0, own, out=np.zeros_like(own), where=own > 0.0)
    strains = np.linalg.svd((unit[:, None] * K * unit) @ free, compute_uv=False)
    strained = np.count_nonzero(strains > RIGID * strains.max(initial=0.0))
    stiff = slice(len(squares) - int(strained), None)
    return squares[stiff], free @ L_inverse.T @ vectors[:, stiff]


INSTANTS = 9


def frequencies_along(model: Model, begin: float, end: float, modes: int) -> tuple[Array, Array]:
    """The `modes` lowest vibrations of the undeformed robot on its trajectories, from `begin` to `end`, s.

    Frequencies, Hz, and damping ratios, (instants, modes) each. Where motors follow the trajectories, compliant gears
    are among the springs. Joints that the paths leave free are free. Raises `InputError` where the path is out of
    reach, or there are fewer vibrations.
    """
    model = with_prescribed_motors(resolved(model, end))
    state, system, spectra = undeformed_posture(model), MultibodySystem(model), []
    for t in np.linspace(begin, end, INSTANTS):
        q = model.constraints.posture(state.q, float(t))
        if q is None:
            raise InputError(
                f"{model.scene.path}: trajectory: expected paths within reach",
                f"no posture of the undeformed robot at t = {t:.6g} s that meets"
                f" {quoted(dict.fromkeys(row.owner for row in model.rows))}",
            )
        state = relaxed_gears(model, State(q, np.zeros_like(state.v)))
        omega, ratio, *_ = vibrations_of(system, float(t), state.q)
        spectra.append((omega[ratio < 1.0], ratio[ratio < 1.0]))  # what is damped more does not vibrate
    most = min(len(omega) for omega, _ in spectra)
    if most < modes:
        raise InputError(
            f"{model.scene.path}: trajectory: shaper.modes: expected at most {most}, the number of vibrations on the"
            " constrained path",
            modes,
        )
    omegas, ratios = np.array([(omega[:modes], ratio[:modes]) for omega, ratio in spectra]).swapaxes(0, 1)
    return omegas / (2 * np.pi), ratios


def with_robot_damping(model: Model, ratios: Mapping[str, float]) -> Model:
    """The robot with damping of bodies in `ratios`: if all are equal, vibrations of the robot have this damping ratio.

    At the initial posture, motors free, gears rigid; docs/theory.md, Damping. Other bodies keep their damping.
    """
    if not ratios:
        return model
    start, tree = undeformed_posture(model), model.tree
    modes = vibrations_of(MultibodySystem(model.without_paths()), 0.0, start.q)
    # D (modes of all bodies)² with ΦᵀDΦ = diag(2ω), ζ = 1, of which each body has its block on the diagonal; rigid
    # motion is free of it, and so is motion of p that the joints do not allow
    inverse, bodies = np.linalg.pinv(modes.shape[~tree.joint_columns]), [node.body for node in tree.nodes]
    unit = inverse.T @ (2 * modes.frequency[:, None] * inverse)
    ends = np.cumsum([0, *(body.n_modes for body in bodies)])
    damped = (
        replace(body, damping=ratios[body.name] * unit[first:last, first:last]) if body.name in ratios else body
        for body, (first, last) in zip(bodies, pairwise(ends), strict=True)
    )
    return replace(model, tree=tree.with_bodies(tuple(damped)))
