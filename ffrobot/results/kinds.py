"""What results files have of a single kind of analysis: how it is written and read, and what the verdict says of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from ..common.arrays import Array, ComplexArray
from ..common.hdf5 import fields_in
from ..common.meanings import names_of, write_record
from ..common.structs import struct
from ..mbs.quantities.motion import body_motion, joint_motion, modal_rates, reported_points
from ..mbs.quantities.supply import actuator_forces
from .verdict import millimeters

if TYPE_CHECKING:  # most scenes have none of these
    from ..actuation.control.linear import LinearModels
    from ..actuation.control.linear_model import LinearModel, SampledController, StateSpace
    from ..actuation.control.loop import LoopRecord
    from ..actuation.control.placement import Placed
    from ..actuation.feasibility import Unsupplied
    from ..actuation.motors import MotorFeasibility
    from ..mbs.analysis.operating_points import RobotAtRest
    from ..mbs.inversion.motors_only import AroundPath
    from ..mbs.linear.joint_conditions import RobotModes
    from ..mbs.run.record import Run
    from ..mbs.tracking.tracking import TrackedPath

MATRICES = names_of("LinearModel")
NAMES = ("state_names", "input_names", "output_names")
LISTED = 3  # natural frequencies


def write_linear(group: h5py.Group, run: Run, linear: LinearModels) -> None:
    """Write linear/ of an analysis, and its joint conditions.

    Models (T, …), poles, frequencies, shapes of all bodies, controllability. Zeros (T, zeros, 2), 1/s, are real and
    imaginary parts, NaN where an instant has fewer.
    """
    n_v, models = run.model.tree.n_v, linear.models
    write_joint_conditions(group, run, linear)
    if run.space.is_plane:
        models = tuple(
            replace(model, transformation=_of_frames(run, k) @ model.transformation[:n_v])
            for k, model in enumerate(models)
        )
    group = group.create_group("linear")
    for key in MATRICES:
        group[key] = np.array([getattr(model, key) for model in models])
    for key in NAMES:
        group.attrs[key] = list(getattr(models[0], key))
    _write_modes(group, run, linear.modes)
    _write_poles(group, np.array([modes.poles.ravel() for modes in linear.modes]))
    for kind, reaches in (("controllability", linear.controllable), ("observability", linear.observable)):
        group[kind] = np.array([reach.measure for reach in reaches])
        group[kind].attrs["lost"] = sorted({name for reach in reaches for name in reach.lost})
    group.attrs["advice"] = linear.advice
    for k, (pair, every) in enumerate(linear.zeros.items(), 1):
        values = np.full((len(every), max(len(zeros.values) for zeros in every), 2), np.nan)
        for row, zeros in zip(values, every, strict=True):
            row[: len(zeros.values)] = np.column_stack([zeros.values.real, zeros.values.imag])
        dataset, half = group.create_dataset(f"zeros/{k}", data=values), len(pair) // 2
        dataset.attrs.update(columns=["real", "imaginary"], inputs=list(pair[:half]), outputs=list(pair[half:]))
        dataset.attrs["minimum_phase"] = [zeros.minimum_phase for zeros in every]


def write_joint_conditions(group: h5py.Group, run: Run, details: LinearModels | RobotAtRest) -> None:
    """Write joints_locked/ and joints_compliant/ of an analysis: frequencies, modes, compliance."""
    for condition in details.conditions[0]:
        states, own = [at[condition] for at in details.conditions], group.create_group(f"joints_{condition}")
        _write_modes(own, run, [one.modes for one in states])
        for point in states[0].compliance:
            own[f"compliance/{point}"] = np.array([one.compliance[point] for one in states])


def at_rest_in_words(group: h5py.Group) -> str:
    """Natural frequencies with motors at rest and the least stiffness, at the first time of an analysis, as text."""
    if not any(key.startswith("joints_") for key in group):
        return ""
    from ..mbs.linear.joint_conditions import COMPLIANT, LOCKED, translational_stiffness

    texts = []
    for condition, name in ((LOCKED, "joints locked"), (COMPLIANT, "compliant gears")):
        if (state := group.get(f"joints_{condition}")) is None:
            continue
        frequency = state["frequency"][0]
        lowest = ", ".join(f"{f:.4g}" for f in frequency[frequency > 0.0][:LISTED])
        least = [
            (stiffness.least, point)
            for point, C in state.get("compliance", {}).items()
            if (stiffness := translational_stiffness(C[0])) is not None and np.isfinite(stiffness.least)
        ]
        of_point = f"; least stiffness {min(least)[0] / 1e3:.4g} N/mm at {min(least)[1]}" if least else ""
        texts.append(f"{name} {lowest} Hz{of_point}" if lowest else f"{name}: rigid")
    return "; ".join(texts)


def _write_modes(group: h5py.Group, run: Run, modes: Sequence[RobotModes]) -> None:
    """Frequencies, damping ratios, and modes/: displacement, turn and modal coordinates of bodies."""
    group["frequency"] = np.array([one.frequency for one in modes])
    group["damping_ratio"] = np.array([one.damping_ratio for one in modes])
    # (T, f, n_v) rates by modes; motors behind gears come last
    along_v = np.array([one.motion.real for one in modes])[:, :, : run.model.tree.n_v]
    T, f, n_v = along_v.shape
    moving = replace(run, time=np.repeat(run.time, f), q=np.repeat(run.q, f, 0), v=along_v.reshape(T * f, n_v))
    space, turning = run.space, "angle" if run.space.is_plane else "rotation"
    for name in reported_points(run) if T * f else ():
        body = body_motion(moving, name)
        rates = {"position": space.along(body.velocity), turning: space.about(body.angular_velocity)}
        rates["modal"] = body.modal_velocity
        for key, values in rates.items():
            group[f"modes/{name}/{key}"] = values.reshape(T, f, *values.shape[1:])


def _of_frames(run: Run, row: int) -> Array:
    """(coordinates, n_v) rates of place, angle and modes of each body that moves in the plane, by v."""
    n_v, space = run.model.tree.n_v, run.space
    moving = replace(run, time=np.repeat(run.time[row], n_v), q=np.repeat(run.q[row : row + 1], n_v, 0), v=np.eye(n_v))
    rates = []
    for name in reported_points(run):
        body = body_motion(moving, name)
        turn = space.about(body.angular_velocity)
        rates += [space.along(body.velocity).T, turn[None], modal_rates(moving, name).T]
    return np.concatenate(rates)


def write_zero_dynamics(group: h5py.Group, _: Run, around: AroundPath) -> None:
    """Write zero_dynamics/ of an analysis with motors only."""
    from ..mbs.inversion.motors_only import is_minimum_phase

    entry, inversion = group.create_group("zero_dynamics"), around.inversion
    assert inversion is not None
    linear = inversion.linearisation
    entry["time"] = linear.times
    entry["zeros"] = np.stack([linear.zeros.real, linear.zeros.imag], axis=2)
    entry.attrs.update(columns=["real", "imaginary"], factor=inversion.servo.factor)
    entry.attrs.update(unmet_force=inversion.unmet, off_rest=inversion.off_rest)
    entry.attrs["minimum_phase"] = is_minimum_phase(linear)


def write_placement(group: h5py.Group, _: Run, placed: Placed) -> None:
    """Write placement/ of an analysis: control of modes by optimum and evenly spaced patches, or one patch anywhere."""
    group, wanted = group.create_group("placement"), placed.wanted
    group.attrs.update(body=wanted.body, criterion=wanted.criterion, measure=wanted.measure)
    write_record(group, placed)
    write_record(group.create_group("best"), placed.best)
    write_record(group.create_group("even"), placed.even)


def write_tracking(group: h5py.Group, run: Run, tracked: TrackedPath) -> None:
    """Write tracking/ of an analysis: errors and effort.

    Also work (J) and largest power (W) of motors and of patches, least voltage for each zero (V), decrease of the
    objective per unit of each limit.
    """
    group = group.create_group("tracking")
    write_record(group, tracked)
    for kind, prices in tracked.prices.items():
        for name, values in prices.items():
            if kind in ("voltage", "torque") or values.any():
                group[f"{kind}_price/{name}"] = values
    if (bounds := tracked.bounds) is not None:
        group["bound/voltage"], group["bound/time"] = bounds.voltages, bounds.times
        group["bound/zero"] = np.stack([bounds.zeros.real, bounds.zeros.imag], axis=1)
    forces, motors, patches = actuator_forces(run), np.zeros_like(run.time), np.zeros_like(run.time)
    assert forces is not None
    for joint, moments in forces.moments.items():
        of_joint = joint_motion(run, joint)
        assert of_joint is not None
        motors = motors + (moments * of_joint[1]).sum(axis=1)
    for body, F_p in forces.modal.items():
        patches = patches + (F_p * body_motion(run, body).modal_velocity).sum(axis=1)
    for name, power in (("motor", motors), ("patch", patches)):
        group.attrs[f"{name}_work"] = float(np.diff(run.time) @ (power[1:] + power[:-1]) / 2)
        group.attrs[f"{name}_power"] = float(np.abs(power).max(initial=0.0))


def read_motors(group: h5py.Group, joints: Sequence[str]) -> dict[str, MotorFeasibility]:
    """Read requirements and limits of motors from feasibility/ of an analysis, in the order of `joints`."""
    from ..actuation.motors import MotorFeasibility

    about = {name: group["joints"][name].attrs for name in joints if f"joints/{name}" in group}
    return {name: MotorFeasibility(**fields_in(of, MotorFeasibility)) for name, of in about.items()}


def read_unsupplied(group: h5py.Group) -> Unsupplied | None:
    """Read the forces that neither motors nor patches supply, from feasibility/; None if there are none."""
    if "unsupplied" not in group:
        return None
    from ..actuation.feasibility import Unsupplied

    attributes = fields_in(group["unsupplied"].attrs, Unsupplied).items()
    about: dict[str, Any] = {key: tuple(value) if np.ndim(value) else value for key, value in attributes}
    return Unsupplied(**about)


def read_controllers(file: h5py.File, analysis: str) -> tuple[SampledController, ...]:
    """The linear discrete-time controllers of a closed loop, one for each instant of their schedule."""
    from ..actuation.control.linear_model import SampledController

    group, time = file[f"{analysis}/control/controller"], file[f"{analysis}/control/time"]
    times = group["time"][()] if "time" in group else time[:1]
    along = (np.reshape(group[key], (len(times), *group[key].shape[-2:])) for key in "ABCD")
    common: dict[str, Any] = {
        "state_names": tuple(f"state/{k}" for k in range(1, group["A"].shape[-1] + 1)),
        "input_names": tuple(group.attrs["inputs"]),
        "output_names": tuple(group.attrs["outputs"]),
        "sample_time": float((time[-1] - time[0]) / (len(time) - 1)),
    }
    return tuple(
        SampledController(**common | dict(zip("ABCD", matrices, strict=True)), time=float(t))
        for t, *matrices in zip(times, *along, strict=True)
    )


def read_linear(file: h5py.File, analysis: str) -> tuple[LinearModel, ...]:
    """The linear models of an analysis with linear/, one for each of its times."""
    from ..actuation.control.linear_model import LinearModel

    group, time = file[f"{analysis}/linear"], file[f"{analysis}/time"][()]
    names: dict[str, Any] = {key: tuple(str(name) for name in group.attrs[key]) for key in NAMES}
    return tuple(
        LinearModel(**names | {key: np.asarray(group[key][k], dtype=float) for key in MATRICES}, time=float(t))
        for k, t in enumerate(time)
    )


def save_models(models: Sequence[StateSpace], path: Path) -> None:
    """Write models to a file .npz or .mat; arrays of several have a first axis over their times."""
    if len(models) == 1:
        models[0].save(path)
        return
    from ..actuation.control.linear_model import save_arrays

    first, every = models[0].arrays(), [model.arrays() for model in models]
    along = (key for key, value in first.items() if isinstance(value, np.ndarray) or key == "time")
    save_arrays(first | {key: np.array([of[key] for of in every]) for key in along}, path)


def write_loop(group: h5py.Group, _: Run, record: LoopRecord) -> None:
    """Write tip_error and control/ of a closed loop: samples, and metrics and names as attributes."""
    metrics, error = record.metrics, group.create_dataset("tip_error", data=record.tip_error)
    error.attrs.update(peak=metrics.tip_error_max, peak_time=record.tip_error_peak_time, rms=metrics.tip_error_rms)
    group = group.create_group("control")
    write_record(group, record)
    write_record(group, metrics)
    for key in ("inputs", "outputs", "warnings", "advice"):
        group.attrs[key] = list(getattr(record, key))
    if record.feedback:
        laws = list(record.feedback.values())
        for key in "ABCD":
            every = np.array([getattr(of, key) for of in laws])
            group[f"controller/{key}"] = every if len(laws) > 1 else every[0]
        if len(laws) > 1:
            group["controller/time"] = list(record.feedback)
        group["controller"].attrs.update(inputs=list(laws[0].outputs), outputs=list(laws[0].inputs))
    if record.poles is not None:
        _write_poles(group, _by_size(record.poles))
    if (margins := record.margins) is not None:
        group.attrs.update(spectral_radius=margins.radius, gain_margin=margins.gain, delay_margin=margins.delay)
    if (estimate := record.estimate) is not None:
        group = group.create_group("estimate")
        for name, values in zip(estimate.names, estimate.values.T, strict=True):
            if not name.startswith("point/"):
                group[f"rate/{name.removesuffix('/rate')}" if name.endswith("/rate") else name] = values
        if estimate.position.size:  # of the tip also its standard deviation and its distance from the truth
            for key in ("position", "error", "sigma"):
                group[f"points/{estimate.tip}/{key}"] = getattr(estimate, key)
        group.attrs.update(nees=estimate.nees, inside=estimate.inside)
        _write_poles(group, _by_size(estimate.poles))


def _by_size(poles: ComplexArray) -> ComplexArray:
    """Those (k,) of a sampled loop, the smallest first, in an order that round-off does not change."""
    from ..actuation.control.zeros import by_side

    return poles[by_side(poles, np.zeros(len(poles)))]


def _write_poles(group: h5py.Group, poles: ComplexArray) -> None:
    group["pole"] = np.stack([poles.real, poles.imag], axis=-1)
    group["pole"].attrs["columns"] = ["real", "imaginary"]


About = Mapping[str, Any]


@struct
class OwnResults:
    """How results that only one kind of analysis has are written and judged."""

    # name of their group in the group of the analysis; "" without one. Its attribute `advice` names remedies
    part: str = ""
    # writes details to the group of an analysis; by default their fields to `part`
    write: Callable[[h5py.Group, Run, Any], object] | None = None
    # text of the verdict by the attributes of `part`, in place of whether motors and patches suffice
    answer: Callable[[About], str] = lambda _: ""

    def about(self, group: h5py.Group) -> About:
        """Attributes of the group `part` of an analysis; {} without this group."""
        return group[self.part].attrs if self.part in group else {}


def _loop_verdict(about: About) -> str:
    at_limits = f", {100 * about['saturated']:.3g} % of the samples saturated" if about["saturated"] else ""
    most, rms = (millimeters(about[f"tip_error_{key}"]) for key in ("max", "rms"))
    is_settled = about["verdict"] == "stable" and np.isfinite(about["settling_time"])
    alone = "" if "spectral_radius" in about else ", by the run alone"
    verdict = "settled" if is_settled else about["verdict"]
    return f"loop {verdict}{alone}: tip off by {most} at most, {rms} RMS{at_limits}"


OF_KIND: Mapping[str, OwnResults] = {
    "static": OwnResults(write=write_joint_conditions),
    "linear": OwnResults("linear", write_linear),
    "placement": OwnResults(write=write_placement),
    "motors-only": OwnResults(write=write_zero_dynamics),
    "tracking": OwnResults("tracking", write_tracking),
    "closed-loop": OwnResults("control", write_loop, _loop_verdict),
}
"""Results of single kinds; others have none of their own."""


def own_results(group: h5py.Group) -> OwnResults:
    """How to write and judge results of the kind of the analysis with this group."""
    return OF_KIND.get(str(group.attrs["kind"]), OwnResults())
