"""What joints have to do, read from a results file, for a choice of motors."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..actuation.catalog import JointTask
from ..common.arrays import Array
from .file import Results


def joint_tasks(results: Results, analysis: str) -> Iterator[tuple[str, JointTask]]:
    """By joint with a motor of one coordinate, its load without the rotor that the scene has now.

    Accelerations are derivatives of a cubic spline through the rates at outputs. Peaks of the torque between outputs
    count: the load is scaled by their ratio to the largest output.
    """
    time = results[f"{analysis}/time"]
    for joint in results.scene.get("joint", ()):
        place = f"{analysis}/joints/{joint['name']}"
        if not (results.has(f"{place}/moment") and results[f"{place}/moment"].ndim == 1) or len(time) < 4:
            continue
        torque, rate = results[f"{place}/moment"], results[f"{place}/rate"]
        acceleration = _derivative(time, rate)
        rotor = joint.get("rotor_inertia", 0.0) * joint.get("gear_ratio", 1.0) ** 2
        between = _peak(results, f"{place}/moment") / max(float(np.abs(torque).max()), 1e-300)
        yield joint["name"], JointTask(time, max(between, 1.0) * (torque - rotor * acceleration), rate, acceleration)


def _derivative(time: Array, values: Array) -> Array:
    from scipy.interpolate import CubicSpline

    found: Array = CubicSpline(time, values)(time, 1)
    return found


def _peak(results: Results, dataset: str) -> float:
    """The largest absolute value, between outputs too where the file knows it."""
    return float(np.max(results.attributes(dataset).get("peak", np.abs(results[dataset]).max())))
