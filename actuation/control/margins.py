"""Stability of sampled joint PID loops by the linear model.

The loop is judged as it acts: moments are held between samples and begin `delay` after their reading. Of the model
sampled exactly (Åström and Wittenmark, Computer-Controlled Systems, sec. 2.3) the loop x(k+1) = F x(k) is stable where
the spectral radius of F is below 1. Margins are by how much all gains, or the delay, may grow until it is 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array, ComplexArray, as_floats
from .linear_model import LinearModel, sampled
from .modes import locked_frequencies
from .records import ControllerRecord, JointPid, ModalVelocity

STABLE = 1.0 + 1e-6  # of a spectral radius: undamped modes and joints without a controller are at 1, to rounding
LARGEST_GAIN, LEAST_GAIN, LONGEST_DELAY = 1e4, 1e-2, 50.0  # that margins are sought to: factors, and sample times
GRID = 60  # points of the search for the first crossing, before bisection
RELATIVE = 1e-3  # to which margins are found
LIGHTLY = 0.2  # damping ratio, above which motion of a loop is no vibration
GONE = 1e-6  # eigenvalues below are commands on their way
ALIAS = 1e-3  # of an eigenvalue: how near it is to that of a vibration that samples are too rare for, and no other
SAMPLED = 0.99  # of half the sampling frequency, where eigenvalues are that of no motion
RIGID = 1e-6  # of the fastest eigenvalue: slower ones are rounding of motion without stiffness


@dataclass(frozen=True)
class JointGains:
    """u = −(P y + D ẏ + D' (y − y₋)/T + I Σ T y) with matrices (motors, outputs); y are the joints' errors."""

    P: Array
    D: Array
    difference: Array
    integral: Array

    def times(self, factor: float) -> JointGains:
        """All gains times a factor."""
        return JointGains(*(factor * matrix for matrix in (self.P, self.D, self.difference, self.integral)))


@dataclass(frozen=True)
class Margins:
    """How far a loop is from its stability bound, the worst of several configurations.

    Attributes:
        radius: the spectral radius; below 1 the loop is stable.
        gain: factor by which all gains may grow; below 1 the factor that would make it stable, 0 where none does.
        delay: s, by which the delay may grow; 0 where the loop is not stable.
    """

    radius: float
    gain: float
    delay: float

    @property
    def is_stable(self) -> bool:
        """Whether the linear model says so."""
        return self.radius <= STABLE


def joint_gains(model: LinearModel, records: Sequence[JointPid]) -> JointGains:
    """The gains of joint PID controllers, which add up."""
    shape = (len(motor_inputs(model)), len(model.output_names))
    P, D, difference, integral = (np.zeros(shape) for _ in range(4))
    motors = [model.input_names[k] for k in motor_inputs(model)]
    for record in records:
        for joint, motor in [(name, motor) for name in record.joints for motor in _motors_of(name, motors)]:
            output = motor.replace("joint/", f"{record.side}/", 1)
            at = motors.index(motor), model.outputs(output)[0]
            P[at] += record.proportional.get(joint, 0.0)
            (D if record.rate == "measured" else difference)[at] += record.derivative.get(joint, 0.0)
            integral[at] += record.integral.get(joint, 0.0)
    return JointGains(P, D, difference, integral)


def _motors_of(joint: str, motors: Sequence[str]) -> list[str]:
    """Inputs "joint/NAME", or "joint/NAME 1", "joint/NAME 2" of joints with several coordinates."""
    single = f"joint/{joint}"
    return [single] if single in motors else [name for name in motors if name.startswith(f"{single} ")]


def motor_inputs(model: LinearModel) -> list[int]:
    """Columns of B that are motors'."""
    return [k for k, name in enumerate(model.input_names) if name.startswith("joint/")]


def spectral_radius(model: LinearModel, gains: JointGains, T: float, delay: float) -> float:
    """The largest |eigenvalue| of the sampled loop."""
    return float(np.abs(loop_eigenvalues(model, gains, T, delay)).max())


def lowest_frequency(
    models: Sequence[LinearModel], controllers: Sequence[ControllerRecord], T: float, delay: float
) -> float:
    """Of the vibrations of the robot with its joints controlled or locked, Hz; NaN where nothing vibrates.

    The lowest with all motors held and, where joints have PID controllers alone, of the sampled loop: its eigenvalues
    e^{sT} that are damped by less than `LIGHTLY`. With others half of the lowest with motors held.
    """
    locked = min((float(locked_frequencies(model).min(initial=np.inf)) for model in models), default=np.inf)
    pids = [record for record in controllers if isinstance(record, JointPid)]
    if any(not isinstance(record, JointPid | ModalVelocity) for record in controllers):
        locked *= 0.5
    elif pids and models:
        gains = joint_gains(models[0], pids)
        z = np.concatenate([_without_aliases(loop_eigenvalues(model, gains, T, delay), model, T) for model in models])
        s = np.log(z[np.abs(z) > GONE]) / T
        ringing = s[(s.imag > 0.0) & (-s.real < LIGHTLY * np.abs(s)) & (np.abs(s.imag) * T < np.pi * SAMPLED)]
        vibrating = ringing[np.abs(ringing) > RIGID * np.abs(s).max(initial=0.0)]
        locked = min(locked, float(vibrating.imag.min(initial=np.inf)) / (2 * np.pi))
    return locked if np.isfinite(locked) else float("nan")


def _without_aliases(z: ComplexArray, model: LinearModel, T: float) -> ComplexArray:
    """Those of the eigenvalues z of a loop that are no vibrations of the robot above half the sampling frequency."""
    s = np.linalg.eigvals(model.A)
    aliases = np.exp(s[np.abs(s.imag) * T > np.pi] * T)
    distance = np.abs(z[:, np.newaxis] - aliases).min(axis=1, initial=np.inf)
    found: ComplexArray = z[distance > ALIAS * np.abs(z)]
    return found


def loop_eigenvalues(model: LinearModel, gains: JointGains, T: float, delay: float) -> ComplexArray:
    """Those of the matrix F of the sampled loop."""
    f, m, o = model.freedom, len(gains.P), len(model.output_names)
    plant = sampled(model.A, model.B[:, motor_inputs(model)], T, delay)
    n = len(plant.A)
    value, rate = np.zeros((o, n)), np.zeros((o, n))
    value[:, :f] = rate[:, f : 2 * f] = model.C[:, :f]
    # states: those of the plant with commands on their way, the last readings, and their sums
    feedback = np.zeros((m, n + 2 * o))
    feedback[:, :n] = (gains.P + gains.difference / T + T * gains.integral) @ value + gains.D @ rate
    feedback[:, n : n + o] = -gains.difference / T
    feedback[:, n + o :] = gains.integral
    used = np.append(np.ones(n + o, dtype=bool), gains.integral.any(axis=0))  # sums without a gain would stay at 1
    F = np.zeros((n + 2 * o, n + 2 * o))
    F[:n, :n] = plant.A
    F[:n] -= plant.B @ feedback
    F[n : n + o, :n] = value
    F[n + o :, :n], F[n + o :, n + o :] = T * value, np.eye(o)
    return np.asarray(np.linalg.eigvals(F[np.ix_(used, used)]), dtype=complex)


def margins(models: Sequence[LinearModel], gains: JointGains, T: float, delay: float) -> Margins:
    """Of a loop about each of the `models`, the worst."""

    def radius(factor: float, more: float) -> float:
        return max(spectral_radius(model, gains.times(factor), T, delay + more) for model in models)

    now = radius(1.0, 0.0)
    if now > STABLE:
        factors = as_floats(np.geomspace(1.0, LEAST_GAIN, GRID))
        return Margins(now, _last_before(lambda c: radius(c, 0.0) <= STABLE, factors, missing=0.0), 0.0)
    factors = as_floats(np.geomspace(1.0, LARGEST_GAIN, GRID))
    gain = _last_before(lambda c: radius(c, 0.0) > STABLE, factors, missing=np.inf)
    waits = np.append(0.0, T * np.geomspace(0.01, LONGEST_DELAY, GRID))
    return Margins(now, gain, _last_before(lambda d: radius(1.0, d) > STABLE, waits, missing=np.inf))


def _last_before(changed: Callable[[float], bool], values: Array, missing: float) -> float:
    """Where on the way along `values` a condition first changes, by bisection; `missing` where it never does."""
    before = float(values[0])
    for value in map(float, values[1:]):
        if changed(value):
            after = value
            while abs(after - before) > RELATIVE * max(abs(before), abs(after)):
                middle = 0.5 * (before + after)
                before, after = (before, middle) if changed(middle) else (middle, after)
            return 0.5 * (before + after)
        before = value
    return missing
