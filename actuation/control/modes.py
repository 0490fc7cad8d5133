"""Modes of a linear model of the robot: frequencies, damping, shapes, and what can move or see them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array, as_floats
from ...mbs.solve.joint_conditions import free_directions
from ...mbs.solve.robot_modes import RIGID, RobotModes
from ...mbs.solve.robot_modes import robot_modes as modes_of
from .linear_model import LinearModel, Names

OUT_OF_REACH = 1e-7  # of the largest effect that a unit input can have on a mode


def robot_modes(model: LinearModel) -> RobotModes:
    """Poles and shapes of a model, about a frozen configuration."""
    K, D, _, _ = model.second_order
    return modes_of(K, D, np.linalg.inv(np.linalg.cholesky(model.mass)).T, model.transformation)


def locked_frequencies(model: LinearModel) -> Array:
    """Undamped frequencies, Hz, the lowest first, with the shafts of all motors locked: of NᵀK̂ N, BᵀN = 0."""
    K, _, B, _ = model.second_order
    N = free_directions(B[:, [k for k, name in enumerate(model.input_names) if name.startswith("joint/")]].T)
    omega = np.sqrt(np.linalg.eigvalsh(N.T @ (K + K.T) @ N / 2).clip(min=0.0))
    return as_floats(omega[omega > RIGID * omega.max(initial=0.0)] / (2 * np.pi))


@dataclass(frozen=True)
class Reach:
    """How well inputs reach, or outputs see, each mode: (f,) between 0 and 1, and names of the modes out of reach.

    1: a unit of the input that fits best drives nothing but this mode, in the mass metric. Modes of equal frequency are
    judged together, by the worst mixture of them: one input cannot reach two such modes.
    """

    measure: Array
    lost: tuple[str, ...]


def controllability(model: LinearModel, inputs: Names) -> Reach:
    """By mode, from [λ² I + λ D̂ + K̂, b̂] (Popov–Belevitch–Hautus, for second-order equations)."""
    _, _, B, _ = model.second_order
    return _reach(model, B[:, model.inputs(inputs)], left=True)


def observability(model: LinearModel, outputs: Names) -> Reach:
    """By mode, as `controllability` with the outputs' rows."""
    _, _, _, C = model.second_order
    return _reach(model, C[model.outputs(outputs)].T, left=False)


def _reach(model: LinearModel, columns: Array, left: bool) -> Reach:
    K, D, _, _ = model.second_order
    modes, unit = robot_modes(model), np.eye(model.freedom)
    size = np.linalg.norm(columns, axis=0)
    columns = columns[:, size > 0.0] / size[size > 0.0]
    scale = np.abs(modes.poles).max(initial=0.0) ** 2
    measure = np.zeros(model.freedom)
    for k, pole in enumerate(modes.poles[:, 0]):
        P = pole**2 * unit + pole * D + K
        U, values, V = np.linalg.svd(P)
        count = max(1, int(np.count_nonzero(values < RIGID**2 * scale)))
        vectors = U[:, -count:] if left else V[-count:].conj().T
        reached = vectors.conj().T @ columns if left else vectors.T @ columns
        padded = np.zeros((count, max(count, reached.shape[1])), dtype=complex)
        padded[:, : reached.shape[1]] = reached
        measure[k] = np.linalg.svd(padded, compute_uv=False)[-1]
    names = [f"mode {k} ({f:.4g} Hz)" for k, f in enumerate(modes.frequency, 1)]
    lost = tuple(name for name, reached in zip(names, measure, strict=True) if reached < OUT_OF_REACH)
    return Reach(measure, lost)
