"""What `ffrobot bench` runs, in which order, and what it writes and prints of it."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from ..errors import InputError
from ..figures.plot import check_folder
from ..mbs.analysis_records import TIGHTEST_TOLERANCE
from ..mbs.scene_file import load_scene
from ..mbs.scene_records import Scene
from ..solution import Watcher
from ..validation import did_you_mean, quoted
from .aims import measure_aims
from .axes import measure_axes
from .errors import KINDS
from .figures import draw_axes, draw_growth, draw_work_precision
from .growth import measure_growth
from .machine import about_machine, content_hash, load
from .measuring import find_analysis
from .peer import measure_peer
from .record import write_record
from .sweep import INTEGRATORS, TIGHTER, Point, Reference, Row, find_reference, sweep

OF_A_SCENE = ("work-precision", "axes")
PARTS = (*OF_A_SCENE, "growth", "aims")
CASES = ("two_link", "slider_crank")  # of the paper, in the source tree

ERRORS = tuple(f"error_{kind}" for kind in KINDS)
COLUMNS = {
    "work-precision": ("integrator", "ran", "tolerance", "status", "seconds", "steps", *ERRORS),
    "axes": ("axis", "elements", "modes", "tolerance", "status", "against", "seconds", *ERRORS),
    "growth": ("with", "size", "seconds_min", "order"),
    "aims": ("what", "run", "status", "integrator", "tolerance", "seconds", "ratio", "aim", "accurate"),
    "peer": ("step", "gravity", "status", "seconds", "error_force", "error_displacement", "error_force_at_start"),
}


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

    def scene(self, path: Path, analysis_name: str | None, folder: Path, parts: Sequence[str]) -> None:
        """Run time against error of a scene, and where its error comes from."""
        scene = load_scene(path)
        analysis = find_analysis(scene, analysis_name)
        if "work-precision" in parts:
            self.work_precision(scene, analysis.name, folder)
        if "axes" in parts:
            rows = measure_axes(scene, analysis, self.settings.budget, self.display)
            about = {"inputs": _inputs(scene, {}), "analysis": analysis.name}
            self._keep("axes", rows, about, folder, f"{scene.name}, {analysis.name}: where errors come from")
            self._drawn(draw_axes(rows, scene.name, folder))

    def work_precision(
        self, scene: Scene, name: str, folder: Path, peer: Sequence[Row] = ()
    ) -> tuple[Reference, list[Point]]:
        """The sweep of one analysis, with its records and figures."""
        settings = self.settings
        tolerance = TIGHTER * min(settings.tolerances)
        reference = find_reference(scene, name, tolerance, settings.budget, self.display)
        points = sweep(
            scene, name, reference, settings.integrators, settings.tolerances, settings.repeat, settings.budget,
            self.display,
        )  # fmt: skip
        rows = [point.row() for point in points]
        about = {"inputs": _inputs(scene, reference.bodies), "analysis": name, "reference": reference.about()}
        self._keep("work-precision", rows, about, folder, f"{scene.name}, {name}: {_about(reference)}")
        self._drawn(draw_work_precision(rows, peer, scene.name, folder))
        return reference, points

    def everything(self, repository: Path, parts: Sequence[str], peer_python: Path | None) -> None:
        """The two cases of the paper, growth and aims; the peer too, where an interpreter that has it is named."""
        scenes = {name: repository / "cases" / name / "scene.toml" for name in CASES}
        of_cases = [part for part in parts if part in OF_A_SCENE]
        if (of_cases or "aims" in parts or peer_python) and not all(path.is_file() for path in scenes.values()):
            raise InputError(f"{repository}: --source: expected ffrobot's source tree, found no cases in it")
        if "growth" in parts:
            rows = measure_growth(max(self.settings.repeat, 5), self.display)
            self._keep("growth", rows, {}, self.folder, "growth")
            self._drawn(draw_growth(rows, self.folder))
        if "aims" in parts:
            self._aims(load_scene(scenes["two_link"]), repository)
        for name, path in scenes.items():
            if of_cases:
                self.scene(path, None, self.folder / name, of_cases)
        if peer_python is not None:
            self._peer(load_scene(scenes["two_link"]), repository, peer_python)

    def _aims(self, scene: Scene, repository: Path) -> None:
        with tempfile.TemporaryDirectory(prefix="ffrobot-bench-") as folder:
            rows = measure_aims(
                scene, repository, Path(folder), self.settings.repeat, self.settings.budget, self.display
            )
        self._keep("aims", rows, {"inputs": _inputs(scene, {})}, self.folder, "ratios to the hand-written version")

    def _peer(self, scene: Scene, repository: Path, python: Path) -> None:
        """After a sweep of our own in the same run, whose figures it joins."""
        name, folder = find_analysis(scene, None).name, self.folder / "peer"
        reference, points = self.work_precision(scene, name, folder)
        rows, verdict = measure_peer(
            scene, name, reference, points, repository, python, self.settings.repeat, self.settings.budget, self.display
        )
        about = {"inputs": _inputs(scene, reference.bodies), "reference": reference.about(), "verdict": verdict}
        self._keep("peer", rows, about, folder, "EXUDYN on the same modal bodies; force without its start")
        self._drawn(draw_work_precision([point.row() for point in points], rows, scene.name, folder))
        self.console.print(f"speed ratio at the peer's best error: {verdict}")

    def _keep(self, part: str, rows: Sequence[Row], about: Mapping[str, object], folder: Path, title: str) -> None:
        settings = asdict(self.settings)
        inputs = content_hash(repr((settings, about.get("inputs"))))
        record = {"machine": self.machine, "load": load(), "settings": settings, "inputs_hash": inputs, **about}
        self._drawn(write_record(folder, part.replace("-", "_"), rows, record))
        self.console.print(_table(title, rows, COLUMNS[part]))

    def _drawn(self, paths: Sequence[Path]) -> None:
        for path in paths:
            self.console.print(str(path), soft_wrap=True)


def _inputs(scene: Scene, bodies: Mapping[str, str]) -> dict[str, object]:
    return {"name": scene.name, "scene": content_hash(scene.text), "bodies": dict(bodies)}


def _about(reference: Reference) -> str:
    error = ", ".join(f"{kind} {value:.0e}" for kind, value in reference.error.items())
    return (
        f"against {reference.integrator} at {reference.tolerance:.0e}, which {reference.other} at"
        f" {reference.other_tolerance:.0e} agrees with to: {error}"
    )


def _table(title: str, rows: Sequence[Row], columns: Sequence[str]) -> Table:
    """The columns that are not empty, as text."""
    shown = [column for column in columns if any(row.get(column) is not None for row in rows)]
    table = Table(title=title, title_justify="left", box=None, padding=(0, 2, 0, 0), pad_edge=False)
    for column in shown:
        table.add_column(column.replace("error_", "").replace("_", " "), overflow="fold")
    for row in rows:
        table.add_row(*(_text(row.get(column)) for column in shown))
    return table


def _text(value: object) -> str:
    if value is None:
        return ""
    return f"{value:.3g}" if isinstance(value, float) else str(value)
