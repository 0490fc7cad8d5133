"""A robot as x' = A x + B u, y = C x + D u, its modes, and which of them inputs and outputs reach."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from functools import cached_property
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from ...common.arrays import Array, ComplexArray, as_floats
from ...common.errors import InputError, check_known, quoted
from ...common.files import write_atomically
from ...common.libraries import extras, scipy
from ...common.structs import kept, struct
from ...mbs.linear.joint_conditions import RIGID, RobotModes, free_directions
from ...mbs.linear.joint_conditions import robot_modes as modes_of
from ...mbs.linear.linearisation import LinearMechanism

if TYPE_CHECKING:
    import control

Names = str | Sequence[str]
SHOWN = 4  # names in the line that a model prints


@struct
class StateSpace:
    """x' = A x + B u, or x(k+1) = A x + B u every `step` s; y = C x + D u, with names of states, inputs and outputs.

    Attributes:
        A, B, C, D: (n, n), (n, inputs), (outputs, n), (outputs, inputs).
        time: s, of the motion, about which it is linear.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    state_names: tuple[str, ...]
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    time: float

    @property
    def step(self) -> float:
        """Between samples, s; 0 of continuous time."""
        return 0.0

    def inputs(self, names: Names) -> list[int]:
        """Indices of inputs (columns of B) by name. Raises `InputError` for unknown ones."""
        return _numbers("input", names, self.input_names)

    def outputs(self, names: Names) -> list[int]:
        """Indices of outputs (rows of C) by name. Raises `InputError` for unknown ones."""
        return _numbers("output", names, self.output_names)

    def arrays(self) -> dict[str, Any]:
        """Arrays and names of the model, as files contain them."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    def save(self, path: Path) -> None:
        """Write the model to a .npz or .mat file. Raises `InputError` for another suffix."""
        save_arrays(self.arrays(), path)

    def to_control(self, inputs: Names | None = None, outputs: Names | None = None) -> control.StateSpace:
        """State-space model of python-control (extra "control"), with ":" instead of "." in names.

        Of samples it has their `step` as dt.

        From `inputs` to `outputs` by their names here, in that order; all where they are not given. Raises `InputError`
        for unknown ones.
        """
        with extras():
            import control

        columns = self.inputs(self.input_names if inputs is None else inputs)
        rows = self.outputs(self.output_names if outputs is None else outputs)
        names = {
            "states": self.state_names,
            "inputs": [self.input_names[k] for k in columns],
            "outputs": [self.output_names[k] for k in rows],
        }
        allowed = {kind: [name.replace(".", ":") for name in given] for kind, given in names.items()}
        matrices = self.A, self.B[:, columns], self.C[rows], self.D[np.ix_(rows, columns)]
        return control.ss(*matrices, self.step, **allowed)


@struct
class SampledController(StateSpace):
    """Controllers of a loop, with their observer: from readings to commands, off the reference.

    Readings are those of sensors, behind their filters and delays; commands are those before limits.
    """

    sample_time: float  # s

    @property
    def step(self) -> float:
        """Between samples, s."""
        return self.sample_time


@struct
class LinearModel(StateSpace):
    """Linear model about a configuration or one instant of a motion: states x = (δs, δṡ), f coordinates s.

    D of accelerations alone is not 0.

    Attributes:
        state_names: "joint/NAME", "modal/BODY/k", … and their rates, "rate of joint/NAME", …
        input_names: "joint/NAME" N·m (or N), "pzt/BODY/k" V, "force/BODY.POINT/x" N; k from 1.
        output_names: "joint/NAME" rad (or m), "point/BODY.POINT/x" m, "modal/BODY/k"; of sensors as of `Signal`.
        mass: (f, f) mass matrix of s: the metric that compares coordinates of different kinds.
        transformation: (coordinates, f) ∂q/∂s, which takes mode shapes to the robot.
    """

    mass: Array
    transformation: Array

    def __repr__(self) -> str:
        inputs, outputs = len(self.input_names), len(self.output_names)
        return (
            f"LinearModel at t = {self.time:g} s: {self.freedom} degrees of freedom, {len(self.A)} states,"
            f" {inputs} input{'s' * (inputs != 1)} ({_some(self.input_names)}),"
            f" {outputs} output{'s' * (outputs != 1)} ({_some(self.output_names)})"
        )

    @property
    def freedom(self) -> int:
        """Number f of independent coordinates."""
        return len(self.mass)

    @cached_property
    def second_order(self) -> tuple[Array, Array, Array, Array]:
        """K̂, D̂ (f, f), inputs (f, …) and outputs (…, f) for unit mass: s = L⁻ᵀ z, mass = L Lᵀ."""
        f, L = self.freedom, np.linalg.cholesky(self.mass)
        L_T, inverse = L.T, np.linalg.inv(L.T)
        A_K, A_D = L_T @ self.A[f:, :f] @ inverse, L_T @ self.A[f:, f:] @ inverse
        inputs, outputs = L_T @ self.B[f:], self.C[:, :f] @ inverse
        return -1.0 * A_K, -1.0 * A_D, inputs, outputs

    def frequency_response(self, omega: Array, inputs: Names, outputs: Names) -> ComplexArray:
        """Frequency response G(iω) (len(omega), outputs, inputs) at ω, rad/s."""
        K, D, B, _ = self.second_order
        s, f = 1j * np.asarray(omega)[:, None, None], self.freedom
        columns, rows = self.inputs(inputs), self.outputs(outputs)
        X = np.linalg.solve(s**2 * np.eye(f) + s * D + K, B[None, :, columns])
        back = np.linalg.inv(np.linalg.cholesky(self.mass).T) @ X
        C = self.C[rows]
        return np.asarray((C[:, :f] + s * C[:, f:]) @ back + self.D[np.ix_(rows, columns)], dtype=complex)


def state_space(
    mechanism: LinearMechanism,
    voltages: Mapping[str, Array],
    readings: Mapping[str, tuple[Array, Array, Array]] = MappingProxyType({}),
) -> LinearModel:
    """Return the state space of a linear mechanism; `voltages` by name: generalized forces (f,) of 1 V along s.

    `readings`: changes (f,) of each sensor's by s, ṡ and s̈, which are outputs too.
    """
    f = len(mechanism.M)
    motors = {name: column for name, column in mechanism.inputs.items() if name.startswith("joint/")}
    forces = {name: column for name, column in mechanism.inputs.items() if name not in motors}
    inputs = {**motors, **voltages, **forces}
    modal = {name: row for name, row in zip(mechanism.names, np.eye(f), strict=True) if name.startswith("modal/")}
    none = np.zeros(f)
    outputs = {name: (row, none, none) for name, row in (*mechanism.outputs.items(), *modal.items())} | dict(readings)
    columns = np.column_stack([mechanism.K, mechanism.D, *inputs.values()])
    solved = np.linalg.solve(mechanism.M, columns)
    A = np.block([[np.zeros((f, f)), np.eye(f)], [-solved[:, : 2 * f]]])
    B = np.vstack([np.zeros((f, len(inputs))), solved[:, 2 * f :]])
    by_s, by_rate, by_acceleration = np.reshape(list(outputs.values()), (len(outputs), 3, f)).swapaxes(0, 1)
    C, D = np.hstack([by_s, by_rate]) + by_acceleration @ A[f:], by_acceleration @ B[f:]
    names = (*mechanism.names, *(f"rate of {name}" for name in mechanism.names))
    return LinearModel(
        A=A,
        B=B,
        C=C,
        D=D,
        state_names=names,
        input_names=tuple(inputs),
        output_names=tuple(outputs),
        time=mechanism.time,
        mass=mechanism.M,
        transformation=mechanism.transformation,
    )


def is_kept(name: str, modes: int) -> bool:
    """Whether a coordinate or reading is none of a mode above the lowest `modes` of its link."""
    kind, *rest = name.split("/")
    return kind != "modal" or int(rest[1]) <= modes


def kept_modes(
    mechanism: LinearMechanism, voltages: Mapping[str, Array], modes: int
) -> tuple[LinearMechanism, Mapping[str, Array]]:
    """Truncate a linear mechanism to the lowest `modes` of each link; `voltages` as in `state_space`."""
    chosen = [j for j, name in enumerate(mechanism.names) if is_kept(name, modes)]
    block = np.ix_(chosen, chosen)
    kept = replace(
        mechanism,
        M=mechanism.M[block],
        D=mechanism.D[block],
        K=mechanism.K[block],
        inputs={name: column[chosen] for name, column in mechanism.inputs.items()},
        outputs={name: row[chosen] for name, row in mechanism.outputs.items()},
        transformation=mechanism.transformation[:, chosen],
        transformation_rate=mechanism.transformation_rate[:, chosen],
        force=mechanism.force[chosen],
        points={name: rows[:, chosen] for name, rows in mechanism.points.items()},
        names=tuple(mechanism.names[i] for i in chosen),
    )
    return kept, {name: column[chosen] for name, column in voltages.items()}


def save_arrays(arrays: Mapping[str, Any], path: Path) -> None:
    """Write arrays, names and numbers to a .npz or .mat file. Raises `InputError` for another suffix."""
    content = BytesIO()
    if path.suffix == ".npz":
        converted: dict[str, Any] = {key: np.asarray(value) for key, value in arrays.items()}
        np.savez_compressed(content, **converted)
    elif path.suffix == ".mat":
        cells = {k: np.array(v, dtype=object) if isinstance(v, tuple) else v for k, v in arrays.items()}
        scipy.io.savemat(content, cells, oned_as="column")
    else:
        raise InputError(f"{path}: expected a file name that ends in .npz or .mat", f'"{path.name}"')
    write_atomically(path, content.getvalue(), "linear model")


def read_arrays(path: Path, names: Sequence[str]) -> list[Array]:
    """Matrices of a .npz or .mat file. Raises `InputError` where it cannot be read or lacks one."""
    try:
        if path.suffix == ".mat":
            held: Mapping[str, Any] = scipy.io.loadmat(path)
        else:
            held = np.load(path)
        return [as_floats(np.atleast_2d(np.asarray(held[name], dtype=float))) for name in names]
    except (OSError, ValueError, KeyError, NotImplementedError) as error:
        raise InputError(f"{path}: expected a .npz or .mat file with {quoted(names)}, found: {error}") from None


def _some(names: tuple[str, ...]) -> str:
    return ", ".join(names[:SHOWN]) + (", …" if len(names) > SHOWN else "")


def _numbers(kind: str, names: Names, known: tuple[str, ...]) -> list[int]:
    places = {name: k for k, name in enumerate(known)}
    wanted = [names] if isinstance(names, str) else list(names)
    for name in wanted:
        if name not in places:
            check_known(name, known, f"linear model: expected an {kind} ({quoted(known)})")
    return [places[name] for name in wanted]


STILL = 1e-10  # of the largest effect on its kind of output: less is round-off
OUT_OF_REACH = 1e-7  # of the largest effect that a unit input can have on a mode


@kept
def robot_modes(model: LinearModel) -> RobotModes:
    """Poles and shapes of a model, about a frozen configuration."""
    K, D, _, _ = model.second_order
    return modes_of(K, D, np.linalg.inv(np.linalg.cholesky(model.mass)).T, model.transformation)


@kept
def locked_frequencies(model: LinearModel) -> Array:
    """Undamped frequencies, Hz, the lowest first, with the shafts of all motors locked: of NᵀK̂ N, BᵀN = 0."""
    K, _, B, _ = model.second_order
    N = free_directions(B[:, [k for k, name in enumerate(model.input_names) if name.startswith("joint/")]].T)
    omega = np.sqrt(np.linalg.eigvalsh(N.T @ (K + K.T) @ N / 2).clip(min=0.0))
    return as_floats(omega[omega > RIGID * omega.max(initial=0.0)] / (2 * np.pi))


@struct
class Reachability:
    """Controllability or observability of each mode (f,), from 0 to 1, and names of the modes out of reach.

    1: a unit of the input that fits best drives nothing but this mode, in the mass metric. Modes of equal frequency are
    judged together, by the worst mixture of them: one input cannot reach two such modes.
    """

    measure: Array
    lost: tuple[str, ...]


def controllability(model: LinearModel, inputs: Names) -> Reachability:
    """Return controllability by mode, from [λ² I + λ D̂ + K̂, b̂] (Popov–Belevitch–Hautus, second-order equations)."""
    _, _, B, _ = model.second_order
    return _reach(model, _scaled(B, model.input_names)[:, model.inputs(inputs)], left=True)


def observability(model: LinearModel, outputs: Names) -> Reachability:
    """Return observability by mode, as `controllability` with the rows of outputs, those of rates times λ."""
    f = model.freedom
    inverse = np.linalg.inv(np.linalg.cholesky(model.mass).T)
    C = np.vstack([inverse.T @ model.C[:, :f].T, inverse.T @ model.C[:, f:].T])
    return _reach(model, _scaled(C, model.output_names)[:, model.outputs(outputs)], left=False)


def _scaled(columns: Array, names: Sequence[str]) -> Array:
    """Columns (f, names) over their size, of a point over that of all its directions: axes do not matter.

    None of what is still to round-off next to the largest of its kind.
    """
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
