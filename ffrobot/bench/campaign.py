"""What `ffrobot bench` runs, in which order, and what it writes and prints of it."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from ..common.errors import InputError, did_you_mean, quoted
from ..common.files import check_folder
from ..mbs.scene.analysis import TIGHTEST_TOLERANCE
from ..run.solve import prepare_scene
from ..run.watcher import Watcher
from ..scene.load import load_scene
from ..scene.scene import Scene
from . import OF_A_SCENE, PEER
from .aims import measure_aims
from .axes import measure_axes
from .evaluations import measure_evaluations
from .figures import draw_axes, draw_growth, draw_work_precision
from .growth import measure_growth
from .machine import about_machine, content_hash, load
from .measuring import find_analysis
from .peer import Exudyn, measure_peer
from .precision import INTEGRATORS, TIGHTER, Point, Reference, Row, find_reference, measure_points
from .record import as_text, write_record
from .replays import measure_replays

CASES = ("two_link", "slider_crank")  # of the paper, in the source tree

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
        swept = self._work_precision(scene, analysis.name, folder) if "work-precision" in parts else None
        if "axes" in parts:
            rows = measure_axes(scene, analysis, self.settings.budget, self.display)
            about = {"inputs": _inputs(scene, {}), "analysis": analysis.name}
            self._keep("axes", rows, about, folder, f"{scene.name}, {analysis.name}: where errors come from")
            self._drawn(draw_axes(rows, scene.name, folder))
        return swept

    def everything(self, repository: Path, parts: Sequence[str], peer_python: Path) -> None:
        """Those of `parts` that are told no scene, and the two cases of the paper."""
        paths = {name: repository / "cases" / name / "scene.toml" for name in CASES}
        of_cases = [part for part in parts if part in OF_A_SCENE]
        if set(parts) - {"growth"} and not all(path.is_file() for path in paths.values()):
            raise InputError(f"{repository}: --source: expected ffrobot's source tree, found no cases in it")
        exudyn = self._exudyn(paths["two_link"], repository, peer_python) if PEER in parts else None
        if "growth" in parts:
            rows = measure_growth(self.settings.repeat, self.display)
            self._keep("growth", rows, {}, self.folder, "growth")
            self._drawn(draw_growth(rows, self.folder))
        if "evaluations" in parts:
            self._evaluations(repository)
        if "aims" in parts:
            self._aims(load_scene(paths["two_link"]), repository)
        if "replays" in parts:
            self._replays(load_scene(paths["two_link"]))
        swept = {name: self.scene(path, None, self.folder / name, of_cases) for name, path in paths.items() if of_cases}
        if exudyn is not None:
            self._peer(exudyn, load_scene(paths["two_link"]), swept.get("two_link"))

    def _work_precision(self, scene: Scene, name: str, folder: Path) -> Swept:
        """The sweep of one analysis, with its records and figures."""
        settings = self.settings
        tolerance = TIGHTER * min(settings.tolerances)
        reference = find_reference(scene, name, tolerance, settings.budget, self.display)
        points = measure_points(
            scene, name, reference, settings.integrators, settings.tolerances, settings.repeat, settings.budget,
            self.display,
        )  # fmt: skip
        rows = [point.row() for point in points]
        about = {"inputs": _inputs(scene, reference.bodies), "analysis": name, "reference": reference.about()}
        self._keep("work-precision", rows, about, folder, f"{scene.name}, {name}: {_about(reference)}")
        self._drawn(draw_work_precision(rows, (), scene.name, folder))
        return reference, points

    def _aims(self, scene: Scene, repository: Path) -> None:
        with tempfile.TemporaryDirectory(prefix="ffrobot-bench-") as folder:
            rows = measure_aims(
                scene, repository, Path(folder), self.settings.repeat, self.settings.budget, self.display
            )
        self._keep("aims", rows, {"inputs": _inputs(scene, {})}, self.folder, "ratios to the hand-written version")

    def _replays(self, scene: Scene) -> None:
        rows = measure_replays(scene, self.settings.repeat, self.display)
        self._keep("replays", rows, {"inputs": _inputs(scene, {})}, self.folder, "forward runs that replay PCID")

    def _evaluations(self, repository: Path) -> None:
        with tempfile.TemporaryDirectory(prefix="ffrobot-bench-") as folder:
            rows = measure_evaluations(repository, Path(folder), self.display)
        self._keep("evaluations", rows, {}, self.folder, "one evaluation of accelerations and multipliers")

    def _exudyn(self, scene_path: Path, repository: Path, python: Path) -> Exudyn:
        bodies = prepare_scene(load_scene(scene_path), self.display).bodies
        links = [body.path for body in bodies.values() if body.path is not None]
        return Exudyn(repository, python, links, self.settings.budget)

    def _peer(self, exudyn: Exudyn, scene: Scene, swept: Swept | None) -> None:
        """The peer beside our sweep, on whose figures it comes."""
        name, folder = find_analysis(scene, None).name, self.folder / scene.name
        reference, points = swept or self._work_precision(scene, name, folder)
        settings = self.settings
        rows, verdict = measure_peer(
            exudyn, scene, name, reference, points, settings.repeat, settings.budget, self.display
        )
        about = {"inputs": _inputs(scene, reference.bodies), "reference": reference.about(), "verdict": verdict}
        self._keep("peer", rows, about, folder, "EXUDYN on the same modal bodies; force without its start")
        self._drawn(draw_work_precision([point.row() for point in points], rows, scene.name, folder))
        self.console.print(f"at the peer's best error: {verdict}")

    def _keep(self, part: str, rows: Sequence[Row], about: Mapping[str, object], folder: Path, title: str) -> None:
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
        self._drawn(write_record(folder, part, rows, record))
        self.console.print(_table(title, rows, part))

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


def _table(title: str, rows: Sequence[Row], part: str) -> Table:
    columns, lines = as_text(rows, part)
    table = Table(title=title, title_justify="left", box=None, padding=(0, 2, 0, 0), pad_edge=False)
    for column in columns:
        table.add_column(column, overflow="fold")
    for line in lines:
        table.add_row(*line)
    return table
