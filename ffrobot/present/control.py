"""Tables and lines of what concerns control: closed loops, linear models, placements."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
from rich.table import Table

from ..actuation.control.linear import LinearModels
from ..actuation.control.loop_record import LoopRecord
from ..actuation.control.metrics import DEFINITIONS
from ..actuation.control.placement import Placed
from ..common.arrays import Array
from ..mbs.analysis.operating_points import RobotAtRest
from ..mbs.linear.joint_conditions import translational_stiffness
from ..mbs.run.outcome import Details
from ..results.tables import Cells, loop_cells, volts
from .lines import named_tables

FREQUENCIES = 5  # that are listed, and damping ratios
TRANSFERS = 3  # of one motor to one output, whose zeros are listed: those with the slowest to the right
UNDAMPED = 1e-9  # ratios below are rounding


def control_tables(details: Mapping[str, Details]) -> Iterator[Table]:
    """A table of each kind that was found, from what analyses found by name."""
    loops = {name: found.metrics for name, found in details.items() if isinstance(found, LoopRecord)}
    yield from named_tables("closed loop", ((name, loop_cells(metrics)) for name, metrics in loops.items()))
    kinds: Mapping[str, tuple[Any, Callable[[str, Any], Rows]]] = {
        "linear model": (LinearModels, _linear),
        "joints": (LinearModels | RobotAtRest, _conditions),
        "placement": (Placed, _placement),
    }
    for first, (kind, rows_of) in kinds.items():
        mine = ((name, found) for name, found in details.items() if isinstance(found, kind))
        yield from named_tables(first, (row for name, found in mine for row in rows_of(name, found)))


Rows = Iterator[tuple[str, Cells]]


def _linear(name: str, found: LinearModels) -> Rows:
    for model, modes in zip(found.models, found.modes, strict=True):
        cells = {
            "t (s)": f"{model.time:g}",
            "DOF": f"{model.freedom}",
            "lowest frequencies (Hz)": _lowest(modes.frequency),
            "largest Re(pole)\n(1/s)": f"{modes.growth:.3g}" if modes.growth else "",
        }
        yield name, cells


def _lowest(frequency: Array) -> str:
    return ", ".join(f"{f:.4g}" for f in frequency[frequency > 0.0][:FREQUENCIES])


def _conditions(name: str, found: LinearModels | RobotAtRest) -> Rows:
    for t, at in zip(found.times, found.conditions, strict=True):
        for condition, held in at.items():
            stiffness = [(point, *_stiffness(C)) for point, C in held.compliance.items()] or [("", "", "")]
            for k, (point, along, least) in enumerate(stiffness):
                cells = {
                    "t (s)": "" if k else f"{t:g}",
                    "natural frequencies (Hz)": "" if k else _lowest(held.modes.frequency) or "none",
                    "at": point,
                    "stiffness along axes\n(N/mm)": along,
                    "least, along": least,
                }
                yield "" if k else f"{name}: {condition}", cells


def _stiffness(compliance: Array) -> tuple[str, str]:
    """Force over displacement along each axis, and the least of any direction, of a (3, 3) or (6, 6) compliance."""
    stiffness = translational_stiffness(compliance)
    if stiffness is None:
        return "0", ""
    along, least, direction = stiffness
    way = ", ".join(f"{x:g}" for x in np.round(direction, 2) + 0.0)
    return ", ".join(f"{k / 1e3:.4g}" for k in along), f"{least / 1e3:.4g} ({way})"


def _placement(name: str, placed: Placed) -> Rows:
    """The patches found against as many spread evenly: reach of modes, or the largest voltage of the path."""
    over_path = placed.wanted.criterion == "voltage"
    pair = placed.largest_voltage if over_path else (placed.best.value, placed.even.value)
    best, even = (f"{volts(value)} V" if over_path else f"{value:.4g}" for value in pair)
    cells = {
        "on": placed.wanted.body,
        "by": "voltage" if over_path else f"{placed.wanted.measure} reach",
        "optimum": best,
        "evenly spaced": even,
        "sets tried": f"{placed.sets}" + (" (evolution)" if placed.method == "evolution" else ""),
    }
    yield name, cells


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
            yield from _of_linear(name, found)
    for name, found in details.items():
        if isinstance(found, Placed):
            yield f"{name}: centers at {', '.join(f'{x:.4g}' for x in found.best.centers)} m"


def _of_linear(name: str, linear: LinearModels) -> Iterator[str]:
    """Damping of the frequencies that are listed for the first time of an analysis, zeros, modes out of reach."""
    modes = linear.modes[0]
    ratios = modes.damping_ratio[modes.frequency > 0.0][:FREQUENCIES]
    if np.any(np.abs(ratios) > UNDAMPED):
        listed = ", ".join(f"{ratio:.3g}" for ratio in ratios)
        yield f"{name}, t = {linear.models[0].time:g} s: damping ratios {listed}"
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
    for verb, reaches in (("uncontrollable:", linear.controllable), ("unobservable:", linear.observable)):
        for model, reach in zip(linear.models, reaches, strict=True):
            if reach.lost:
                yield f"{name}, t = {model.time:g} s: {verb} {', '.join(reach.lost)}"
