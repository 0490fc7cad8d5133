"""Gains for joint PD controllers to start with, and why a loop is not stable: by the linear model.

The rule is that of flexible structures in general: a bandwidth well below the lowest vibration with held motors, at
most half of it by Craig (Introduction to Robotics, sec. 9.9), and critical damping of what the motor then moves, the
rigid robot. The sampled model has the last word (see `margins`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...common.arrays import Array, as_floats
from .linear_model import LinearModel
from .margins import STABLE, Margins, joint_gains, motor_inputs, spectral_radius
from .modes import locked_frequencies
from .records import JointPid

FRACTION = 1 / 3  # of the lowest frequency with held motors
SAMPLES = 30  # a period of the bandwidth, at least
SPARE = 2.0  # by which suggested gains may grow
NARROW = 1.5  # gain margin below which a loop that is stable at some places of the path may well not be at others
SMALLER, MOST_TIMES = 0.7, 20  # the bandwidth is made smaller by this factor, so often at most
SAMPLE_TIMES = (1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5)  # s
LIGHT = 0.02  # of the inertia with rigid links: what a joint feels at once, below which its root has no inertia


@dataclass(frozen=True)
class Suggestion:
    """PD gains to start with, by joint, N·m/rad and N·m·s/rad (N/m, N·s/m), for a `bandwidth` in Hz."""

    proportional: Mapping[str, float]
    derivative: Mapping[str, float]
    bandwidth: float

    def in_words(self) -> str:
        """As keys of a scene file."""
        P, D = (
            ", ".join(f"{name} = {value:.2g}" for name, value in of.items())
            for of in (self.proportional, self.derivative)
        )
        return f"proportional = {{ {P} }}, derivative = {{ {D} }} (bandwidth {self.bandwidth:.2g} Hz)"


def joint_inertia(model: LinearModel) -> Array | None:
    """(motors, motors) with rigid links and gears, rotors included; None where motors are no coordinates of the model.

    With compliant gears, the motor's angle and the joint's move as one.
    """
    names = model.state_names[: model.freedom]
    motors = [model.input_names[k] for k in motor_inputs(model)]
    T = np.zeros((model.freedom, len(motors)))
    for k, motor in enumerate(motors):
        for name in (motor, motor.replace("joint/", "motor/", 1)):
            if name in names:
                T[names.index(name), k] = 1.0
    return as_floats(T.T @ model.mass @ T) if np.all(T.any(axis=0)) else None


def suggested_gains(
    models: Sequence[LinearModel], T: float, delay: float = 0.0, side: Literal["joint", "motor"] = "joint"
) -> Suggestion | None:
    """PD gains for all motors to start with; None where none are found.

    P = J ω² and D = 2 J ω, critical damping of the inertia J of each joint with rigid links and the other joints held,
    the largest of the `models`. ω is a third of the lowest frequency with held motors, with 30 samples a period at
    least, and is made smaller until the sampled loops of all models stay stable with twice the gains.
    """
    inertias = [joint_inertia(model) for model in models]
    known = [np.diag(inertia) for inertia in inertias if inertia is not None]
    if len(known) < len(models) or not known[0].size:
        return None
    J = np.max(known, axis=0)
    lowest = min((locked_frequencies(model).min(initial=np.inf) for model in models), default=np.inf)
    omega = 2 * np.pi * min(FRACTION * lowest, 1 / (SAMPLES * T))
    names = [models[0].input_names[k].removeprefix("joint/") for k in motor_inputs(models[0])]
    for _ in range(MOST_TIMES):
        P, D = ({n: _two_digits(v) for n, v in zip(names, of, strict=True)} for of in (J * omega**2, 2 * J * omega))
        record = JointPid(kind="joint-pid", proportional=P, derivative=D, side=side)
        twice = joint_gains(models[0], [record]).times(SPARE)
        if all(spectral_radius(model, g, T, delay) <= STABLE for model in models for g in (twice, twice.times(0.5))):
            return Suggestion(P, D, float(omega / (2 * np.pi)))
        omega *= SMALLER
    return None


def unhurried_gains(models: Sequence[LinearModel]) -> tuple[Suggestion, float] | None:
    """Gains for the whole third of the lowest frequency with held motors, and the longest sample time (s) for them.

    Of a 1-2-5 series from 10 ms down to 10 µs, without delay; None of a robot that does not bend, or without such one.
    """
    lowest = min(locked_frequencies(model).min(initial=np.inf) for model in models)
    for T in SAMPLE_TIMES if np.isfinite(lowest) else ():
        found = suggested_gains(models, T)
        if found is not None and found.bandwidth > 0.999 * FRACTION * lowest:
            return found, T
    return None


def light_roots(models: Sequence[LinearModel]) -> list[str]:
    """Joints that feel hardly any inertia at once: a moment turns the root of a bending link, not the link.

    1/(c M⁻¹ b) of the whole model against the joint's inertia with rigid links.
    """
    found: dict[str, None] = {}
    for model in models:
        rigid = joint_inertia(model)
        for k, column in enumerate(motor_inputs(model)):
            name = model.input_names[column]
            if rigid is None or name not in model.output_names:
                continue
            rate = model.C[model.outputs(name)[0], : model.freedom] @ model.B[model.freedom :, column]
            alone = 1 / np.linalg.inv(rigid)[k, k]
            if rate * alone * LIGHT > 1.0:
                found[name.removeprefix("joint/")] = None
    return list(found)


def advice(
    models: Sequence[LinearModel], records: Sequence[JointPid], T: float, delay: float, found: Margins
) -> list[str]:
    """Why a loop of joint PID controllers that is not stable is so, and gains to start with."""
    gains = joint_gains(models[0], records)
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
    elif max(spectral_radius(model, gains, T / 10, delay / 10) for model in models) <= STABLE:
        texts.append(
            f"the loop is stable with a tenth of sample_time{' and delay' if delay else ''}: sampling every {T:g} s is"
            " too slow for these gains"
        )
    if 0.0 < found.gain < 1.0:
        texts.append(f"gains too high: times {found.gain:.2g} they are at the bound of stability")
    if light := light_roots(models):
        texts.append(
            f"{', '.join(light)}: negligible rotor_inertia at the joint, so that a torque turns the root of the"
            " link at once: specify the inertia of the rotor (or hub)"
        )
    if (suggestion := suggested_gains(models, T, delay, records[0].side)) is not None:
        texts.append(f"start with {suggestion.in_words()}")
    else:
        texts.append(
            "no joint PD gains are stable at this sample_time and delay: damping of the links, or faster sampling"
        )
    return texts


def _two_digits(value: float) -> float:
    return float(f"{value:.2g}")
