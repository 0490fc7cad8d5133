"""What `ffrobot smooth` prints and draws, and its page: the stream, its faults, tables of joints and of new motions."""

from base64 import b64encode
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.console import Console

from ..common.files import write_atomically
from ..mbs.fields.waypoints import difference_quotients
from ..pictures.figures.plot import image_of
from ..pictures.figures.style import SIZE, literal, style
from ..pictures.report.page import Table, page_of
from ..present.lines import print_table
from ..results.verdict import Settled
from .diagnosis import Diagnosis
from .smoothing import Smoothed

MOTIONS = ("motion", "duration (s)", "settled (s)", "vibration (mm)")
STUBBORN = "controllers have zeros that decay too slowly for inversion"
COLUMNS = ("joint", "from", "to", "speed", "acceleration", "jerk", "at most, by it alone (mm)", "share")


def print_smooth(smoothed: Smoothed, console: Console) -> None:
    """Print the motion as it is, faults, a table of joints, the verdict, a table of new motions."""
    for name, text in _lines(smoothed):
        console.out(f"{name:<10} {text}")
    joints, *motions = _tables(smoothed)
    print_table(console, *joints)
    console.out(f"verdict    {smoothed.verdict}")
    for table in motions:
        console.print()
        print_table(console, *table)


def write_page(smoothed: Smoothed, motion: Path | None, path: Path) -> None:
    """Write an HTML file: the verdict, faults, tables, the picture; `motion`: the recording, None if planned."""
    used = [smoothed.robot.file, *([motion] if motion else [])]
    part = {
        "title": f"{smoothed.robot.file.name}: {motion.name if motion else 'trajectories of the scene'}",
        "mood": "bad" if smoothed.before.residual > smoothed.robot.tolerance else "good",
        "study": {
            "headline": smoothed.verdict,
            "facts": [": ".join(line) for line in sorted(_lines(smoothed), key=lambda line: line[0] != "fault")],
            "tables": _tables(smoothed),
        },
        "pictures": [("the motion before and after", b64encode(picture(smoothed, "svg")).decode())],
    }
    origins = [(str(file), sha256(file.read_bytes()).hexdigest() if file.is_file() else "") for file in used]
    content = {
        "title": "Residual vibration", "heading": "Vibration", "solved": False, "charts": {}, "studies": [part],
        "origins": Table(("file", "SHA-256"), origins),
        "scenes": [(used[0].name, used[0].read_text(encoding="utf-8"))],
    }  # fmt: skip
    write_atomically(path, page_of(content).encode(), "report")


def _tables(smoothed: Smoothed) -> list[Table]:
    joints = Table(COLUMNS, list(_rows(smoothed.before)))
    columns = (*MOTIONS, f"off the path ({smoothed.robot.units()})", "of a limit", "torque")
    return [joints, *([Table(columns, list(_motions(smoothed)))] if smoothed.candidates else [])]


def _lines(smoothed: Smoothed) -> list[tuple[str, str]]:
    before, robot, recording = smoothed.before, smoothed.robot, smoothed.before.recording
    joints, words = len(robot.joints), [axis.words for axis in robot.servo.axes]
    each = [f"{joint}: {of}" for joint, of in zip(robot.joints, words, strict=True)]
    settling = "no place of rest"
    if of := before.ride.settling:
        settling = Settled(robot.point, before.residual, of.frequency, of.time_to, of.tolerance).in_words
    return [
        ("motion", f"{len(recording.times)} set points of {joints} joint{'s' * (joints > 1)} over"
         f" {recording.times[-1]:.4g} s, every {1e3 * recording.step:.3g} ms"),
        *(("servo", of) for of in (each if len(set(words)) > 1 else words[:1])),
        *(("frequency", f"{of.min():.3g} to {of.max():.3g} Hz along the motion") for of in before.frequencies.T),
        *(("note", remark) for remark in recording.remarks),
        *(("fault", f"{fault.kind}: {fault.text}") for fault in before.faults),
        *([("settling", settling)] if before.frequencies.size else []),
        *([] if robot.servo.is_invertible else [("note", STUBBORN)]),
    ]  # fmt: skip


def _motions(smoothed: Smoothed) -> Iterator[tuple[str, ...]]:
    for one in (smoothed.own, *smoothed.candidates):
        settled = f"{one.settled:.4g}" if np.isfinite(one.settled) else "no"
        parts = (f"{100 * of_limit:.3g} %" if of_limit else "" for of_limit in (one.excess, one.torque))
        yield one.name, f"{one.times[-1]:.4g}", settled, f"{1e3 * one.residual:.3g}", f"{one.off_path:.2g}", *parts


def _rows(of: Diagnosis) -> Iterator[tuple[str, ...]]:
    values = of.recording.values
    for k, joint in enumerate(of.recording.joints):
        numbers = (values[0, k], values[-1, k], *of.peaks[:, k], 1e3 * of.alone[k])
        yield joint, *(f"{number:.3g}" for number in numbers), f"{100 * of.shares[k]:.0f} %"


BAND = "#e8c9a0"
WIDE = (2 * SIZE[0], 2.2 * SIZE[1])  # inches
LEAST = 1e-3  # of the tolerance: what is drawn of distances


def picture(smoothed: Smoothed, extension: str) -> bytes:
    """Return the picture as a file's bytes; `extension` is "png" or "svg"."""
    before, units = smoothed.before, smoothed.robot.units
    with style():
        figure = Figure(figsize=WIDE, layout="constrained")
        grid = figure.add_gridspec(2, 5)
        _accelerations(figure.add_subplot(grid[0, :3]), before, units("/s²"))
        _spectrum(figure.add_subplot(grid[0, 3:]), before, units("/s"))
        _distance(figure.add_subplot(grid[1, :]), smoothed)
        return image_of(literal(figure), extension)


def _accelerations(axes: Axes, of: Diagnosis, unit: str) -> None:
    times, values = difference_quotients(*difference_quotients(*of.recording.dense(of.recording.step)))
    for joint, column in zip(of.recording.joints, values.T, strict=True):
        axes.plot(times, column, label=joint)
    axes.set(title=f"acceleration of set points ({unit})", xlabel="t (s)")
    axes.legend(fontsize=7)


def _spectrum(axes: Axes, of: Diagnosis, unit: str) -> None:
    grid, *each = of.spectrum
    for band in of.frequencies.T:
        axes.axvspan(min(band.min(), grid[-1]), min(band.max(), grid[-1]), color=BAND)
    for values in each:
        axes.plot(grid, values)
    axes.set(title=f"its spectrum ({unit}), natural frequencies", xlabel="frequency (Hz)", yscale="log")


def _distance(axes: Axes, smoothed: Smoothed) -> None:
    tolerance = smoothed.robot.tolerance
    for one in (smoothed.own, *smoothed.candidates[:1]):
        (line,) = axes.plot(one.ride.times, 1e3 * np.maximum(one.ride.off, LEAST * tolerance), label=one.name)
        axes.axvline(one.times[-1], color=line.get_color(), linewidth=0.8, linestyle=":")
    axes.axhline(1e3 * tolerance, color="0.6", linewidth=0.8, linestyle="--", label="tolerance")
    title = f"distance of {smoothed.robot.point} from its final place (mm)"
    axes.set(title=title, xlabel="t (s)", yscale="log")
    axes.legend()
