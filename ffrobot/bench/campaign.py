"""What `ffrobot bench SCENE.toml` runs, in which order, and what it writes and prints of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from ..common.errors import InputError, did_you_mean, quoted
from ..common.files import check_folder
from ..mbs.scene.analysis import TIGHTEST_TOLERANCE
from ..run.watcher import Watcher
from ..scene.load import load_scene
from ..scene.scene import Scene
from .axes import measure_axes
from .figures import draw_axes, draw_work_precision
from .measuring import find_analysis
from .precision import INTEGRATORS, TIGHTER, Point, Reference, Row, find_reference, measure_points
from .record import about_machine, as_text, content_hash, load, write_record

Swept = tuple[Reference, list[Point]]


@dataclass(frozen=True)
class Settings:
    """What is run: names of integrators, tolerances, repetitions, seconds that one run may take."""

    integrators: Sequence[str]
    tolerances: Sequence[float]
    repeat: int
    budget: float

    def __post_init__(self) -> None:
        """Raise `InputError` for what is no integrator and no tolerance, and where there is nothing to do."""
        for name in self.integrators:
            if name not in INTEGRATORS:
                raise InputError(
                    f'--integrators: expected some of {quoted(INTEGRATORS)}, found "{name}"'
                    f"{did_you_mean(name, INTEGRATORS)}"
                )
        for tolerance in self.tolerances:
            if not TIGHTEST_TOLERANCE <= tolerance < 1:
                raise InputError(
                    f"--tolerances: expected numbers from {TIGHTEST_TOLERANCE:g} to below 1, found {tolerance:g}"
                )
        if not self.integrators or not self.tolerances:
            raise InputError("--integrators, --tolerances: expected one at least, found none")


class Campaign:
    """Measures, writes below `folder` and prints to `console`."""

    def __init__(self, folder: Path, settings: Settings, display: Watcher, console: Console) -> None:
        check_folder(folder)
        self.folder, self.settings, self.display, self.console = folder, settings, display, console
        self.machine = about_machine()

    def scene(self, path: Path, analysis_name: str | None, folder: Path, parts: Sequence[str]) -> Swept | None:
        """Run time against error of a scene, and where its error comes from. Returns the sweep where asked for one."""
        scene = load_scene(path)
        analysis = find_analysis(scene, analysis_name)
        swept = self.work_precision(scene, analysis.name, folder) if "work-precision" in parts else None
        if "axes" in parts:
            rows = measure_axes(scene, analysis, self.settings.budget, self.display)
            about = {"inputs": inputs_of(scene, {}), "analysis": analysis.name}
            self.keep("axes", rows, about, folder, f"{scene.name}, {analysis.name}: where errors come from")
            self.drawn(draw_axes(rows, scene.name, folder))
        return swept

    def work_precision(self, scene: Scene, name: str, folder: Path) -> Swept:
        """The sweep of one analysis, with its records and figures."""
        settings = self.settings
        tolerance = TIGHTER * min(settings.tolerances)
        reference = find_reference(scene, name, tolerance, settings.budget, self.display)
        points = measure_points(
            scene, name, reference, settings.integrators, settings.tolerances, settings.repeat, settings.budget,
            self.display,
        )  # fmt: skip
        rows = [point.row() for point in points]
        about = {"inputs": inputs_of(scene, reference.bodies), "analysis": name, "reference": reference.about()}
        self.keep("work-precision", rows, about, folder, f"{scene.name}, {name}: {_about(reference)}")
        self.drawn(draw_work_precision(rows, (), scene.name, folder))
        return reference, points

    def keep(self, part: str, rows: Sequence[Row], about: Mapping[str, object], folder: Path, title: str) -> None:
        """Write and print the rows of a part; `about` goes into its JSON, beside machine and settings."""
        settings = asdict(self.settings)
        inputs = content_hash(repr((settings, about.get("inputs"))))
        record = {
            "machine": self.machine,
            "load": load(),
            "settings": settings,
            "inputs_hash": inputs,
            "title": title,
            **about,
        }
        self.drawn(write_record(folder, part, rows, record))
        self.console.print(_table(title, rows, part))

    def drawn(self, paths: Sequence[Path]) -> None:
        """Print the files written."""
        for path in paths:
            self.console.print(str(path), soft_wrap=True)


def inputs_of(scene: Scene, bodies: Mapping[str, str]) -> dict[str, object]:
    """Hashes of a scene and its modal bodies, for records."""
    return {"name": scene.name, "scene": content_hash(scene.text), "bodies": dict(bodies)}


def _about(reference: Reference) -> str:
    error = ", ".join(f"{kind} {value:.0e}" for kind, value in reference.error.items())
    return (
        f"against {reference.integrator} at {reference.tolerance:.0e}, which {reference.other} at"
        f" {reference.other_tolerance:.0e} agrees with to: {error}"
    )


def _table(title: str, rows: Sequence[Row], part: str) -> Table:
    columns, lines = as_text(rows, part)
    table = Table(title=title, title_justify="left", box=None, padding=(0, 2, 0, 0), pad_edge=False)
    for column in columns:
        table.add_column(column, overflow="fold")
    for line in lines:
        table.add_row(*line)
    return table
