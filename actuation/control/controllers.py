"""Controllers: joint PID, modal velocity, linear-quadratic, computed torque, functions of Python; their protocol.

A user's own controller is a function of the setup, in a Python file, that returns u = at_sample(k, y); see
docs/howto/control.md.
"""

import runpy
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, SolveError
from ...common.python_files import count_failed, count_imports, imported_files
from .linear_model import LinearModel, kept_modes, state_space
from .reachability import controllability, observability
from .records import ComputedTorque, JointPid, Lqr, ModalVelocity, StateFeedback
from .records import Controller as Record
from .robot import Setup, estimate
from .sampled_model import SampledModel, riccati, sampled


class Controller(Protocol):
    """Protocol of controllers: u (inputs,) = controller(k, y (outputs,)), SI, at sample k; it may keep a state.

    `bandwidth` (rad/s) is that of the fastest motion on which it acts; 0 where not known.
    """

    bandwidth: float

    def __call__(self, k: int, y: Array) -> Array:
        """Commands u (inputs,) at sample k for the readings y (outputs,); they are added to the feed-forward."""


class LinearFeedback:
    """u = P e + D (e − e₋)/T + I ∫e with e = r − y from the reference r, e₋ one sample time T before.

    Matrices are (inputs, outputs), in units of commands per reading; terms without a matrix are left out.
    """

    def __init__(
        self,
        setup: Setup,
        P: Array,
        D: Array | None = None,
        integral: Array | None = None,
        bandwidth: float = 0.0,
    ) -> None:
        self.reference, self.T, self.bandwidth = setup.reference, setup.sample_time, bandwidth
        self.P, self.D, self.integral = P, D, integral
        self.before: Array | None = None
        self.sum = np.zeros(len(setup.outputs))

    def __call__(self, k: int, y: Array) -> Array:
        """Commands at sample k."""
        e = self.reference[k] - y
        u: Array = self.P @ e
        if self.D is not None:
            u += self.D @ (e - (e if self.before is None else self.before)) / self.T
            self.before = e
        if self.integral is not None:
            self.sum = self.sum + self.T * e
            u += self.integral @ self.sum
        return u


def joint_pid(record: JointPid, setup: Setup) -> LinearFeedback:
    """Make the PID controller of joints; its bandwidth is that at the start with rigid links and other joints free."""
    mobility = np.zeros(len(setup.robot.motors))  # 1/(kg·m²) or 1/kg, acceleration of each joint per torque
    if setup.robot.motors_fit:
        mobility = setup.robot.rigid().mobility()
    P, D, integral = np.zeros((3, len(setup.inputs), len(setup.outputs)))
    bandwidth = 0.0
    for joint, name in setup.robot_coordinates(record.joints):
        (u,), (y,) = setup.places(f"joint/{name}"), setup.columns(f"{record.side}/{name}")
        P[u, y] = record.proportional.get(joint, 0.0)
        integral[u, y] = record.integral.get(joint, 0.0)
        gain = record.derivative.get(joint, 0.0)
        if gain and record.rate == "measured":
            P[u, setup.columns(f"{record.side}/{name}/rate")] = gain
        D[u, y] = gain
        bandwidth = max(bandwidth, float(np.sqrt(P[u, y] * mobility[u])), gain * float(mobility[u]))
    differences = D if record.rate == "difference" and D.any() else None
    return LinearFeedback(setup, P, differences, integral if integral.any() else None, bandwidth)


def modal_velocity(record: ModalVelocity, setup: Setup) -> LinearFeedback:
    """Make the controller whose voltages damp the lowest modes by forces −2 ζ ω ṗ, with least force on other modes."""
    G = np.zeros((len(setup.inputs), len(setup.outputs)))
    bandwidth = 0.0
    for name in record.bodies:
        link = setup.robot.patches[name]
        m = min(record.modes, len(link.omega))
        if record.sensor == "pzt":
            columns, modes = setup.columns(*link.inputs), estimate(link.volts, m)
            m = len(modes)  # no more than the patches
        else:
            columns, modes = setup.modal_columns(name, link.own.shape[1]), link.own[:m]
        damping = link.gain[:, :m] * (2 * record.damping_ratio * link.omega[:m])
        G[np.ix_(setup.places(*link.inputs), columns)] = damping @ modes
        bandwidth = max(bandwidth, float(link.omega[m - 1]))
    P, D = (np.zeros_like(G), G) if record.sensor == "pzt" else (G, None)
    return LinearFeedback(setup, P, D, bandwidth=bandwidth)


def state_feedback(record: StateFeedback, setup: Setup) -> LinearFeedback:
    """Make the controller u = −K x̂ on an observer's estimates. Raises `InputError` for gains of wrong size."""
    K = np.zeros((len(setup.inputs), len(setup.outputs)))
    states = [k for k, name in enumerate(setup.outputs) if name.startswith("estimate/state/")]
    gain, size = np.array(record.gain), (len(record.inputs), len(states))
    if gain.shape != size:
        raise InputError(
            f"controller state-feedback: expected gain with {size[0]} × {size[1]} numbers (inputs,"
            " states of the observer)",
            " × ".join(map(str, gain.shape)),
        )
    K[np.ix_(setup.places(*record.inputs), np.array(states, dtype=int))] = gain
    return LinearFeedback(setup, K)


class ComputedTorqueControl:
    """Torques for joint accelerations γ̈_ref + 2 ζ ω ė + ω² e with rigid links, less the feed-forward.

    e is the error of joint coordinates, ω bandwidth, ζ damping ratio (Craig, Introduction to Robotics, sec. 10.4).
    """

    def __init__(self, record: ComputedTorque, setup: Setup) -> None:
        motors, is_geared = setup.robot.motors, bool(setup.robot.elastic_joints)
        self.arm, self.bandwidth = setup.robot.rigid(), record.bandwidth
        self.warnings = ["the controller is designed for rigid gears, but some are compliant"] * is_geared
        self.gains = record.bandwidth**2, 2 * record.damping_ratio * record.bandwidth
        self.values = setup.columns(*(f"joint/{name}" for name in motors))
        self.rates = setup.columns(*(f"joint/{name}/rate" for name in motors))
        self.reference, self.feed_forward = setup.reference, setup.feed_forward
        self.accelerations = np.gradient(self.reference[:, self.rates], setup.times, axis=0, edge_order=2)

    def __call__(self, k: int, y: Array) -> Array:
        """Commands at sample k."""
        r, m = self.reference[k], len(self.values)
        e, e_dot = r[self.values] - y[self.values], r[self.rates] - y[self.rates]
        wanted = self.accelerations[k] + self.gains[0] * e + self.gains[1] * e_dot
        u: Array = np.zeros_like(self.feed_forward[k])
        u[:m] = self.arm.moments(y[self.values], y[self.rates], wanted) - self.feed_forward[k, :m]
        return u


class PythonControl:
    """Controller from a user's function `factory`. Raises `SolveError` where that fails, or commands do not fit."""

    bandwidth = 0.0

    def __init__(self, factory: Callable[[Setup], Callable[[int, Array], Array]], setup: Setup, label: str) -> None:
        self.label, self.size, self.times = label, len(setup.inputs), setup.times
        self.made_by = factory, setup, label
        try:
            self.act = factory(setup)
        except (Exception, SystemExit) as error:  # the user's code may raise anything
            raise SolveError(f"{label}: {_in_words(error)}") from error
        if not callable(self.act):
            raise SolveError(f"{label}: expected it to return a function (k, y) → u", f"{self.act!r}")

    def __call__(self, k: int, y: Array) -> Array:
        """The commands (inputs,) of the user's function at sample k."""
        try:
            u = np.asarray(self.act(k, y), dtype=float)
        except (Exception, SystemExit) as error:  # the user's code may raise anything
            raise SolveError(f"{self._at(k)}: {_in_words(error)}") from error
        if u.shape != (self.size,) or not np.isfinite(u).all():
            raise SolveError(
                f"{self._at(k)}: expected {self.size} finite commands, shape ({self.size},)", f"shape {u.shape}: {u}"
            )
        return u

    def __copy__(self) -> "PythonControl":
        """Make the controller anew, as at the start of a run: the state of the user's function cannot be copied."""
        return PythonControl(*self.made_by)

    def _at(self, k: int) -> str:
        return f"{self.label}: sample {k}, t = {self.times[k]:g} s"


def _in_words(error: BaseException) -> str:
    line = count_failed(error)
    return f"{type(error).__name__}: {error}{line and f' ({line})'}"


def load_function(reference: str, folder: Path) -> Callable[[Setup], Callable[[int, Array], Array]]:
    """The function of "FILE.py:FUNCTION" of a scene in `folder`.

    It makes the controller u (inputs,) = f(k, y (outputs,)), SI units, from the setup. `python_files.imported_files`
    lists its imports from below `folder`. Raises `InputError` where the file fails or lacks the function.
    """
    path, _, name = reference.rpartition(":")
    count_imports(folder, Path(path).parent)
    try:
        found = runpy.run_path(path)
    except (Exception, SystemExit) as error:
        raise InputError(f"{path}: controller: {_in_words(error)}") from error
    finally:
        imported_files()  # as they are now
    if not callable(found.get(name)):
        raise InputError(f'{path}: controller: expected the function "{name}"', "none")
    return found[name]


def make_controllers(records: Sequence[Record], setup: Setup) -> list[Controller]:
    """Make the controllers of an analysis from its tables. Raises `InputError` where one does not fit the robot."""
    made: list[Controller] = []
    for record in records:
        if isinstance(record, JointPid):
            made.append(joint_pid(record, setup))
        elif isinstance(record, ModalVelocity):
            made.append(modal_velocity(record, setup))
        elif isinstance(record, StateFeedback):
            made.append(state_feedback(record, setup))
        elif isinstance(record, ComputedTorque):
            made.append(ComputedTorqueControl(record, setup))
        elif isinstance(record, Lqr):
            made.append(LqrControl(record, setup, [other for other in records if isinstance(other, JointPid)]))
        else:
            path, function = setup.robot.path, record.python
            if isinstance(function, str):
                function = load_function(function, path.parent)
            made.append(PythonControl(function, setup, f"{path}: controller: {record.python}"))
    return made


MOST_STATES = 500  # with which the Riccati equation takes seconds, not minutes


def gains(model: SampledModel, Q: Array, R: Array) -> Array:
    """K (m, n) of u = −K x with least Σ xᵀQx + uᵀRu; Q (k, k) weights the first k states, others are delays.

    K is in units of u over x, Q and R (m, m), diagonal, in inverse squares of units of x and u. Raises `ValueError`
    where the Riccati equation has no stabilizing solution.
    """
    n, waiting = len(Q), (len(model.A) - len(Q)) // len(R)
    # in the unit of what is acceptable: all weights are one
    unit = 1 / np.sqrt(np.diag(R))
    scale = np.concatenate([1 / np.sqrt(np.diag(Q)), *[unit] * waiting])
    A, B = model.A * scale / scale[:, None], model.B * unit / scale[:, None]
    weight = np.diag(np.concatenate([np.ones(n), np.full(len(A) - n, 1e-9)]))
    X = riccati(A, B, weight, np.eye(len(R)))
    K = np.linalg.solve(np.eye(len(R)) + B.T @ X @ B, B.T @ X @ A)
    return unit[:, None] * K / scale


class LqrControl:
    """Feedback u = −K x of joint errors, the links' lowest modes, their rates, and the commands not yet in effect."""

    def __init__(self, record: Lqr, setup: Setup, beside: Sequence[JointPid]) -> None:
        model = design_model(record, setup, beside if record.inputs == "patches" else ())
        names = [] if record.inputs == "patches" else [f"joint/{name}" for name in setup.robot.motors]
        patches = {} if record.inputs == "motors" else setup.robot.patches
        every = (name for of in patches.values() for name in of.inputs)
        names += (name for name in every if record.pzt is None or name.split("/")[1] in record.pzt)
        self.inputs = setup.places(*names)
        if not names:
            raise InputError("controller lqr: expected motors or patches as inputs", "none")
        self.warnings = _out_of_reach(record, setup, model, names)
        Q, R = _weights(record, setup, model, names)
        waiting = int(np.ceil(setup.delay / setup.sample_time)) * len(names)
        if len(model.A) + waiting > MOST_STATES:
            raise InputError(
                f"controller lqr: expected at most {MOST_STATES} states",
                f"{len(model.A)} of the model and {waiting} commands on their way: a shorter delay or fewer inputs",
            )
        discrete = sampled(model.A, model.B[:, model.inputs(names)], setup.sample_time, setup.delay)
        try:
            self.K = gains(discrete, Q, R)
        except ValueError as error:
            raise InputError(
                "controller lqr: expected a model that motors and patches can stabilize",
                f"none ({error}): {'; '.join(self.warnings) or 'more modes or other weights?'}",
            ) from None
        # the fastest of the model's motions that feedback changes: whose discrete pole moves
        poles = np.linalg.eigvals(model.A)
        closed = np.linalg.eigvals(discrete.A - discrete.B @ self.K)
        moved = np.abs(np.exp(poles * setup.sample_time)[:, None] - closed).min(axis=1) > 0.05
        self.bandwidth = float(np.abs(poles[moved]).max(initial=0.0))
        self.values, self.rates, differences = _estimates(record, setup, model)
        unread = [name for name, row in zip(model.state_names, self.values, strict=False) if not row.any()]
        if unread:
            self.warnings += (f"LQR: no sensor reads {', '.join(unread)}, taken for 0: an observer estimates them",)
        self.differences = differences / setup.sample_time
        self.reference, self.f = setup.reference, model.freedom
        self.x = np.zeros(len(discrete.A))
        self.before: Array | None = None
        self.size = len(setup.inputs)

    def __call__(self, k: int, y: Array) -> Array:
        """Commands at sample k."""
        e = y - self.reference[k]
        change = e - (e if self.before is None else self.before)
        self.before = e
        x, f = self.x.copy(), self.f
        x[:f] = self.values @ e
        x[f : 2 * f] = self.rates @ e + self.differences @ change
        command = -self.K @ x
        if len(x) > 2 * f:
            x[2 * f : -len(command)] = x[2 * f + len(command) :]
            x[-len(command) :] = command
        self.x = x
        u = np.zeros(self.size)
        u[self.inputs] = command
        return u


def design_model(record: Lqr, setup: Setup, beside: Sequence[JointPid]) -> LinearModel:
    """The linear model for the design: about the reference at `record.time`, with the lowest modes of links.

    Springs and dampers replace the joint controllers `beside`, without sampling and delay.
    """
    row = int(np.argmin(np.abs(setup.robot.source.time - record.time)))
    mechanism = kept_modes(setup.robot.linear(row), record.modes)
    for pid in beside:
        for joint, name in setup.robot_coordinates(pid.joints):
            held = np.outer(mechanism.inputs[f"joint/{name}"], mechanism.outputs[f"{pid.side}/{name}"])
            spring, damper = pid.proportional.get(joint, 0.0), pid.derivative.get(joint, 0.0)
            mechanism = replace(mechanism, K=mechanism.K + spring * held, D=mechanism.D + damper * held)
    return state_space(mechanism)


def _weights(record: Lqr, setup: Setup, model: LinearModel, inputs: Sequence[str]) -> tuple[Array, Array]:
    """Q and R (diagonal); pᵀp/m is the mean square of a link's deflection."""
    values, rates = [], []
    for name in model.state_names[: model.freedom]:
        kind, body, *rest = name.split("/")
        if kind != "modal":
            values.append(record.angle**-2)
            rates.append(record.rate**-2)
            continue
        link = setup.robot.links[body]
        weight = 1 / (link.mass * (record.deflection * (link.length or 1.0)) ** 2)
        values.append(weight)
        rates.append(weight / link.stiffness[int(rest[0]) - 1])
    cost = [record.moment if name.startswith("joint/") else record.voltage for name in inputs]
    return np.diag([*values, *rates]), np.diag(np.array(cost) ** -2.0)


def _estimates(record: Lqr, setup: Setup, model: LinearModel) -> tuple[Array, Array, Array]:
    """Matrices (f, outputs) from readings to coordinates, to measured rates, and to rates by differences (times T)."""
    values, rates, differences = np.zeros((3, model.freedom, len(setup.outputs)))
    names = list(model.state_names[: model.freedom])
    if setup.has_estimates:
        every = range(model.freedom)
        values[every, setup.columns(*(f"estimate/{name}" for name in names))] = 1.0
        rates[every, setup.columns(*(f"estimate/{name}/rate" for name in names))] = 1.0
        return values, rates, differences
    for name in _rigid_outputs(setup):
        i = names.index(name)
        values[i, setup.columns(name)] = 1.0
        rates[i, setup.columns(f"{name}/rate")] = 1.0
    for body in setup.robot.links:
        rows = np.array([i for i, name in enumerate(names) if name.startswith(f"modal/{body}/")], dtype=int)
        m = len(rows)
        if record.sensor == "ideal":
            values[np.ix_(rows, setup.modal_columns(body, m, ""))] = np.eye(m)
            rates[np.ix_(rows, setup.modal_columns(body, m))] = np.eye(m)
        elif m and (link := setup.robot.patches.get(body)) is not None:
            known = estimate(link.volts @ link.own, m)
            at = np.ix_(rows[: len(known)], setup.columns(*link.inputs))
            values[at] = differences[at] = known
    return values, rates, differences


def _out_of_reach(record: Lqr, setup: Setup, model: LinearModel, inputs: Sequence[str]) -> tuple[str, ...]:
    """Modes that no input of the design reaches, or no sensor sees."""
    lost = {"uncontrollable": controllability(model, inputs).lost}
    if not setup.has_estimates:
        bending = setup.robot.links if record.sensor == "ideal" else setup.robot.patches
        modes = [n for n in model.output_names if n.startswith("modal/") and n.split("/")[1] in bending]
        lost["unobservable"] = observability(model, [*_rigid_outputs(setup), *modes]).lost
    return tuple(f"LQR: {what}: {', '.join(names)}" for what, names in lost.items() if names)


def _rigid_outputs(setup: Setup) -> list[str]:
    joints = [f"joint/{name}" for name in setup.robot.motors]
    return [*joints, *(f"motor/{name}" for name in setup.robot.elastic_joints)]
