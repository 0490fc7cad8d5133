"""Tables and lines of what concerns control: closed loops, linear models, placements."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from rich.table import Table

from ..actuation.control.linear import LinearModels
from ..actuation.control.loop_record import LoopRecord
from ..actuation.control.metrics import DEFINITIONS
from ..actuation.control.placement import Placed
from ..common.arrays import Array
from ..mbs.analysis.operating_points import RobotAtRest
from ..mbs.analysis.outcome import Details
from ..mbs.solve.joint_conditions import translational_stiffness
from .lines import LOOP_COLUMNS, loop_row, plain_table

FREQUENCIES = 5  # that are listed, and damping ratios
TRANSFERS = 3  # of one motor to one output, whose zeros are listed: those with the slowest to the right
UNDAMPED = 1e-9  # ratios below are rounding


def control_tables(details: Mapping[str, Details]) -> Iterator[Table]:
    """A table of each kind that was found, from what analyses found by name."""
    loops = [loop_row(name, found.metrics) for name, found in details.items() if isinstance(found, LoopRecord)]
    linear = [row for name, found in details.items() if isinstance(found, LinearModels) for row in _linear(name, found)]
    at_rest = [
        row
        for name, found in details.items()
        if isinstance(found, LinearModels | RobotAtRest)
        for row in _condition_rows(name, found)
    ]
    placements = [_placement(name, found) for name, found in details.items() if isinstance(found, Placed)]
    for columns, rows in (
        (LOOP_COLUMNS, loops),
        (LINEAR_COLUMNS, linear),
        (CONDITION_COLUMNS, at_rest),
        (PLACEMENT_COLUMNS, placements),
    ):
        if rows:
            table = plain_table(*columns)
            for row in rows:
                table.add_row(*row)
            yield table


LINEAR_COLUMNS = ("linear model", "t (s)", "DOF", "lowest frequencies (Hz)", "largest Re(pole)\n(1/s)")


def _linear(name: str, found: LinearModels) -> Iterator[tuple[str, ...]]:
    """Frequencies and growth at every time."""
    for model, modes in zip(found.models, found.modes, strict=True):
        vibrating = modes.frequency[modes.frequency > 0.0]
        lowest = ", ".join(f"{f:.4g}" for f in vibrating[:FREQUENCIES])
        yield name, f"{model.time:g}", f"{model.freedom}", lowest, f"{modes.growth:.3g}" if modes.growth else ""


CONDITION_COLUMNS = (
    "joints", "t (s)", "natural frequencies (Hz)", "at", "stiffness along axes\n(N/mm)", "least, along",
)  # fmt: skip


def _condition_rows(name: str, found: LinearModels | RobotAtRest) -> Iterator[tuple[str, ...]]:
    """Natural frequencies with motors at rest, and the stiffness of points, at every time."""
    for t, at in zip(found.times, found.conditions, strict=True):
        for condition, held in at.items():
            frequency = held.modes.frequency
            lowest = ", ".join(f"{f:.4g}" for f in frequency[frequency > 0.0][:FREQUENCIES]) or "none"
            label = (f"{name}: {condition}", f"{t:g}", lowest)
            for point, C in held.compliance.items():
                yield (*label, point, *_stiffness(C))
                label = ("", "", "")
            if not held.compliance:
                yield (*label, "", "", "")


def _stiffness(compliance: Array) -> tuple[str, str]:
    """Force over displacement along each axis, and the least of any direction, of a (3, 3) or (6, 6) compliance."""
    stiffness = translational_stiffness(compliance)
    if stiffness is None:
        return "0", ""
    along, least, direction = stiffness
    way = ", ".join(f"{x:g}" for x in np.round(direction, 2) + 0.0)
    return ", ".join(f"{k / 1e3:.4g}" for k in along), f"{least / 1e3:.4g} ({way})"


PLACEMENT_COLUMNS = ("placement", "on", "by", "optimum", "evenly spaced", "sets tried")


def _placement(name: str, placed: Placed) -> tuple[str, ...]:
    """The patches found against as many spread evenly: reach of modes, or the largest voltage of the path."""
    over_path = placed.wanted.criterion == "voltage"
    pair = placed.largest_voltage if over_path else (placed.best.value, placed.even.value)
    return (
        name,
        placed.wanted.body,
        "voltage" if over_path else f"{placed.wanted.measure} reach",
        *(f"{value:.4g}" + (" V" if over_path else "") for value in pair),
        f"{placed.sets}" + (" (evolution)" if placed.method == "evolution" else ""),
    )


def control_lines(details: Mapping[str, Details]) -> Iterator[str]:
    """Meaning of columns of closed loops, damping ratios, zeros, modes out of reach, places of patches: a line each."""
    loops = {name: found.metrics for name, found in details.items() if isinstance(found, LoopRecord)}
    if loops:
        yield f"closed-loop control: {DEFINITIONS}"
    for name, metrics in loops.items():
        if np.isfinite(metrics.lowest_frequency):
            yield f"{name}: vibration at {metrics.lowest_frequency:.3g} Hz and above"
    for name, found in details.items():
        if isinstance(found, LinearModels):
            yield from _damping(name, found)
            yield from _zeros_and_lost(name, found)
    for name, found in details.items():
        if isinstance(found, Placed):
            yield f"{name}: centers at {', '.join(f'{x:.4g}' for x in found.best.centers)} m"


def _damping(name: str, linear: LinearModels) -> Iterator[str]:
    """Of the frequencies that are listed for the first time of an analysis; nothing of a robot without damping."""
    modes = linear.modes[0]
    ratios = modes.damping_ratio[modes.frequency > 0.0][:FREQUENCIES]
    if np.any(np.abs(ratios) > UNDAMPED):
        listed = ", ".join(f"{ratio:.3g}" for ratio in ratios)
        yield f"{name}, t = {linear.models[0].time:g} s: damping ratios {listed}"


def _zeros_and_lost(name: str, linear: LinearModels) -> Iterator[str]:
    worst = {
        pair: next((zeros for zeros in found if not zeros.minimum_phase), found[0])
        for pair, found in linear.zeros.items()
    }
    alone = sorted((pair for pair in worst if len(pair) == 2), key=lambda pair: worst[pair].slowest)
    shown = [pair for pair in worst if len(pair) > 2 or pair in alone[:TRANSFERS]]
    for pair in shown:
        half = len(pair) // 2
        yield f"{name}: {', '.join(pair[:half])} → {', '.join(pair[half:])}: {worst[pair].describe()}"
    if len(worst) > len(shown):
        yield f"{name}: zeros of {len(worst) - len(shown)} more transfers are in the results file, linear/zeros"
    for verb, reaches in (
        ("uncontrollable:", linear.controllable), ("unobservable:", linear.observable)
    ):  # fmt: skip
        for model, reach in zip(linear.models, reaches, strict=True):
            if reach.lost:
                yield f"{name}, t = {model.time:g} s: {verb} {', '.join(reach.lost)}"
