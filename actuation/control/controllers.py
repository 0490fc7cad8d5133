"""The protocol of controllers, and the linear ones: joint PID and modal velocity feedback."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError, quoted
from ...mbs.analysis.outcome import Outcome
from ...mbs.model.model import Model
from ..patches.link_patches import LinkPatches
from .records import JointPid, ModalVelocity
from .robot import Robot, estimate


class Controller(Protocol):
    """What is asked once a sample: a small object that may keep a state from sample to sample.

    `bandwidth` (rad/s): the fastest motion that it means to act on; 0 where it does not say.
    """

    bandwidth: float

    def __call__(self, k: int, y: Array) -> Array:
        """Commands u (inputs,) at sample k for the readings y (outputs,); they are added to the feed-forward."""


@dataclass(frozen=True)
class Setup:
    """What a controller may know when it is made.

    Attributes:
        robot: what is known of it; see `robot.Robot`.
        model: its equations of motion; `patches` by body.
        inputs, outputs: names of commands (moments N·m, voltages V) and readings, as `signals` names them.
        times: (K,) of the samples, s; `sample_time`, and the `delay` after which a command acts.
        reference: (K, outputs) what the sensors would read on the motion of the inverse analysis `source`.
        feed_forward: (K, inputs) what is commanded anyhow.
    """

    robot: Robot
    model: Model
    patches: Mapping[str, LinkPatches]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    times: Array
    sample_time: float
    delay: float
    reference: Array
    feed_forward: Array
    source: Outcome

    def robot_coordinates(self, joints: Iterable[str]) -> Iterator[tuple[str, str]]:
        """Joints with the names of their coordinates, one after the other."""
        for joint in joints:
            yield from ((joint, name) for name in self.robot.coordinates(joint))

    def columns(self, *names: str) -> Indices:
        """Where these readings are in y."""
        return np.array([self.outputs.index(name) for name in names], dtype=int)

    def places(self, *names: str) -> Indices:
        """Where these commands are in u. Raises `InputError` for a joint without a motor."""
        missing = [name for name in names if name not in self.inputs]
        if missing:
            raise InputError(
                f"{self.robot.path}: controller: expected joints with motors, {quoted(self.robot.motors)}, found"
                f" {quoted(name.partition('/')[2] for name in missing)}"
            )
        return np.array([self.inputs.index(name) for name in names], dtype=int)

    def patch_places(self, body: str) -> Indices:
        """Where the voltages of a body's patches are in u."""
        return self.places(*self.robot.patches[body].inputs)


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
            self.sum += self.T * e
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
            columns, modes = modal_columns(setup, name, link.own.shape[1]), link.own[:m]
        G[np.ix_(setup.patch_places(name), columns)] = damping @ modes
        bandwidth = max(bandwidth, float(link.omega[m - 1]))
    return (
        LinearFeedback(setup, None, G, bandwidth=bandwidth)
        if record.sensor == "pzt"
        else LinearFeedback(setup, G, bandwidth=bandwidth)
    )


def modal_columns(setup: Setup, body: str, m: int, ending: str = "/rate") -> Indices:
    """The readings of the lowest m modal coordinates of a body, or of their rates."""
    return setup.columns(*(f"modal/{body}/{k}{ending}" for k in range(1, m + 1)))
