"""Controllers: their protocol and choice, joint PID, modal velocity, computed torque, functions of Python.

A user's own controller: a function in a Python file that is given the setup and returns what is asked at samples.

    def controller(setup):                 # actuation.control.robot.Setup
        gamma = setup.columns("joint/O")   # where readings are in y, by name
        tau = setup.places("joint/O")      # where commands are in u

        def at_sample(k, y):               # sample number, readings (outputs,)
            u = np.zeros(len(setup.inputs))
            u[tau] = 100 * (setup.reference[k, gamma] - y[gamma])
            return u                       # added to setup.feed_forward[k], then cut at the limits

        return at_sample

It reads the sensors that the scene gives.
"""

from __future__ import annotations

import runpy
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, SolveError
from ...common.python_files import count_failed, count_imports, imported_files
from .lqr import LqrControl
from .records import ComputedTorque, JointPid, Lqr, ModalVelocity, StateFeedback
from .records import Controller as Record
from .robot import RigidArm, Setup, estimate


class Controller(Protocol):
    """Protocol of controllers, which are called at each sample and may keep a state.

    `bandwidth` (rad/s): the fastest motion that it means to act on; 0 where it does not say.
    """

    bandwidth: float

    def __call__(self, k: int, y: Array) -> Array:
        """Commands u (inputs,) at sample k for the readings y (outputs,); they are added to the feed-forward."""


class LinearFeedback:
    """u = P e + D (e − e₋)/T + I ∫e with e = r − y, matrices (inputs, outputs); terms without a matrix are left out."""

    def __init__(
        self,
        setup: Setup,
        P: Array | None,
        D: Array | None = None,
        integral: Array | None = None,
        bandwidth: float = 0.0,
    ) -> None:
        self.reference, self.T, self.bandwidth = setup.reference, setup.sample_time, bandwidth
        self.P = P if P is not None else np.zeros((len(setup.inputs), len(setup.outputs)))
        self.D, self.integral = D, integral
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


def joint_pid(record: JointPid, setup: Setup, mobility: Array) -> LinearFeedback:
    """PID of joints; `mobility` (motors,) is the acceleration of each joint per moment on it, for the bandwidth."""
    shape = (len(setup.inputs), len(setup.outputs))
    P, D, integral = (np.zeros(shape) for _ in range(3))
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
    """Voltages for the modal forces −2 ζ ω ṗ of the lowest modes, which spill into others only where they must."""
    G = np.zeros((len(setup.inputs), len(setup.outputs)))
    bandwidth = 0.0
    for name in record.bodies:
        link = setup.robot.patches[name]
        m = min(record.modes, len(link.omega))
        damping = link.gain[:, :m] * (2 * record.damping_ratio * link.omega[:m])
        if record.sensor == "pzt":
            columns, modes = setup.columns(*link.inputs), estimate(link.volts, m)
        else:
            columns, modes = setup.modal_columns(name, link.own.shape[1]), link.own[:m]
        G[np.ix_(setup.patch_places(name), columns)] = damping @ modes
        bandwidth = max(bandwidth, float(link.omega[m - 1]))
    P, D = (None, G) if record.sensor == "pzt" else (G, None)
    return LinearFeedback(setup, P, D, bandwidth=bandwidth)


def state_feedback(record: StateFeedback, setup: Setup) -> LinearFeedback:
    """Make the controller u = −K x̂ on an observer's estimates. Raises `InputError` for gains of wrong size."""
    K = np.zeros((len(setup.inputs), len(setup.outputs)))
    states = [k for k, name in enumerate(setup.outputs) if name.startswith("estimate/state/")]
    gain, size = np.array(record.gain), (len(record.inputs), len(states))
    if gain.shape != size:
        raise InputError(
            f"{setup.robot.path}: controller state-feedback: expected gain with {size[0]} × {size[1]} numbers (inputs,"
            " states of the observer)",
            " × ".join(map(str, gain.shape)),
        )
    K[np.ix_(setup.places(*record.inputs), np.array(states, dtype=int))] = gain
    return LinearFeedback(setup, K)


class ComputedTorqueControl:
    """Moments for γ̈_ref + 2 ζ ω ė + ω² e with rigid links (Craig, Introduction to Robotics, sec. 10.4).

    They replace the moments of the feed-forward, which are taken off.
    """

    def __init__(self, record: ComputedTorque, setup: Setup, arm: RigidArm) -> None:
        motors = setup.robot.motors
        self.arm, self.bandwidth = arm, record.bandwidth
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
    """Controller from a user's `factory`; checks what it returns and raises `SolveError` where that fails."""

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
        """What the user's function commands at sample k."""
        try:
            u = np.asarray(self.act(k, y), dtype=float)
        except (Exception, SystemExit) as error:  # the user's code may raise anything
            raise SolveError(f"{self._at(k)}: {_in_words(error)}") from error
        if u.shape != (self.size,) or not np.isfinite(u).all():
            raise SolveError(
                f"{self._at(k)}: expected {self.size} finite commands, shape ({self.size},)", f"shape {u.shape}: {u}"
            )
        return u

    def __copy__(self) -> PythonControl:
        """As at the start of a run: what the user's function remembers cannot be copied."""
        return PythonControl(*self.made_by)

    def _at(self, k: int) -> str:
        return f"{self.label}: sample {k}, t = {self.times[k]:g} s"


def _in_words(error: BaseException) -> str:
    line = count_failed(error)
    return f"{type(error).__name__}: {error}{line and f' ({line})'}"


def load_function(reference: str, folder: Path) -> Callable[[Setup], Callable[[int, Array], Array]]:
    """The function of "FILE.py:FUNCTION" of a scene in `folder`.

    What the file imports from below there counts among `python_files.imported_files`. Raises `InputError` where the
    file fails or does not have the function.
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
    """All controllers of an analysis."""
    return [make_controller(record, setup, records) for record in records]


def make_controller(record: Record, setup: Setup, beside: Sequence[Record]) -> Controller:
    """Make the controller of one table of the scene; `beside`: the tables of all that act together.

    Raises `InputError` where it does not fit the robot.
    """
    if isinstance(record, JointPid):
        return joint_pid(record, setup, joint_mobility(setup))
    if isinstance(record, ModalVelocity):
        return modal_velocity(record, setup)
    if isinstance(record, StateFeedback):
        return state_feedback(record, setup)
    if isinstance(record, ComputedTorque):
        return ComputedTorqueControl(record, setup, setup.robot.rigid())
    if isinstance(record, Lqr):
        return LqrControl(record, setup, [other for other in beside if isinstance(other, JointPid)])
    label = f"{setup.robot.path}: controller: {record.python}"
    folder = setup.robot.path.parent
    function = load_function(record.python, folder) if isinstance(record.python, str) else record.python
    return PythonControl(function, setup, label)


def joint_mobility(setup: Setup) -> Array:
    """Return acceleration per torque (motors,), 1/(kg·m²) or 1/kg, at the start; links rigid, other joints free."""
    rest = np.zeros(len(setup.robot.motors))
    if not setup.robot.motors_fit:
        return rest
    arm = setup.robot.rigid()
    M, _ = arm.terms(arm.angles(), rest)
    return np.diag(np.linalg.inv(M))
