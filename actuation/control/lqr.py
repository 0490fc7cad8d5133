"""Linear-quadratic regulator about the reference: gains of the sampled linear model, delay included."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from .linear_model import (
    LinearModel,
    controllability,
    kept_modes,
    observability,
    state_space,
)
from .records import JointPid, Lqr
from .robot import Setup, estimate
from .sampling import SampledModel, riccati, sampled

MOST_STATES = 500  # with which the Riccati equation takes seconds, not minutes
MOVED = 0.05  # of a discrete pole, from which on feedback acts on the motion


def gains(model: SampledModel, Q: Array, R: Array) -> Array:
    """Return K (m, n) of u = −K x with least Σ xᵀQx + uᵀRu; Q (k, k) weights the first k states, the rest are delays.

    Raises `ValueError` where the Riccati equation has no stabilizing solution.
    """
    n, waiting = len(Q), (len(model.A) - len(Q)) // len(R)
    # in the unit of what is acceptable: all weights are one
    scale = np.concatenate([1 / np.sqrt(np.diag(Q)), *[1 / np.sqrt(np.diag(R))] * waiting])
    unit = 1 / np.sqrt(np.diag(R))
    A, B = model.A * scale / scale[:, None], model.B * unit / scale[:, None]
    weight = np.diag(np.concatenate([np.ones(n), np.full(len(A) - n, 1e-9)]))
    X = riccati(A, B, weight, np.eye(len(R)))
    K = np.linalg.solve(np.eye(len(R)) + B.T @ X @ B, B.T @ X @ A)
    return unit[:, None] * K / scale


class LqrControl:
    """Feedback u = −K x of joint errors, the links' lowest modes, their rates, and the commands not yet in effect."""

    def __init__(self, record: Lqr, setup: Setup, beside: Sequence[JointPid] = ()) -> None:
        model = design_model(record, setup, beside if record.inputs == "patches" else ())
        motors = [] if record.inputs == "patches" else [f"joint/{name}" for name in setup.robot.motors]
        patches = {} if record.inputs == "motors" else setup.robot.patches
        acting = [*setup.places(*motors), *(i for body in patches for i in setup.patch_places(body))]
        left_out = {of for of in setup.inputs if record.pzt is not None and of.split("/")[1] not in record.pzt}
        self.inputs = [i for i in acting if not setup.inputs[i].startswith("pzt/") or setup.inputs[i] not in left_out]
        names = [setup.inputs[i] for i in self.inputs]
        if not names:
            raise InputError(f"{setup.robot.path}: controller lqr: expected motors or patches as inputs", "none")
        self.warnings = _out_of_reach(record, setup, model, names)
        Q, R = _weights(record, setup, model, names)
        waiting = int(np.ceil(setup.delay / setup.sample_time)) * len(names)
        if len(model.A) + waiting > MOST_STATES:
            raise InputError(
                f"{setup.robot.path}: controller lqr: expected at most {MOST_STATES} states",
                f"{len(model.A)} of the model and {waiting} commands on their way: a shorter delay or fewer inputs",
            )
        discrete = sampled(model.A, model.B[:, model.inputs(names)], setup.sample_time, setup.delay)
        try:
            self.K = gains(discrete, Q, R)
        except ValueError as error:
            raise InputError(
                f"{setup.robot.path}: controller lqr: expected a model that motors and patches can stabilize",
                f"none ({error}): {'; '.join(self.warnings) or 'more modes or other weights?'}",
            ) from None
        self.bandwidth = _bandwidth(model.A, discrete.A - discrete.B @ self.K, setup.sample_time)
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


def _bandwidth(A: Array, closed: Array, T: float) -> float:
    """The fastest of the model's motions that feedback changes: whose discrete pole moves."""
    poles = np.linalg.eigvals(A)
    moved = np.abs(np.exp(poles * T)[:, None] - np.linalg.eigvals(closed)).min(axis=1) > MOVED
    return float(np.abs(poles[moved]).max(initial=0.0))


def design_model(record: Lqr, setup: Setup, beside: Sequence[JointPid]) -> LinearModel:
    """Return the linear model for the design: about the reference at `time`, with the lowest modes of links.

    Springs and dampers replace other controllers of joints, without sampling and delay.
    """
    mechanism, voltages = setup.robot.linear(int(np.argmin(np.abs(setup.source.time - record.time))))
    mechanism, voltages = kept_modes(mechanism, voltages, record.modes)
    for pid in beside:
        for joint, name in setup.robot_coordinates(pid.joints):
            held = np.outer(mechanism.inputs[f"joint/{name}"], mechanism.outputs[f"{pid.side}/{name}"])
            spring, damper = pid.proportional.get(joint, 0.0), pid.derivative.get(joint, 0.0)
            mechanism = replace(mechanism, K=mechanism.K + spring * held, D=mechanism.D + damper * held)
    return state_space(mechanism, voltages)


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
        weight = 1 / (link.mass * (record.deflection * link.length) ** 2)
        values.append(weight)
        rates.append(weight / link.stiffness[int(rest[0]) - 1])
    cost = [record.moment if name.startswith("joint/") else record.voltage for name in inputs]
    return np.diag([*values, *rates]), np.diag(np.array(cost) ** -2.0)


def _estimates(record: Lqr, setup: Setup, model: LinearModel) -> tuple[Array, Array, Array]:
    """(f, outputs) that give coordinates, measured rates, and rates by differences (times T)."""
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
    lost = controllability(model, list(inputs)).lost
    lines = [f"LQR: uncontrollable: {', '.join(lost)}"] if lost else []
    if setup.has_estimates:
        return tuple(lines)
    seen = _rigid_outputs(setup)
    bending = setup.robot.links if record.sensor == "ideal" else setup.robot.patches
    seen += [n for n in model.output_names if n.startswith("modal/") and n.split("/")[1] in bending]
    hidden = observability(model, seen).lost
    return (*lines, *([f"LQR: unobservable: {', '.join(hidden)}"] if hidden else []))


def _rigid_outputs(setup: Setup) -> list[str]:
    joints = [f"joint/{name}" for name in setup.robot.motors]
    return [*joints, *(f"motor/{name}" for name in setup.robot.elastic_joints)]
