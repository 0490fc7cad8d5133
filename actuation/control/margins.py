"""Stability of sampled loops by the linear model, and first gains of joint PD controllers. SI units.

Commands are constant between samples and begin `delay` after their reading. With the exactly sampled model and the
states of the controllers, the loop x(k+1) = F x(k) is stable where the spectral radius of F is below 1. Margins: by how
much all commands, or the delay, may grow until it is 1.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Literal

import numpy as np

from ...common.arrays import Array, ComplexArray
from ...common.keys import SMALLEST
from ...common.structs import struct
from ...common.toml_files import toml_key
from .linear_model import LinearModel, locked_frequencies
from .records import ControllerRecord, JointPid, ModalVelocity
from .sampled_model import SampledModel, sampled

STABLE = 1.0 + 1e-6  # of a spectral radius: undamped modes and joints without a controller are at 1, to round-off
FEW, MOST = 150, 600  # eigenvalues of a loop: margins are sought for so many; for more than the second none are found
GRID = 60  # points of the search for the first crossing, before bisection
LIGHTLY = 0.2  # damping ratio, above which motion of a loop is no vibration
GONE = 1e-6  # eigenvalues below are commands on their way
ALIAS = 1e-3  # of an eigenvalue: distance to that of a vibration too fast for the samples
SAMPLED = 0.99  # of half the sampling frequency, where eigenvalues are that of no motion
RIGID = 1e-6  # of the fastest eigenvalue: slower ones are round-off of motion without stiffness


@struct
class Feedback:
    """Discrete law of controllers, states ξ: ξ(k+1) = A ξ + B y, u = C ξ + D y, for deviations y from the reference.

    A (states, states), B (states, outputs), C (inputs, states), D (inputs, outputs) are in SI units.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    # names of commands u and readings y; the rate of a reading is "NAME/rate"
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    # (2, inputs) time constants and further delays of commands, s, by amplifiers; None without
    late: Array | None = None

    def times(self, factor: float) -> "Feedback":
        """The law with all commands times a factor."""
        return replace(self, C=factor * self.C, D=factor * self.D)

    def behind(self, A: Array, B: Array, C: Array, D: Array) -> "Feedback":
        """The law with discrete filters A (m, m), B (m, p), C (p, m), D (p, p), SI, of its readings."""
        if not len(A):
            return self
        whole = np.block([[self.A, self.B @ C], [np.zeros((len(A), len(self.A))), A]])
        into = np.vstack([self.B @ D, B])
        return replace(self, A=whole, B=into, C=np.hstack([self.C, self.D @ C]), D=self.D @ D)


Loops = Sequence[tuple[LinearModel, Feedback]]
"""A loop in several configurations."""


@struct
class Margins:
    """Stability margins of a loop, the worst of several configurations."""

    radius: float  # the spectral radius; below 1 the loop is stable
    # factor by which all gains may grow; below 1 the factor that would make it stable, 0 where none does
    gain: float  # NaN for more than `FEW` eigenvalues
    delay: float  # s, by which the delay may grow; 0 where the loop is not stable; NaN as `gain`

    @property
    def is_stable(self) -> bool:
        """Whether the closed loop of the linear model is stable."""
        return self.radius <= STABLE


def joint_gains(model: LinearModel, records: Sequence[JointPid], T: float) -> Feedback:
    """The law of joint PID controllers, which add up, at samples every T (s).

    −u = P y + D ẏ + D' (y − y₋)/T + I Σ T y with states y₋, the readings before, and Σ T y; D is of measured rates.
    """
    inputs = model.motors
    P, D, difference, integral = (np.zeros((len(inputs), len(model.output_names))) for _ in range(4))
    for record in records:
        for joint in record.joints:
            single = f"joint/{joint}"  # or "joint/NAME 1", "joint/NAME 2" of joints with several coordinates
            for motor in [single] if single in inputs else [name for name in inputs if name.startswith(f"{single} ")]:
                output = motor.replace("joint/", f"{record.side}/", 1)  # with a rigid gear the motor turns as the joint
                at = inputs.index(motor), model.outputs(output if output in model.output_names else motor)[0]
                P[at] += record.proportional.get(joint, 0.0)
                (D if record.rate == "measured" else difference)[at] += record.derivative.get(joint, 0.0)
                integral[at] += record.integral.get(joint, 0.0)
    o = len(P[0])
    none = np.zeros((o, o))
    names = (*model.output_names, *(f"{name}/rate" for name in model.output_names))
    used = np.append(difference.any(axis=0), integral.any(axis=0))  # sums without a gain would stay at 1
    into = np.block([[np.eye(o), none], [T * np.eye(o), none]])
    return Feedback(
        np.diag(np.repeat([0.0, 1.0], o))[np.ix_(used, used)], into[used],
        np.hstack([difference / T, -integral])[:, used], np.hstack([-P - difference / T - T * integral, -D]),
        inputs, names,
    )  # fmt: skip


def spectral_radius(model: LinearModel, feedback: Feedback, T: float, delay: float) -> float:
    """The largest |eigenvalue| of the sampled loop, with sample time T and `delay`, s."""
    return float(np.abs(loop_eigenvalues(model, feedback, T, delay)).max())


def lowest_frequency(
    models: Sequence[LinearModel], controllers: Sequence[ControllerRecord], T: float, delay: float
) -> float:
    """The lowest frequency of the robot with controlled or locked joints, Hz; NaN if nothing vibrates.

    It is the lowest with locked motors and, if PID controllers alone drive joints, of the sampled loop (sample time T,
    `delay` of commands, s) with damping ratios below `LIGHTLY`. With other controllers it is
    half of that with locked motors.
    """
    locked = min((float(locked_frequencies(model).min(initial=np.inf)) for model in models), default=np.inf)
    pids = [record for record in controllers if isinstance(record, JointPid)]
    if any(not isinstance(record, JointPid | ModalVelocity) for record in controllers):
        locked *= 0.5
    elif pids and models and eigenvalue_count((models[0], gains := joint_gains(models[0], pids, T)), T, delay) <= MOST:
        kept = []  # without vibrations of the robot above half the sampling frequency
        for model in models:
            s, z = np.linalg.eigvals(model.A), loop_eigenvalues(model, gains, T, delay)
            aliases = np.exp(s[np.abs(s.imag) * T > np.pi] * T)
            distance = np.abs(z[:, np.newaxis] - aliases).min(axis=1, initial=np.inf)
            kept.append(z[(distance > ALIAS * np.abs(z)) & (np.abs(z) > GONE)])
        s = np.log(np.concatenate(kept)) / T
        ringing = s[(s.imag > 0.0) & (-s.real < LIGHTLY * np.abs(s)) & (np.abs(s.imag) * T < np.pi * SAMPLED)]
        vibrating = ringing[np.abs(ringing) > RIGID * np.abs(s).max(initial=0.0)]
        locked = min(locked, float(vibrating.imag.min(initial=np.inf)) / (2 * np.pi))
    return locked if np.isfinite(locked) else np.nan


def eigenvalue_count(loop: tuple[LinearModel, Feedback], T: float, delay: float) -> int:
    """Return how many eigenvalues a loop with sample time T (s) has: `delay` (s) adds states of waiting commands."""
    model, feedback = loop
    longest = delay + (0.0 if feedback.late is None else feedback.late[1].max(initial=0.0))
    return len(model.A) + len(feedback.A) + int(np.ceil(longest / T)) * len(feedback.inputs)


def loop_eigenvalues(model: LinearModel, feedback: Feedback, T: float, delay: float) -> ComplexArray:
    """Eigenvalues (n,), no unit, of the loop from sample to sample, T (s) apart; `delay` of commands, s."""
    late = None if feedback.late is None else tuple(map(tuple, feedback.late))
    plant, y = _plant(model, feedback.inputs, feedback.outputs, late, T, delay)
    F = np.block([[plant.A + plant.B @ feedback.D @ y, plant.B @ feedback.C], [feedback.B @ y, feedback.A]])
    return np.asarray(np.linalg.eigvals(F), dtype=complex)


@lru_cache(maxsize=16)  # gains are sought for the same plants, of several configurations in turn
def _plant(
    model: LinearModel,
    inputs: tuple[str, ...],
    outputs: tuple[str, ...],
    late: tuple[tuple[float, ...], ...] | None,
    T: float,
    delay: float,
) -> tuple[SampledModel, Array]:
    """The sampled plant, and the readings of its states: those of a loop whatever its gains are."""
    columns, f = model.inputs(inputs), model.freedom
    read = [name if name in model.output_names else name.removesuffix("/rate") for name in outputs]
    is_rate, rows = np.array(read) != outputs, model.outputs(read)
    seen, felt = model.C[rows], model.D[rows]
    seen[is_rate, f:], seen[is_rate, :f], felt[is_rate] = seen[is_rate, :f], 0.0, 0.0
    lag, wait = np.zeros((2, len(columns))) if late is None else np.array(late)
    slow = np.flatnonzero(lag)
    A, B, n = model.A, model.B[:, columns], len(model.A)
    A = np.block([[A, B[:, slow]], [np.zeros((len(slow), n)), -np.diag(1.0 / lag[slow])]])
    B = np.vstack([np.where(lag > 0.0, 0.0, B), (np.eye(len(columns)) / np.where(lag > 0.0, lag, 1.0))[slow]])
    plant = sampled(A, B, T, delay + wait, with_last=bool(felt.any()))
    y = np.zeros((len(seen), len(plant.A)))
    y[:, :n] = seen
    if felt.any():  # accelerations under the voltages of slow amplifiers, or the command that acts until the sample
        places = plant.last.copy()
        places[slow] = n + np.arange(len(slow))
        y[:, places] = felt[:, columns]
    return plant, y


def margins(loops: Loops, T: float, delay: float) -> Margins:
    """The worst stability margins of a loop in several configurations, with sample time T and `delay`, s.

    Gains are tried down to a hundredth and up to 10⁴ times, delays up to 50 samples.
    """

    def radius(factor: float, more: float) -> float:
        return max(spectral_radius(model, of.times(factor), T, delay + more) for model, of in loops)

    now = radius(1.0, 0.0)
    if max(eigenvalue_count(loop, T, delay) for loop in loops) > FEW:
        return Margins(now, np.nan, np.nan if now <= STABLE else 0.0)
    if now > STABLE:
        factors = np.geomspace(1.0, 1e-2, GRID)
        return Margins(now, _last_before(lambda c: radius(c, 0.0) <= STABLE, factors, missing=0.0), 0.0)
    gain = _last_before(lambda c: radius(c, 0.0) > STABLE, np.geomspace(1.0, 1e4, GRID), missing=np.inf)
    waits = np.append(0.0, T * np.geomspace(0.01, 50.0, GRID))
    return Margins(now, gain, _last_before(lambda d: radius(1.0, d) > STABLE, waits, missing=np.inf))


def _last_before(changed: Callable[[float], bool], values: Array, missing: float) -> float:
    """Where on the way along `values` a condition first changes, by bisection; `missing` where it never does."""
    before = float(values[0])
    for after in map(float, values[1:]):
        if changed(after):
            while abs(after - before) > 1e-3 * max(abs(before), abs(after)):
                middle = 0.5 * (before + after)
                before, after = (before, middle) if changed(middle) else (middle, after)
            return 0.5 * (before + after)
        before = after
    return missing


FRACTION = 1 / 3  # of the lowest frequency with locked motors
SAMPLES = 30  # a period of the bandwidth, at least
SPARE = 2.0  # by which suggested gains may grow
NARROW = 1.5  # gain margin below which a loop may be unstable elsewhere on the path
SAMPLE_TIMES = (1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5)  # s
LIGHT = 0.02  # of the inertia with rigid links, below which the root of a link has none


@struct
class Suggestion:
    """PD gains to start with, by joint, N·m/rad and N·m·s/rad (N/m, N·s/m), for a `bandwidth` in Hz."""

    proportional: Mapping[str, float]
    derivative: Mapping[str, float]
    bandwidth: float

    def in_words(self) -> str:
        """The gains as keys of a scene file."""
        P, D = (
            ", ".join(f"{toml_key(name)} = {value:.2g}" for name, value in of.items())
            for of in (self.proportional, self.derivative)
        )
        return f"proportional = {{ {P} }}, derivative = {{ {D} }} (bandwidth {self.bandwidth:.2g} Hz)"


def joint_inertia(model: LinearModel) -> Array | None:
    """The inertia (motors, motors), kg·m² or kg, with links and gears rigid, rotors included.

    None unless motors are coordinates.
    """
    names = model.state_names[: model.freedom]
    T = np.zeros((model.freedom, len(model.motors)))
    for k, motor in enumerate(model.motors):
        for name in (motor, motor.replace("joint/", "motor/", 1)):
            if name in names:
                T[names.index(name), k] = 1.0
    return T.T @ model.mass @ T if np.all(T.any(axis=0)) else None


def suggested_gains(
    models: Sequence[LinearModel],
    T: float,
    delay: float = 0.0,
    side: Literal["joint", "motor"] = "joint",
    most_times: int = 20,
) -> Suggestion | None:
    """PD gains for all motors to start with, for sample time T and `delay`, s; None where none are found.

    P = J ω² and D = 2 J ω, critical damping of the inertia J of each joint with rigid links and other joints locked,
    the largest of the `models`. ω is a third of the lowest frequency with locked motors (at most half: Craig,
    Introduction to Robotics, sec. 9.9), with at least 30 samples a period. It is reduced, in `most_times` trials, until
    the sampled loops of all models are stable with twice the gains.
    """
    inertias = [joint_inertia(model) for model in models]
    known = [np.diag(inertia) for inertia in inertias if inertia is not None]
    if len(known) < len(models) or not known[0].size:
        return None
    J = np.max(known, axis=0)
    lowest = min((locked_frequencies(model).min(initial=np.inf) for model in models), default=np.inf)
    omega = 2 * np.pi * min(FRACTION * lowest, 1 / (SAMPLES * T))
    names = [name.removeprefix("joint/") for name in models[0].motors]
    for _ in range(most_times):
        P, D = ({n: float(f"{v:.2g}") for n, v in zip(names, of, strict=True)} for of in (J * omega**2, 2 * J * omega))
        if min(*P.values(), *D.values()) < SMALLEST:
            return None  # no scene may have such gains
        record = JointPid(kind="joint-pid", proportional=P, derivative=D, side=side)
        twice = joint_gains(models[0], [record], T).times(SPARE)
        if all(spectral_radius(model, g, T, delay) <= STABLE for model in models for g in (twice, twice.times(0.5))):
            return Suggestion(P, D, float(omega / (2 * np.pi)))
        omega *= 0.7
    return None


def unhurried_gains(models: Sequence[LinearModel]) -> tuple[Suggestion, float] | None:
    """Gains for a third of the lowest frequency with locked motors, and the longest sample time (s) for them.

    It is of a 1-2-5 series from 10 ms down to 10 µs, without delay; None if the robot does not bend, or no
    gains are found.
    """
    lowest = min(locked_frequencies(model).min(initial=np.inf) for model in models)
    for T in SAMPLE_TIMES if np.isfinite(lowest) else ():
        if FRACTION * lowest * SAMPLES * T <= 1.001 and (found := suggested_gains(models, T, most_times=1)) is not None:
            return found, T
    return None


def light_roots(models: Sequence[LinearModel]) -> list[str]:
    """Joints where a torque first turns the root of a bending link, which has hardly any inertia, not the link.

    The inertia that a sudden torque accelerates is small there against that with rigid links.
    """
    found: dict[str, None] = {}
    for model in models:
        rigid = joint_inertia(model)
        for k, name in enumerate(model.motors):
            if rigid is None or name not in model.output_names:
                continue
            rate = model.C[model.outputs(name)[0], : model.freedom] @ model.B[model.freedom :, model.inputs(name)[0]]
            alone = 1 / np.linalg.inv(rigid)[k, k]
            if rate * alone * LIGHT > 1.0:
                found[name.removeprefix("joint/")] = None
    return list(found)


def advice(loops: Loops, records: Sequence[JointPid], T: float, delay: float, found: Margins) -> list[str]:
    """Explain why a loop with sample time T and `delay`, s, is not stable, a text each, by the margins `found`.

    It suggests gains if `records` of joint PID controllers are all controllers.
    """
    if np.isnan(found.gain):
        return [f"margins, and gains to start with, are not computed for a delay of {delay / T:.4g} samples"]
    models = [model for model, _ in loops]
    texts = []
    if found.is_stable and found.gain < NARROW:
        texts.append(
            f"the linear model of the loop is hardly stable at start, middle and end of the path (gains may grow"
            f" {found.gain:.3g}-fold), and may not be between: smaller gains, or a shorter sample_time or delay"
        )
    elif found.is_stable:
        texts.append(
            "the linear model of the loop is stable, so limits of motors, a disturbance or the size of the motion drive"
            " it away: smaller steps of the path, or motors with higher limits"
        )
    elif records:
        faster = joint_gains(models[0], records, T / 10)
        if max(spectral_radius(model, faster, T / 10, delay / 10) for model in models) <= STABLE:
            texts.append(
                f"the loop is stable with a tenth of sample_time{' and delay' if delay else ''}: sampling every {T:g} s"
                " is too slow for these gains"
            )
    if 0.0 < found.gain < 1.0:
        texts.append(f"gains too high: times {found.gain:.2g} they are at the bound of stability")
    if light := light_roots(models):
        texts.append(
            f"{', '.join(light)}: negligible rotor_inertia at the joint, so that a torque turns the root of the"
            " link at once: specify the inertia of the rotor (or hub)"
        )
    if not records:
        return texts
    if (suggestion := suggested_gains(models, T, delay, records[0].side)) is not None:
        texts.append(f"start with {suggestion.in_words()}")
    else:
        texts.append(
            "no joint PD gains are stable at this sample_time and delay: damping of the links, or faster sampling"
        )
    return texts
