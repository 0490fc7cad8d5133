"""Which modes of a robot its inputs and outputs reach."""

from collections.abc import Sequence

import numpy as np

from ...common.arrays import Array, ComplexArray
from ...common.structs import kept, struct
from ...mbs.linear.joint_conditions import RIGID
from .linear_model import LinearModel, Names, robot_modes

STILL = 1e-10  # of the largest effect on its kind of output: less is round-off
OUT_OF_REACH = 1e-7  # of the largest effect that a unit input can have on a mode


@struct
class Reachability:
    """Controllability or observability of each mode (f,), no unit, from 0 to 1, and names of the modes out of reach.

    1: a unit of the input that fits best drives nothing but this mode, in the mass metric. Modes of equal frequency are
    judged together, by the worst mixture of them: one input cannot reach two such modes.
    """

    measure: Array
    lost: tuple[str, ...]


def controllability(model: LinearModel, inputs: Names) -> Reachability:
    """Controllability by mode, by the Popov–Belevitch–Hautus test of second-order equations."""
    _, _, B, _ = model.second_order
    return _reach(model, _scaled(B, model.input_names)[:, model.inputs(inputs)], left=True)


def observability(model: LinearModel, outputs: Names) -> Reachability:
    """Observability by mode, by the Popov–Belevitch–Hautus test of second-order equations."""
    C = np.vstack([model.of_unit_mass.T @ part.T for part in np.split(model.C, 2, axis=1)])
    return _reach(model, _scaled(C, model.output_names)[:, model.outputs(outputs)], left=False)


def _scaled(columns: Array, names: Sequence[str]) -> Array:
    """Columns (f, names) over their size, of a point over that of all its directions; none that are round-off."""
    if not columns.size:  # a robot that cannot move
        return columns
    groups = [name.rpartition("/")[0] if name.startswith(("point/", "force/")) else name for name in names]
    found, largest = np.zeros_like(columns), dict[str, float]()
    sizes = {of: float(np.linalg.norm(columns[:, [of == other for other in groups]], 2)) for of in groups}
    for of, size in sizes.items():
        kind = of.partition("/")[0]
        largest[kind] = max(largest.get(kind, 0.0), size)
    for k, of in enumerate(groups):
        if sizes[of] > STILL * largest[of.partition("/")[0]]:
            found[:, k] = columns[:, k] / sizes[of]
    return found


@kept
def _null_vectors(model: LinearModel) -> list[tuple[ComplexArray, ComplexArray]]:
    """Left and right vectors (f, count) at which λ² I + λ D̂ + K̂ is 0, λ the first pole of each mode."""
    K, D, _, _ = model.second_order
    poles, unit, found = robot_modes(model).poles, np.eye(model.freedom), []
    scale = np.abs(poles).max(initial=0.0) ** 2
    for pole in poles[:, 0]:
        U, values, V = np.linalg.svd(pole**2 * unit + pole * D + K)
        count = max(1, int(np.count_nonzero(values < RIGID**2 * scale)))
        found.append((U[:, -count:].copy(), V[-count:].conj().T))
    return found


def _reach(model: LinearModel, columns: Array, left: bool) -> Reachability:
    modes, measure = robot_modes(model), np.zeros(model.freedom)
    for k, (of_left, of_right) in enumerate(_null_vectors(model)):
        by_rate = modes.poles[k, 0] * columns[model.freedom :] if len(columns) > model.freedom else 0.0
        reached = of_left.conj().T @ columns if left else of_right.T @ (columns[: model.freedom] + by_rate)
        padded = np.zeros((len(reached), max(reached.shape)), dtype=complex)
        padded[:, : reached.shape[1]] = reached
        measure[k] = np.linalg.svd(padded, compute_uv=False)[-1]
    names = [f"mode {k} ({f:.4g} Hz)" for k, f in enumerate(modes.frequency, 1)]
    lost = tuple(name for name, reached in zip(names, measure, strict=True) if reached < OUT_OF_REACH)
    return Reachability(measure, lost)
