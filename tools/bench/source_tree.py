"""What `python -m bench` runs: the two cases of the paper, growth, and ratios to hand-written code."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from ffrobot.bench import OF_A_SCENE
from ffrobot.bench.campaign import TIME, Campaign, Rows, Swept, draw, draw_work_precision, grouped, inputs_of, points_of
from ffrobot.bench.precision import find_analysis
from ffrobot.common.errors import InputError
from ffrobot.run.solve import prepare_scene
from ffrobot.scene.load import load_scene
from ffrobot.scene.scene import Scene

from .aims import measure_aims
from .evaluations import measure_evaluations
from .growth import measure_growth
from .peer import Exudyn, measure_peer
from .replays import measure_replays

sys.path.insert(0, str(Path(__file__).parents[2] / "docs"))

from benchmark_columns import COLUMNS

CASES = ("two_link", "slider_crank")  # of the paper
PARTS = ("growth", "evaluations", "aims", "replays")
PEER = "peer"  # where asked for: it needs another program
REPLAYED = ("two_link", "arm_3r")  # in the plane and in 3D


class SourceTree(Campaign):
    """Measures what needs ffrobot's source tree."""

    columns = COLUMNS

    def everything(self, repository: Path, parts: Sequence[str], peer_python: Path) -> None:
        """Those of `parts` that are told no scene, and the two cases of the paper."""
        paths = {name: repository / "cases" / name / "scene.toml" for name in CASES}
        of_cases = [part for part in parts if part in OF_A_SCENE]
        if set(parts) - {"growth"} and not all(path.is_file() for path in paths.values()):
            raise InputError(f"{repository}: --source: expected ffrobot's source tree, found no cases in it")
        exudyn = self._exudyn(paths["two_link"], repository, peer_python) if PEER in parts else None
        if "growth" in parts:
            rows = measure_growth(self.settings.repeat, self.display)
            self.keep("growth", rows, {}, self.folder, "growth")
            self.drawn(draw_growth(rows, self.folder))
        if "evaluations" in parts:
            self._evaluations(repository)
        if "aims" in parts:
            self._aims(load_scene(paths["two_link"]), repository)
        if "replays" in parts:
            self._replays([load_scene(repository / "cases" / name / "scene.toml") for name in REPLAYED])
        swept = {name: self.scene(path, None, self.folder / name, of_cases) for name, path in paths.items() if of_cases}
        if exudyn is not None:
            self._peer(exudyn, load_scene(paths["two_link"]), swept.get("two_link"))

    def _aims(self, scene: Scene, repository: Path) -> None:
        with tempfile.TemporaryDirectory(prefix="ffrobot-bench-") as folder:
            rows = measure_aims(
                scene, repository, Path(folder), self.settings.repeat, self.settings.budget, self.display
            )
        self.keep("aims", rows, {"inputs": inputs_of(scene, {})}, self.folder, "ratios to the hand-written version")

    def _replays(self, scenes: Sequence[Scene]) -> None:
        rows = measure_replays(scenes, self.settings.repeat, self.display)
        about = {"inputs": {scene.name: inputs_of(scene, {}) for scene in scenes}}
        self.keep("replays", rows, about, self.folder, "forward runs with results of PCID")

    def _evaluations(self, repository: Path) -> None:
        with tempfile.TemporaryDirectory(prefix="ffrobot-bench-") as folder:
            rows = measure_evaluations(repository, Path(folder), self.display)
        self.keep("evaluations", rows, {}, self.folder, "one evaluation of accelerations and multipliers")

    def _exudyn(self, scene_path: Path, repository: Path, python: Path) -> Exudyn:
        bodies = prepare_scene(load_scene(scene_path), self.display).bodies
        links = [body.path for body in bodies.values() if body.path is not None]
        return Exudyn(repository, python, links, self.settings.budget)

    def _peer(self, exudyn: Exudyn, scene: Scene, swept: Swept | None) -> None:
        """The peer beside our sweep, on whose figures it comes."""
        name, folder = find_analysis(scene, None).name, self.folder / scene.name
        reference, points = swept or self.work_precision(scene, name, folder)
        settings = self.settings
        rows, verdict = measure_peer(
            exudyn, scene, name, reference, points, settings.repeat, settings.budget, self.display
        )
        about = {"inputs": inputs_of(scene, reference.bodies), "reference": reference.about(), "verdict": verdict}
        self.keep("peer", rows, about, folder, "EXUDYN on the same modal bodies; force without its start")
        of_peer = [{**row, TIME: row.get("seconds")} for row in rows]
        curves = grouped([point.row() for point in points], "integrator")
        curves |= {f"EXUDYN, {gravity} gravity": of for gravity, of in grouped(of_peer, "gravity").items()}
        self.drawn(draw_work_precision(curves, scene.name, folder))
        self.console.print(f"at the peer's best error: {verdict}")


def draw_growth(rows: Rows, folder: Path) -> list[Path]:
    """Time against size: of an evaluation with modes and links, and of a run with outputs."""
    curves = {kind: points_of(of, "size", TIME) for kind, of in grouped(rows, "with").items()}
    outputs = {"a run of 0.1 s": curves.pop("outputs", ([], []))}
    return [
        *draw(curves, "accelerations and multipliers", "modes, links", "least time each (s)", folder, "growth"),
        *draw(outputs, "outputs of a run", "outputs", "least run time (s)", folder, "growth_outputs"),
    ]
