"""What `ffrobot bench SCENE.toml` runs, in which order, and what it writes and prints of it."""

import hashlib
import json
import os
import platform
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from typing import Any

from rich.console import Console

from ..common.files import check_folder, write_atomically
from ..common.tables import as_csv
from ..mbs import _core
from ..pictures.figures.plot import write_figure
from ..pictures.figures.style import legend, line_style, new_axes, style
from ..present.lines import print_table
from ..run.watcher import Watcher
from ..scene.load import load_scene
from ..scene.scene import Scene
from .precision import (
    KINDS,
    TIGHTER,
    Point,
    ReferenceRun,
    Row,
    Settings,
    find_analysis,
    find_reference,
    measure_axes,
    measure_points,
)

FORMAT, FORMAT_VERSION = "ffrobot-bench", 1

ERRORS = tuple(f"error_{kind}" for kind in KINDS)
COLUMNS: Mapping[str, Sequence[str]] = {
    "work-precision": ("integrator", "ran", "tolerance", "status", "seconds_min", "steps", *ERRORS),
    "axes": ("axis", "elements", "modes", "tolerance", "status", "against", "seconds", *ERRORS),
}
"""What is shown of the rows of a part."""

# Tables and figures show the least time of repetitions, which is what the machine can do.
HEADINGS = {"seconds_min": "least seconds"}


def as_text(rows: Sequence[Row], columns: Sequence[str]) -> tuple[list[str], list[list[str]]]:
    """Headings, and cells by row, of `columns`, without columns that are empty in all rows."""
    shown = [column for column in columns if any(row.get(column) is not None for row in rows)]
    headings = [HEADINGS.get(column, column.removeprefix("error_").replace("_", " ")) for column in shown]
    values = ([row.get(column) for column in shown] for row in rows)
    cells = [["" if v is None else f"{v:.3g}" if isinstance(v, float) else str(v) for v in row] for row in values]
    return headings, cells


def _about_machine() -> dict[str, object]:
    information = Path("/proc/cpuinfo")
    text = information.read_text(encoding="utf-8") if information.is_file() else ""
    model = re.search(r"^model name\s*:\s*(.*)", text, re.MULTILINE)
    libraries = ("ffrobot", "numpy", "scipy", "h5py")
    return {
        "processor": model[1] if model else platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "compiler": _core.build,
        "versions": {
            "python": platform.python_version(),
            **{name: str(import_module(name).__version__) for name in libraries},
        },
        "threads": {name: os.environ.get(name) for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")},
    }


def _content_hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


Swept = tuple[ReferenceRun, list[Point]]


class Campaign:
    """Measurements, written below `folder` and printed to `console`; `columns`: printed ones, by part."""

    columns = COLUMNS

    def __init__(self, folder: Path, settings: Settings, display: Watcher, console: Console) -> None:
        check_folder(folder)
        self.folder, self.settings, self.display, self.console = folder, settings, display, console
        self.machine = _about_machine()

    def scene(self, path: Path, analysis_name: str | None, folder: Path, parts: Sequence[str]) -> Swept | None:
        """Measure the `parts` "work-precision" and "axes" of a scene; returns reference and points of the first.

        `analysis_name` None: the first that integrates over time.
        """
        scene = load_scene(path)
        analysis = find_analysis(scene, analysis_name)
        swept = self.work_precision(scene, analysis.name, folder) if "work-precision" in parts else None
        if "axes" in parts:
            rows = measure_axes(scene, analysis, self.settings.budget, self.display)
            about = {"inputs": inputs_of(scene, {}), "analysis": analysis.name}
            self.keep("axes", rows, about, folder, f"{scene.name}, {analysis.name}: where errors come from")
            for axis, what in (("mesh", "elements"), ("modes", "modes")):
                along = grouped(rows, "axis").get(axis, ())
                curves = {kind: points_of(along, "times", f"error_{kind}") for kind in KINDS}
                label, name = f"times the {what} of the links", f"error_{axis}"
                self.drawn(draw(curves, f"{scene.name}: {axis}", label, "error / peak", folder, name))
        return swept

    def work_precision(self, scene: Scene, name: str, folder: Path) -> Swept:
        """Measure run time against error of one analysis, and write records and figures; returns reference, points."""
        settings = self.settings
        tolerance = TIGHTER * min(settings.tolerances)
        reference = find_reference(scene, name, tolerance, settings.budget, self.display)
        points = measure_points(scene, name, reference, settings, self.display)
        rows = [point.row() for point in points]
        about = {"inputs": inputs_of(scene, reference.bodies), "analysis": name, "reference": reference.about()}
        self.keep("work-precision", rows, about, folder, f"{scene.name}, {name}: {reference.in_words}")
        self.drawn(draw_work_precision(grouped(rows, "integrator"), scene.name, folder))
        return reference, points

    def keep(self, part: str, rows: Sequence[Row], about: Mapping[str, object], folder: Path, title: str) -> None:
        """Write PART.csv and PART.json of the rows of a part, and print them.

        `about` goes into the JSON beside machine, settings and load: processes that ran in the last minute (mean).
        """
        columns = list(dict.fromkeys(key for row in rows for key in row))
        cells = ([row.get(key, "") for key in columns] for row in rows)
        short = ([f"{cell:.5g}" if isinstance(cell, float) else cell for cell in row] for row in cells)
        settings = asdict(self.settings)
        record = {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "part": part,
            "machine": self.machine,
            "load": os.getloadavg()[0],
            "settings": settings,
            "inputs_hash": _content_hash(repr((settings, about.get("inputs")))),
            "title": title,
            **about,
            "rows": rows,
        }
        texts = {"csv": as_csv([columns, *short]), "json": json.dumps(record, indent=1, ensure_ascii=False) + "\n"}
        for extension, text in texts.items():
            path = folder / f"{part.replace('-', '_')}.{extension}"
            write_atomically(path, text.encode(), "record", make_folder=True)
            self.drawn([path])
        self.console.out(title)
        print_table(self.console, *as_text(rows, self.columns[part]))

    def drawn(self, paths: Sequence[Path]) -> None:
        """Print the `paths` of files written."""
        for path in paths:
            self.console.out(path)


def inputs_of(scene: Scene, bodies: Mapping[str, str]) -> dict[str, object]:
    """Hash of a scene, and `bodies`, those of its modal bodies by name, for records."""
    return {"name": scene.name, "scene": _content_hash(scene.text), "bodies": dict(bodies)}


Rows = Sequence[Mapping[str, Any]]
Curves = Mapping[str, tuple[Sequence[float], Sequence[float]]]

MOST_TICKS = 6  # at the points themselves


def draw_work_precision(groups: Mapping[str, Rows], title: str, folder: Path) -> list[Path]:
    """Draw run time against error: a figure for each kind of quantity, a curve for each group; returns paths."""
    written: list[Path] = []
    time, error = "least run time (s)", "error / peak"
    for kind in KINDS:
        curves = {name: points_of(rows, "seconds_min", f"error_{kind}") for name, rows in groups.items()}
        written += draw(curves, f"{title}: {kind}", time, error, folder, f"work_precision_{kind}")
    return written


def grouped(rows: Rows, column: str) -> dict[str, Rows]:
    """Group rows by their values in a column."""
    return {name: [row for row in rows if row[column] == name] for name in dict.fromkeys(row[column] for row in rows)}


def points_of(rows: Rows, x: str, y: str) -> tuple[list[float], list[float]]:
    """Values in columns x and y of the rows that have both."""
    pairs = [(float(row[x]), float(row[y])) for row in rows if row.get(x) and row.get(y)]
    return [a for a, _ in pairs], [b for _, b in pairs]


def draw(curves: Curves, title: str, x_label: str, y_label: str, folder: Path, name: str) -> list[Path]:
    """Draw curves (x, y) on logarithmic axes, PNG and PDF, unless all are empty; returns paths."""
    shown = {label: points for label, points in curves.items() if points[0]}
    if not shown:
        return []
    with style():
        picture, axes = new_axes(title)
        axes.set_xscale("log")
        axes.set_yscale("log")
        for k, (label, (x, y)) in enumerate(shown.items()):
            axes.plot(x, y, label=label, **line_style(k, len(x)))
        values = sorted({value for x, _ in shown.values() for value in x})
        if len(values) <= MOST_TICKS and values[-1] < 10 * values[0]:  # those between powers of ten run into each other
            axes.set_xticks(values, [f"{value:g}" for value in values])
            axes.set_xticks([], minor=True)
        axes.set_xlabel(x_label)
        axes.set_ylabel(y_label)
        legend(axes)
        return write_figure(picture, folder, name)
