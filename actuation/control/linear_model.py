"""A robot as x' = A x + B u, y = C x + D u: its modes, what inputs and outputs reach, zeros, and the sampled model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, replace
from functools import cached_property
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from ...common.arrays import Array, ComplexArray, Indices, NDArray
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
        return _numbers("input", names, self.input_names)

    def outputs(self, names: Names) -> list[int]:
        """Indices of outputs (rows of C) by name. Raises `InputError` for unknown ones."""
        return _numbers("output", names, self.output_names)

    def arrays(self) -> dict[str, Any]:
        """Return arrays, names and `time` of the model, as files contain them."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    def save(self, path: Path) -> None:
        """Write the model to a .npz or .mat file. Raises `InputError` for another suffix."""
        save_arrays(self.arrays(), path)

    def to_control(self, inputs: Names | None = None, outputs: Names | None = None) -> control.StateSpace:
        """Return a state-space model of python-control (extra "control"), with ":" instead of "." in names.

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

    D of accelerations alone is not 0.

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
        return -1.0 * A_K, -1.0 * A_D, inputs, outputs

    def frequency_response(self, omega: Array, inputs: Names, outputs: Names) -> ComplexArray:
        """Return the frequency response G(iω) (F, outputs, inputs) at `omega` (F,), rad/s; SI units."""
        K, D, B, _ = self.second_order
        s, f = 1j * np.asarray(omega)[:, None, None], self.freedom
        columns, rows = self.inputs(inputs), self.outputs(outputs)
        X = np.linalg.solve(s**2 * np.eye(f) + s * D + K, B[None, :, columns])
        back, C = self.of_unit_mass @ X, self.C[rows]
        return np.asarray((C[:, :f] + s * C[:, f:]) @ back + self.D[np.ix_(rows, columns)], dtype=complex)


def state_space(
    mechanism: LinearMechanism, readings: Mapping[str, tuple[Array, Array, Array]] = MappingProxyType({})
) -> LinearModel:
    """Return the state space of a linear mechanism with sensors.

    `readings` are derivatives (f,) of outputs by coordinates s, ṡ and s̈, in SI units, by name of the output.
    """
    f, inputs = len(mechanism.M), mechanism.inputs
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
    """Return false for names of modal coordinates beyond the lowest `modes` of a link, else true."""
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
        converted: dict[str, Any] = {key: np.asarray(value) for key, value in arrays.items()}
        np.savez_compressed(content, **converted)
    elif path.suffix == ".mat":
        cells = {k: np.array(v, dtype=object) if isinstance(v, tuple) else v for k, v in arrays.items()}
        scipy.io.savemat(content, cells, oned_as="column")
    else:
        raise InputError(f"{path}: expected a file name that ends in .npz or .mat", f'"{path.name}"')
    write_atomically(path, content.getvalue(), "linear model")


def read_arrays(path: Path, names: Sequence[str]) -> list[Array]:
    """Read matrices, any unit, of a .npz or .mat file by name. Raises `InputError` if it is unreadable or lacks one."""
    try:
        if path.suffix == ".mat":
            held: Mapping[str, Any] = scipy.io.loadmat(path)
        else:
            held = np.load(path)
        return [np.atleast_2d(np.asarray(held[name], dtype=float)) for name in names]
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
    """Return poles (1/s) and shapes of a model, about a frozen configuration."""
    K, D, _, _ = model.second_order
    return modes_of(K, D, model.of_unit_mass, model.transformation)


@kept
def locked_frequencies(model: LinearModel) -> Array:
    """Return undamped frequencies (k,), Hz, the lowest first, with all motor shafts locked."""
    K, _, B, _ = model.second_order
    N = free_directions(B[:, model.inputs(model.motors)].T)
    omega = np.sqrt(np.linalg.eigvalsh(N.T @ (K + K.T) @ N / 2).clip(min=0.0))
    return omega[omega > RIGID * omega.max(initial=0.0)] / (2 * np.pi)


@struct
class Reachability:
    """Controllability or observability of each mode (f,), from 0 to 1, and names of the modes out of reach.

    1: a unit of the input that fits best drives nothing but this mode, in the mass metric. Modes of equal frequency are
    judged together, by the worst mixture of them: one input cannot reach two such modes.
    """

    measure: Array
    lost: tuple[str, ...]


def controllability(model: LinearModel, inputs: Names) -> Reachability:
    """Return controllability by mode, by the Popov–Belevitch–Hautus test of second-order equations."""
    _, _, B, _ = model.second_order
    return _reach(model, _scaled(B, model.input_names)[:, model.inputs(inputs)], left=True)


def observability(model: LinearModel, outputs: Names) -> Reachability:
    """Return observability by mode, by the Popov–Belevitch–Hautus test of second-order equations."""
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


INFINITE = 1e3  # times the largest pole: zeros beyond are of modes that the model lacks
MARGIN = 1e-6  # of a zero's size (and MARGIN of the largest pole, for those near 0): real parts below are round-off
ROUND_OFF = 1e-13  # of a pencil, relative: what its entries and QZ leave of double precision
RESOLVED = 1e-3  # relative error of zeros by round-off: with more they count as infinite


@struct
class Zeros:
    """The finite zeros (k,), 1/s, from inputs to outputs: left of the imaginary axis, on it, then right; each by size.

    `unstable`: those with positive real part. Without any the transfer is minimum phase (undamped ones on the imaginary
    axis are allowed).
    """

    values: ComplexArray
    unstable: ComplexArray

    @property
    def minimum_phase(self) -> bool:
        """Whether there is no zero with positive real part."""
        return not self.unstable.size

    def describe(self) -> str:
        """Return number and slowest unstable zero as text."""
        if self.minimum_phase:
            return "minimum phase"
        slowest = self.unstable[np.abs(self.unstable).argmin()]
        number = f"{slowest.real:.4g}" + (f" ± {abs(slowest.imag):.4g}i" if abs(slowest.imag) > 0 else "")
        return f"non-minimum phase: {len(self.unstable)} zeros in the right half plane, the slowest {number} rad/s"


def zeros(model: LinearModel, inputs: Names, outputs: Names) -> Zeros:
    """Return the zeros from as many inputs as outputs, by name (transmission zeros where more than one).

    A transfer that is 0, or singular everywhere, has none. Raises `InputError` unless both have the same number.
    """
    K, D, B, C = model.second_order
    b, c = B[:, model.inputs(inputs)], C[model.outputs(outputs)]
    if b.shape[1] != len(c):
        raise InputError("zeros: expected as many inputs as outputs", f"{b.shape[1]} and {len(c)}")
    scale = 1.0  # rad/s: the highest frequency of z̈ + D̂ ż + K̂ z = 0, or the size of its coefficients
    if len(K):
        scale = float(np.sqrt(np.abs(np.linalg.eigvals(K)).max()))
        size = max(float(np.sqrt(np.linalg.norm(K, 2))), float(np.linalg.norm(D, 2)))
        scale = scale if scale > RIGID * size else size or 1.0
    s = scale * (0.1 + 0.1j)  # any that is no pole
    passed = c @ np.linalg.solve(s**2 * np.eye(len(K)) + s * D + K, b)
    weakest = np.linalg.svd(passed, compute_uv=False).min(initial=np.inf)
    kinds = {model.output_names[k].partition("/")[0] for k in model.outputs(outputs)}
    peers = [k for k, name in enumerate(model.output_names) if name.partition("/")[0] in kinds]
    if weakest * np.abs(s) ** 2 <= STILL * np.linalg.norm(C[peers], axis=1).max(initial=0.0) * np.linalg.norm(b):
        return Zeros(np.zeros(0, dtype=complex), np.zeros(0, dtype=complex))
    # While C z = 0 the inputs act as constraint forces: zeros are eigenvalues of N_Bᵀ (λ² I + λ D̂ + K̂) N
    N, N_B = free_directions(c), free_directions(b.T)
    mass, damping, stiffness = N_B.T @ N, N_B.T @ D @ N / scale, N_B.T @ K @ N / scale**2
    values, errors = _eigenvalues(mass, damping, stiffness)
    margins = np.maximum(MARGIN * np.maximum(np.abs(values), 1.0), errors)
    side = np.where(np.abs(values.real) > margins, np.sign(values.real), 0.0)
    order = by_side(values, side)
    return Zeros(scale * values[order], scale * values[order][side[order] > 0])


def by_side(values: ComplexArray, side: Array) -> NDArray[np.int_]:
    """Return the order (k,) of `values` (k,), any unit, by `side` of the imaginary axis (±1, 0), size, imaginary part.

    Sizes within `MARGIN` of each other count as one: those of conjugates, and of ± s, differ by round-off alone.
    """
    size = np.abs(values)
    order = np.lexsort((size, side))
    apart = np.diff(size[order]) > MARGIN * np.maximum(size[order][1:], 1.0)
    group = np.zeros(len(values))
    group[order[1:]] = np.cumsum(apart | (np.diff(side[order]) > 0))
    return np.lexsort((values.imag, group))


def _eigenvalues(M: Array, D: Array, K: Array) -> tuple[ComplexArray, Array]:
    """The finite λ of λ² M + λ D + K, and their errors by round-off; M may be singular."""
    n, unit = len(M), np.eye(len(M))
    if not n:
        return np.zeros(0, dtype=complex), np.zeros(0)
    if not np.any(D):
        squares, errors = _finite(-K, M, INFINITE**2)
        roots = np.sqrt(squares)
        errors /= np.maximum(np.abs(roots), np.sqrt(errors))
        return np.concatenate([roots, -roots]), np.tile(errors, 2)
    A = np.block([[np.zeros((n, n)), unit], [-K, -D]])
    E = np.block([[unit, np.zeros((n, n))], [np.zeros((n, n)), M]])
    return _finite(A, E, INFINITE)


def _finite(A: Array, E: Array, largest: float) -> tuple[ComplexArray, Array]:
    """Eigenvalues of A − λ E that round-off tells from infinity, and their errors: chordal ones, times 1 + |λ|².

    Those below 1 are far from infinity, though errors of double ones (a free body's, at 0) are estimated without bound.
    See G. W. Stewart and J. Sun, Matrix Perturbation Theory, 1990, VI.2.
    """
    (alpha, beta), left, right = scipy.linalg.eig(A, E, left=True, homogeneous_eigvals=True)
    finite = np.abs(alpha) < largest * np.abs(beta)
    values, left, right = alpha[finite] / beta[finite], left[:, finite].conj(), right[:, finite]
    of_A, of_E = (np.abs((left * (X @ right)).sum(axis=0)) for X in (A, E))
    chordal = ROUND_OFF * np.hypot(np.linalg.norm(A), np.linalg.norm(E)) / np.maximum(np.hypot(of_A, of_E), 1e-300)
    size = np.hypot(1.0, np.abs(values))
    resolved = (chordal * size < RESOLVED) | (np.abs(values) < 1.0)
    return values[resolved].astype(complex), (chordal * size**2)[resolved]


@struct
class SampledModel:
    """x(k+1) = A x(k) + B u(k) of a model with inputs that are constant between samples and act after a delay.

    SI units. Commands that wait for their delay are states after those of the model, oldest first.
    """

    A: Array  # (states, states)
    B: Array  # (states, inputs)
    last: Indices  # (inputs,) indices of states that are the commands in effect just before the sample


def sampled(A: Array, B: Array, T: float, delay: float | Array, *, with_last: bool = False) -> SampledModel:
    """Return the exact discrete model of x' = A x + B u, A (n, n), B (n, m), for samples every T (s).

    See Åström and Wittenmark, Computer-Controlled Systems, sec. 2.3. `delay` (s) is that of all inputs, or (m,) of
    each. `with_last`: the last command, which acts until the sample, is a state also without delay. SI units.
    """
    n, m = B.shape
    late, fraction = np.divmod(np.broadcast_to(delay, m), T)
    is_whole = fraction <= 1e-9 * T
    ages = np.maximum(late + ~is_whole, int(with_last)).astype(int)  # of the command that acts until the sample
    waiting = int(ages.max(initial=0))
    Phi, Gamma = zero_order_hold(A, B, T)
    early = Gamma.copy()
    for part in np.unique(fraction[~is_whole]):
        early[:, fraction == part] = zero_order_hold(A, B[:, fraction == part], T - float(part))[1]
    columns = np.zeros((n + waiting * m, n + (waiting + 1) * m))  # of states, commands on their way, and the new one
    columns[:n, :n] = Phi
    columns[n:, n + m :] = np.eye(waiting * m)
    places = n + m * (waiting - late.astype(int)) + np.arange(m)
    columns[:n, places] = early
    columns[:n, (places - m)[~is_whole]] = (Gamma - early)[:, ~is_whole]  # the older one acts first in the interval
    last = n + m * (waiting - ages) + np.arange(m)
    return SampledModel(columns[:, : n + waiting * m], columns[:, n + waiting * m :], last)


def zero_order_hold(A: Array, B: Array, T: float) -> tuple[Array, Array]:
    """Return e^{A T} (n, n) and ∫ e^{A s} ds B (n, m) over T (s) of A (n, n), B (n, m), in any units of states."""
    n, m = B.shape
    size = np.ones((n, 1))
    if n:
        size[:, 0] = scipy.linalg.matrix_balance(A, permute=False, separate=True)[1][0]  # powers of 2
    B = B / size
    scale = float(np.abs(B).max(initial=0.0)) or 1.0
    block = scipy.linalg.expm(np.block([[A / size * size.T, B / scale], [np.zeros((m, n + m))]]) * T)
    return size * block[:n, :n] / size.T, size * block[:n, n:] * scale


def riccati(A: Array, B: Array, Q: Array, R: Array, within: float = 1.0) -> Array:
    """Return X (n, n) = AᵀXA − AᵀXB (R + BᵀXB)⁻¹ BᵀXA + Q that stabilizes A − B K, K = (R + BᵀXB)⁻¹ BᵀXA.

    A and Q are (n, n), B (n, m), R (m, m), in consistent units; for filters use Aᵀ and Cᵀ. Raises `ValueError` where
    no X has eigenvalues of A − B K `within` that radius.
    """
    root = np.linalg.cholesky(R)
    B = np.linalg.solve(root, B.T).T  # in the units of what is acceptable
    try:
        X = scipy.linalg.solve_discrete_are(A, B, Q, np.eye(len(R)))
    except (scipy.linalg.LinAlgError, ValueError) as error:  # often only its reordering of eigenvalues
        if (found := by_doubling(A, B, Q)) is None:
            raise ValueError(str(error)) from None
        X = found
    K = np.linalg.solve(np.eye(len(R)) + B.T @ X @ B, B.T @ X @ A)
    if not np.abs(np.linalg.eigvals(A - B @ K)).max(initial=0.0) < within:
        raise ValueError("its solution is not stable")
    return (X + X.T) / 2


def by_doubling(A: Array, B: Array, X: Array) -> Array | None:
    """Return X (n, n) = AᵀXA − AᵀXB (1 + BᵀXB)⁻¹ BᵀXA + Q by doubling; A (n, n), B (n, m), argument `X` is Q (n, n).

    Step k makes 2ᵏ of the Riccati recursion (B. D. O. Anderson, Int. J. Control 28, 1978, 295–306), in any units. None
    where it does not converge, or 1 is below round-off of BᵀXB.
    """
    unit, G = np.eye(len(A)), B @ B.T
    with np.errstate(all="ignore"), suppress(np.linalg.LinAlgError):
        for _ in range(40):  # slow errors of filters are gone by then
            W, before = unit + G @ X, X
            through = np.linalg.solve(W.T, A.T).T
            X, G = X + A.T @ X @ np.linalg.solve(W, A), G + through @ G @ A.T
            A, X, G = through @ A, (X + X.T) / 2, (G + G.T) / 2
            if not (np.isfinite(X).all() and np.isfinite(G).all()):
                return None
            if np.abs(X - before).max() <= 1e-10 * np.abs(X).max():  # the next doubling changes its square
                return X if np.abs(B.T @ X @ B).max(initial=0.0) * np.finfo(float).eps < 1.0 else None
    return None
