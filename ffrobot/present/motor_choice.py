"""What joints have to do by a results file, and the table of motors from a catalog that can do it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from rich.console import Console

from ..actuation.catalog import Choice, JointTask, choices, read_catalog
from ..common.arrays import Array
from ..common.errors import InputError, quoted
from ..results.file import Results
from .lines import print_table

SHOWN = 3  # motors of each joint
NOTHING = 1e-9  # of what a motor can do: less is rounding
COLUMNS = ("motor of", "choice", "ratio", "RMS (N·m)", "of rated", "peak (N·m)", "of peak", "speed (rad/s)", "of max")


def print_motor_choice(path: Path, catalog: Path, analysis: str | None, console: Console) -> None:
    """The best motors of each joint for each analysis; the nearest one where none fits.

    Raises `InputError` where the catalog is wrong or no analysis has motors.
    """
    motors = read_catalog(catalog)
    with Results(path) as results:
        tasks = {name: dict(joint_tasks(results, name)) for name in results.analyses}
    judged = [name for name, found in tasks.items() if found]
    wanted = judged if analysis is None else [analysis]
    if not wanted or not set(wanted) <= set(judged):
        raise InputError(f"{path}: --analysis: expected an analysis with motors, {quoted(judged)}, found {analysis}")
    for name in wanted:
        console.print(f'analysis "{name}", motors of {catalog}', soft_wrap=True)
        rows = (row for joint, task in tasks[name].items() for row in _rows(joint, choices(task, motors)))
        print_table(console, COLUMNS, rows)
    console.print("at the motor, with its own rotor; solve again with its gear_ratio and rotor_inertia to confirm")


def _rows(joint: str, found: Sequence[Choice]) -> Iterator[tuple[str, ...]]:
    fitting = [choice for choice in found if choice.fits]
    for k, choice in enumerate(fitting[:SHOWN] or found[:1]):
        name = choice.motor.name if choice.fits else f"none; nearest: {choice.motor.name}"
        values = (choice.rms, choice.peak, choice.speed)
        used = [value if share > NOTHING else 0.0 for value, share in zip(values, choice.shares, strict=True)]
        pairs = zip((f"{value:.3g}" for value in used), (f"{100 * x:.0f} %" for x in choice.shares), strict=True)
        yield ("" if k else joint, name, f"{choice.ratio:g}", *(cell for pair in pairs for cell in pair))


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
