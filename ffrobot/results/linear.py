"""What linear analyses and placements leave in a results file, and the way back to a model."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from ..actuation.control.linear_analysis import LinearAnalysis
from ..actuation.control.linear_model import LinearModel, save_arrays
from ..actuation.control.placement import Placed
from ..actuation.control.zeros import Zeros
from ..common.arrays import Array
from ..common.errors import InputError
from ..common.validation import quoted
from ..mbs.analysis.analyses import Outcome
from .file import Results

MATRICES = ("A", "B", "C", "D", "mass", "transformation")
NAMES = ("state_names", "input_names", "output_names")


def write_linear(group: h5py.Group, linear: LinearAnalysis, outcome: Outcome) -> None:
    """Models (T, …), poles, frequencies, shapes of all bodies, reach and zeros."""
    for key in MATRICES:
        group[key] = np.array([getattr(model, key) for model in linear.models])
    for key in NAMES:
        group.attrs[key] = list(getattr(linear.models[0], key))
    group["frequency"] = np.array([modes.frequency for modes in linear.modes])
    group["damping_ratio"] = np.array([modes.damping_ratio for modes in linear.modes])
    poles = np.array([modes.poles.ravel() for modes in linear.modes])
    group["pole"] = np.stack([poles.real, poles.imag], axis=-1)
    group["pole"].attrs["columns"] = ["real", "imaginary"]
    for kind, reaches in (("controllability", linear.controllable), ("observability", linear.observable)):
        group[kind] = np.array([reach.measure for reach in reaches])
        group[kind].attrs["lost"] = sorted({name for reach in reaches for name in reach.lost})
    motion = np.array([modes.motion.real for modes in linear.modes])  # (T, f, coordinates)
    for body in outcome.assembly.model.links:
        columns = motion[:, :, outcome.coordinates(body.name)]
        group[f"modes/{body.name}/position"] = columns[:, :, :2]
        group[f"modes/{body.name}/angle"] = columns[:, :, 2]
        group[f"modes/{body.name}/modal"] = columns[:, :, 3:] @ body.modal_transform.T
    for k, (pair, found) in enumerate(linear.zeros.items(), 1):
        _write_zeros(group, f"zeros/{k}", pair, found)


def _write_zeros(group: h5py.Group, name: str, pair: tuple[str, ...], found: tuple[Zeros, ...]) -> None:
    """(T, most, 2), nan where there are fewer."""
    values = np.full((len(found), max(len(zeros.values) for zeros in found), 2), np.nan)
    for row, zeros in zip(values, found, strict=True):
        row[: len(zeros.values)] = np.column_stack([zeros.values.real, zeros.values.imag])
    dataset, half = group.create_dataset(name, data=values), len(pair) // 2
    dataset.attrs["columns"] = ["real", "imaginary"]
    dataset.attrs["inputs"], dataset.attrs["outputs"] = list(pair[:half]), list(pair[half:])
    dataset.attrs["minimum_phase"] = [zeros.minimum_phase for zeros in found]


def write_placement(group: h5py.Group, placed: Placed) -> None:
    """The patches found and those spread evenly, what each reaches, and what one patch would reach anywhere."""
    group.attrs.update({"body": placed.wanted.body, "criterion": placed.wanted.criterion})
    group.attrs.update({"measure": placed.wanted.measure, "sets": placed.sets, "method": placed.method})
    for key, found in (("best", placed.best), ("even", placed.even)):
        for name, values in vars(found).items():
            group[f"{key}/{name}"] = values
    for key in ("frequency", "share", "largest_voltage", "candidates", "candidate_reach"):
        group[key] = getattr(placed, key)


def read_linear(results: Results, analysis: str) -> tuple[LinearModel, ...]:
    """The linear models of an analysis. Raises `InputError` where it has none."""
    group = f"{analysis}/linear"
    if not results.has(group):
        known = [name for name in results.analyses if results.has(f"{name}/linear")]
        raise InputError(f'{results.path}: expected a linear analysis ({quoted(known)}), found "{analysis}"')
    attributes = results.attributes(group)
    matrices = [results[f"{group}/{key}"] for key in MATRICES]
    states, inputs, outputs = (tuple(str(name) for name in attributes[key]) for key in NAMES)
    time = results.time(analysis)
    models = []
    for k, t in enumerate(time):
        A, B, C, D, mass, transformation = (values[k] for values in matrices)
        models.append(LinearModel(A, B, C, D, states, inputs, outputs, float(t), mass, transformation))
    return tuple(models)


def export_linear(results_path: Path, analysis: str | None, path: Path) -> str:
    """Write the linear models of an analysis (the first with one, if not named) to .npz or .mat; returns its name.

    One model as it is; several with a first axis over their times.
    """
    with Results(results_path) as results:
        if analysis is None:
            known = [name for name in results.analyses if results.has(f"{name}/linear")]
            if not known:
                raise InputError(f'{results_path}: expected an analysis of kind = "linear", found none')
            analysis = known[0]
        models = read_linear(results, analysis)
    if len(models) == 1:
        models[0].save(path)
    else:
        arrays = models[0].arrays()
        stacked: dict[str, Array] = {
            key: np.array([getattr(model, key) for model in models]) for key in (*MATRICES, "time")
        }
        save_arrays(arrays | stacked, path)
    return analysis
