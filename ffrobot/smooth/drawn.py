"""A picture: acceleration of set points, its spectrum at the robot's frequencies, the vibration before and after."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..mbs.fields.waypoints import difference_quotients
from ..pictures.figures.plot import image_of
from ..pictures.figures.style import SIZE, literal, style
from .diagnosis import Diagnosis
from .smoothing import Smoothed

BAND = "#e8c9a0"
WIDE = (2 * SIZE[0], 2.2 * SIZE[1])  # inches
LEAST = 1e-3  # of the tolerance: what is drawn of distances


def picture(found: Smoothed, extension: str) -> bytes:
    """The file of the picture, "png" or "svg"."""
    with style():
        figure = Figure(figsize=WIDE, layout="constrained")
        grid = figure.add_gridspec(2, 5)
        _accelerations(figure.add_subplot(grid[0, :3]), found.before, found.robot.units("/s²"))
        _spectrum(figure.add_subplot(grid[0, 3:]), found.before, found.robot.units("/s"))
        _distance(figure.add_subplot(grid[1, :]), found)
        return image_of(literal(figure), extension)


def _accelerations(axes: Axes, of: Diagnosis, unit: str) -> None:
    """Second differences of set points."""
    times, values = difference_quotients(*difference_quotients(*of.recording.dense(of.recording.step)))
    for joint, column in zip(of.recording.joints, values.T, strict=True):
        axes.plot(times, column, label=joint)
    axes.set_title(f"acceleration of set points ({unit})")
    axes.set_xlabel("t (s)")
    axes.legend(fontsize=7)


def _spectrum(axes: Axes, of: Diagnosis, unit: str) -> None:
    grid, *each = of.spectrum
    for band in of.frequencies.T:
        axes.axvspan(min(band.min(), grid[-1]), min(band.max(), grid[-1]), color=BAND)
    for values in each:
        axes.plot(grid, values)
    axes.set_yscale("log")
    axes.set_title(f"its spectrum ({unit}), natural frequencies")
    axes.set_xlabel("frequency (Hz)")


def _distance(axes: Axes, found: Smoothed) -> None:
    before, tolerance = found.before, found.robot.tolerance
    rides = [("as it is", before.recording.times[-1], before.ride)]
    rides += [(one.name, one.times[-1], one.ride) for one in found.candidates[:1]]
    for name, last, ride in rides:
        (line,) = axes.plot(ride.times, 1e3 * np.maximum(ride.off, LEAST * tolerance), label=name)
        axes.axvline(last, color=line.get_color(), linewidth=0.8, linestyle=":")
    axes.axhline(1e3 * tolerance, color="0.6", linewidth=0.8, linestyle="--", label="tolerance")
    axes.set_yscale("log")
    axes.set_title(f"distance of {found.robot.point} from its final place (mm)")
    axes.set_xlabel("t (s)")
    axes.legend()
