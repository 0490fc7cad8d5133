"""A robot as x' = A x + B u, y = C x + D u, its modes, and files of such models."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from functools import cached_property
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from ...common.arrays import Array, ComplexArray
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
    """x' = A x + B u (`step` 0) or x(k+1) = A x + B u every `step` s; y = C x + D u; states, inputs, outputs by name.

    Attributes:
        A, B, C, D: (n, n), (n, inputs), (outputs, n), (outputs, inputs), SI units.
        time: instant of the motion about which it is linear, s.
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
        """Time between samples, s; 0 of continuous time."""
        return 0.0

    def inputs(self, names: Names) -> list[int]:
        """Indices of inputs (columns of B) by name. Raises `InputError` for unknown ones."""
        return numbers(names, self.input_names, "linear model: expected an input")

    def outputs(self, names: Names) -> list[int]:
        """Indices of outputs (rows of C) by name. Raises `InputError` for unknown ones."""
        return numbers(names, self.output_names, "linear model: expected an output")

    def arrays(self) -> dict[str, Any]:
        """Arrays, names and `time` of the model, as files contain them."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    def save(self, path: Path) -> None:
        """Write the model to a .npz or .mat file. Raises `InputError` for another suffix."""
        save_arrays(self.arrays(), path)

    def to_control(self, inputs: Names | None = None, outputs: Names | None = None) -> "control.StateSpace":
        """A state-space model of python-control (extra "control"), with ":" instead of "." in names.

        From `inputs` to `outputs` by name, in that order; None: all. A sampled model has `step` as dt. Raises
        `InputError` for unknown names.
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
    """Controllers of a loop with their observer: from readings to commands, off the reference. SI units.

    Readings are those of sensors, behind their filters and delays; commands are those before limits.
    """

    sample_time: float  # s

    @property
    def step(self) -> float:
        """Time between samples, s."""
        return self.sample_time


@struct
class LinearModel(StateSpace):
    """Linear model about a configuration or one instant of a motion: states x = (δs, δṡ), f coordinates s.

    D of accelerations, patches and strains alone is not 0.

    Attributes:
        state_names: "joint/NAME", "modal/BODY/k", … and their rates, "rate of joint/NAME", …
        input_names: "joint/NAME" N·m (or N), "pzt/LAYOUT/k" V, "force/BODY.POINT/x" N; k from 1.
        output_names: "joint/NAME" rad (or m), "point/BODY.POINT/x" m, "modal/BODY/k" m·√kg; of sensors as of `Signal`.
        mass: (f, f) mass matrix of s, SI units: the metric that compares coordinates of different kinds.
        transformation: (coordinates, f) ∂q/∂s from coordinates of the model to those of the robot.
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

    @property
    def motors(self) -> tuple[str, ...]:
        """Names of the inputs that are torques of motors."""
        return tuple(name for name in self.input_names if name.startswith("joint/"))

    @cached_property
    def of_unit_mass(self) -> Array:
        """L⁻ᵀ (f, f), SI, with mass = L Lᵀ: s = L⁻ᵀ z from coordinates z of unit mass."""
        return np.linalg.inv(np.linalg.cholesky(self.mass).T)

    @cached_property
    def second_order(self) -> tuple[Array, Array, Array, Array]:
        """K̂, D̂ (f, f), B̂ (f, inputs) of z̈ + D̂ ż + K̂ z = B̂ u in coordinates z of unit mass, and ∂y/∂z (outputs, f).

        K̂ is in rad²/s², D̂ in 1/s, B̂ and ∂y/∂z in SI units.
        """
        f, L_T, inverse = self.freedom, np.linalg.cholesky(self.mass).T, self.of_unit_mass
        A_K, A_D = L_T @ self.A[f:, :f] @ inverse, L_T @ self.A[f:, f:] @ inverse
        inputs, outputs = L_T @ self.B[f:], self.C[:, :f] @ inverse
        return -A_K, -A_D, inputs, outputs

    def frequency_response(self, omega: Array, inputs: Names, outputs: Names) -> ComplexArray:
        """The frequency response G(iω) (F, outputs, inputs) at `omega` (F,), rad/s; SI units."""
        K, D, B, _ = self.second_order
        s, f = 1j * np.asarray(omega)[:, None, None], self.freedom
        columns, rows = self.inputs(inputs), self.outputs(outputs)
        X = np.linalg.solve(s**2 * np.eye(f) + s * D + K, B[None, :, columns])
        back, C = self.of_unit_mass @ X, self.C[rows]
        return (C[:, :f] + s * C[:, f:]) @ back + self.D[np.ix_(rows, columns)]


def state_space(
    mechanism: LinearMechanism, readings: Mapping[str, Sequence[Any]] = MappingProxyType({})
) -> LinearModel:
    """The state space of a linear mechanism with sensors.

    `readings`: derivatives of outputs by s, ṡ, s̈ (f,) and voltages of patches (k,), SI units, by name of the output.
    """
    f, inputs = len(mechanism.M), mechanism.inputs
    modal = {name: row for name, row in zip(mechanism.names, np.eye(f), strict=True) if name.startswith("modal/")}
    none = np.zeros(f)
    own = {name: (row, none, none, 0.0) for name, row in (*mechanism.outputs.items(), *modal.items())}
    outputs: dict[str, Sequence[Any]] = {**own, **readings}
    columns = np.column_stack([mechanism.K, mechanism.D, *inputs.values()])
    solved = np.linalg.solve(mechanism.M, columns)
    A = np.block([[np.zeros((f, f)), np.eye(f)], [-solved[:, : 2 * f]]])
    B = np.vstack([np.zeros((f, len(inputs))), solved[:, 2 * f :]])
    of_s = np.reshape([of[:3] for of in outputs.values()], (len(outputs), 3, f))
    by_s, by_rate, by_acceleration = of_s.swapaxes(0, 1)
    C, D = np.hstack([by_s, by_rate]) + by_acceleration @ A[f:], by_acceleration @ B[f:]
    volts = [k for k, name in enumerate(inputs) if name.startswith("pzt/")]
    for row, of in zip(D, outputs.values(), strict=True):
        row[volts] += of[3]
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
    """False for names of modal coordinates beyond the lowest `modes` of a link, else true."""
    kind, *rest = name.split("/")
    return kind != "modal" or int(rest[1]) <= modes


def kept_modes(mechanism: LinearMechanism, modes: int) -> LinearMechanism:
    """Truncate a linear mechanism to the lowest `modes` of each link."""
    chosen = [j for j, name in enumerate(mechanism.names) if is_kept(name, modes)]
    block = np.ix_(chosen, chosen)
    return replace(
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


def save_arrays(arrays: Mapping[str, Any], path: Path) -> None:
    """Write arrays, names and numbers to a .npz or .mat file. Raises `InputError` for another suffix."""
    content = BytesIO()
    if path.suffix == ".npz":
        np.savez_compressed(content, **arrays)
    elif path.suffix == ".mat":
        cells = {k: np.array(v, dtype=object) if isinstance(v, tuple) else v for k, v in arrays.items()}
        scipy.io.savemat(content, cells, oned_as="column")
    else:
        raise InputError(f"{path}: expected a file name that ends in .npz or .mat", f'"{path.name}"')
    write_atomically(path, content.getvalue(), "linear model")


def read_arrays(path: Path, names: Sequence[str]) -> list[Array]:
    """Read real matrices, any unit, of a .npz or .mat file by name. Raises `InputError` for a file without them."""
    try:
        held: Mapping[str, Any] = scipy.io.loadmat(path) if path.suffix == ".mat" else np.load(path)
        arrays = [np.atleast_2d(held[name]) for name in names]
        if not all(np.isrealobj(array) and np.isfinite(array).all() for array in arrays):
            raise ValueError("complex or infinite numbers")
        return [array.astype(float) for array in arrays]
    except Exception as error:  # whatever SciPy and NumPy find in a file that is none
        raise InputError(f"{path}: expected a .npz or .mat file with {quoted(names)}, found: {error}") from None


def _some(names: tuple[str, ...]) -> str:
    return ", ".join(names[:SHOWN]) + (", …" if len(names) > SHOWN else "")


def numbers(names: Names, known: Sequence[str], expected: str) -> list[int]:
    """Indices of `names` among `known` ones. Raises `InputError` with the text `expected` for others."""
    wanted = [names] if isinstance(names, str) else names
    for name in wanted:
        if name not in known:
            check_known(name, known, f"{expected} ({quoted(known)})")
    return [known.index(name) for name in wanted]


@kept
def robot_modes(model: LinearModel) -> RobotModes:
    """Poles (1/s) and shapes of a model, about a frozen configuration."""
    K, D, _, _ = model.second_order
    return modes_of(K, D, model.of_unit_mass, model.transformation)


@kept
def locked_frequencies(model: LinearModel) -> Array:
    """Undamped frequencies (k,), Hz, the lowest first, with all motor shafts locked."""
    K, _, B, _ = model.second_order
    N = free_directions(B[:, model.inputs(model.motors)].T)
    omega = np.sqrt(np.linalg.eigvalsh(N.T @ (K + K.T) @ N / 2).clip(min=0.0))
    return omega[omega > RIGID * omega.max(initial=0.0)] / (2 * np.pi)
