"""Verdicts and tables of the page: what was solved, the largest values, and what they came from."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from ...common.peaks import largest
from ...mbs.inversion.zero_dynamics import is_unstable
from ...results.file import Results
from ...results.joints import joint_coordinates
from ...results.linear import read_metrics
from ...results.tables import Cells, analysis_cells, loop_cells, settling_cells, voltage_cells, volts
from ...results.verdict import AnalysisVerdict, millimeters, number
from ..figures.shared import bending_points
from ..motion import targets
from .charts import Run, path_error, sources
from .diagrams import StudyPart


@dataclass(frozen=True)
class Table:
    """A heading row, and rows of text."""

    heading: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]


def _named(first: str, rows: Iterable[tuple[str, Cells]]) -> Table:
    """Of rows by heading, below `first` the names of their runs."""
    named = list(rows)
    heading = (first, *(key.replace("\n", " ") for key in named[0][1])) if named else ()
    return Table(heading, [(name, *cells.values()) for name, cells in named])


def analyses_table(runs: Sequence[Run], verdicts: Sequence[RunVerdict]) -> Table:
    """One row for each run, as `ffrobot solve --verbose` has it, with more columns."""
    pairs = zip(runs, verdicts, strict=True)
    return _named("analysis", ((run.label, analysis_cells(run.results, one.verdict)) for run, one in pairs))


def warnings_table(runs: Sequence[Run]) -> Table:
    """Why results may be wrong, and what is worth knowing of right ones, a text in each row."""
    rows = [
        (run.label, kind, text)
        for kind, attribute in (("warning", "warnings"), ("note", "notes"))
        for run in runs
        for text in getattr(run.results, attribute).get(run.analysis, ())
    ]
    return Table(("analysis", "", "text"), rows)


def bending_table(runs: Sequence[Run]) -> Table:
    """How far the links bend in every run, and how wrong that makes it."""
    heading = ("analysis", "link", "deflection (% of length)", "rotation (rad)", "foreshortening (mm)",
               "change of stiffness (%)", "error of points (% of length)", "of moments (% of peak)")  # fmt: skip
    scaled = (("largest_deflection", 100), ("largest_rotation", 1), ("foreshortening", 1e3), ("stiffness_change", 100),
              ("position_error", 100), ("relative_error", 100))  # fmt: skip
    rows = []
    for run in runs:
        for body in run.results.names(f"{run.analysis}/bodies"):
            about = run.results.attributes(f"{run.analysis}/bodies/{body}")
            if "largest_deflection" in about:
                rows.append((run.label, body, *(f"{float(f'{scale * about[key]:.2g}'):g}" for key, scale in scaled)))
    return Table(heading, rows)


def peaks_table(runs: Sequence[Run]) -> Table:
    """The largest absolute value of what a reader asks for first, in every run."""
    found = ((run.label, *peak) for run in runs for peak in _peaks(run))
    rows = [(label, what, value, f"{at:.4g}") for label, what, value, at in found]
    return Table(("analysis", "largest", "value", "at (s)"), rows)


def _peaks(run: Run) -> Iterator[tuple[str, str, float]]:
    """(quantity, its largest size, when it has that) of a run."""
    results, analysis = run.results, run.analysis
    for target in targets(run.results, run.analysis):
        error = path_error(run, target)
        most, at = largest(results.time(analysis)[: len(error)], error)
        yield f"distance of {target.point} from its path", millimeters(most), at
    for joint in (keys["name"] for keys in results.scene.get("joint", [])):
        for coordinate in joint_coordinates(results.scene, joint):
            if results.has(moment := f"{analysis}/joints/{joint}/moment"):
                name = f"motor of joint {joint}{coordinate.label}"
                peak, at = results.peak(moment + coordinate.column)
                yield name, f"{number(peak)} {coordinate.force_unit}", at
    for point in bending_points(results, analysis):
        deflection, at = results.peak(f"{analysis}/points/{point}/deflection")
        yield f"deflection of {point}", millimeters(deflection), at


def voltages_table(runs: Sequence[Run]) -> Table:
    """What the patches of every link should give, and what they can."""
    cells = ((run.label, of) for run in runs for of in voltage_cells(run.results, run.analysis))
    return _named("voltages of", cells)


def settling_table(runs: Sequence[Run]) -> Table:
    """How far points are from their final position once all paths are over."""
    cells = ((run.label, of) for run in runs for of in settling_cells(run.results, run.analysis))
    return _named("residual vibration", cells)


def origins_table(files: Sequence[Results], studies: Sequence[StudyPart]) -> Table:
    """Files, hashes and versions that the page rests on."""
    rows = []
    for results, source in zip(files, sources(files), strict=True):
        rows.append((source or results.name, "results", str(results.path), _sha256(results.path.read_bytes())))
        rows.append(("", "written by", f"ffrobot {results.ffrobot_version}", ""))
        rows.append(("", "scene text", results.name, _sha256(results.scene_text.encode())))
        for name, file in results.modal_files.items():
            rows.append(("", f"modal body of {name}", str(file.path), file.sha256))
            rows.append(("", f"link content of {name}", "", file.input_hash))
    for part in studies:
        rows.append((part.title, "study", str(part.file), _sha256(part.file.read_bytes())))
        rows.append(("", "written by", f"ffrobot {part.study.ffrobot_version}", ""))
        rows.append(("", "scene file", part.study.scene, ""))
    return Table(("results", "what", "where", "SHA-256"), rows)


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


@dataclass(frozen=True)
class RunVerdict:
    """The verdict of one run, under its name on the page; `mood` is "good", "bad" or "" where nothing is asked."""

    label: str
    verdict: AnalysisVerdict

    @property
    def mood(self) -> str:
        """For its color."""
        failed = self.verdict.status != "completed"
        return "bad" if failed or self.verdict.feasible is False else "good" if self.verdict.feasible else ""

    @property
    def headline(self) -> str:
        """The answer."""
        first = next(self.verdict.lines())
        return first.removeprefix(f"{self.verdict.name}: ")

    @property
    def facts(self) -> list[str]:
        """The lines below it."""
        return [line.strip() for line in list(self.verdict.lines())[1:]]


def verdicts(runs: Sequence[Run]) -> list[RunVerdict]:
    """Of all runs, in order."""
    return [RunVerdict(run.label, run.results.verdict[run.analysis]) for run in runs]


def loops_table(runs: Sequence[Run]) -> Table:
    """Closed loops, one row each."""
    closed = (run for run in runs if run.results.has(f"{run.analysis}/control/commands"))
    metrics = ((run.label, run.results.attributes(f"{run.analysis}/control")) for run in closed)
    return _named("closed loop", ((label, loop_cells(read_metrics(about))) for label, about in metrics))


def zeros_table(runs: Sequence[Run]) -> Table:
    """How the paths of motors-only analyses were inverted, and the zeros nearest to instability."""
    rows = []
    for run in runs:
        group = f"{run.analysis}/zero_dynamics"
        if run.results.has(group):
            about, zeros = run.results.attributes(group), run.results[f"{group}/zeros"]
            at_rest = " at rest; what grows on the way does too little to matter"
            phase = f"minimum phase{at_rest if is_unstable(zeros @ (1.0, 1.0j)).any() else ''}"
            kind = phase if about["minimum_phase"] else "not minimum phase: stable inversion"
            largest, least = zeros[..., 0].max(), abs(zeros[..., 0]).min()
            rows.append((run.label, kind, f"{about['factor']:.3g}", f"{largest:.4g}", number(least)))
    heading = ("motors only", "zeros along the path", "share of the vibration in the output", "largest real part (1/s)",
               "nearest to the axis (1/s)")  # fmt: skip
    return Table(heading, rows)


def placements_table(runs: Sequence[Run]) -> Table:
    """Where searches place patches, against as many spread evenly."""
    rows = []
    for run in runs:
        group = f"{run.analysis}/placement"
        if run.results.has(group):
            about = run.results.attributes(group)
            reach = (f"{run.results[f'{group}/{which}/value']:.4g}" for which in ("best", "even"))
            voltages = (f"{volts(volt)} V" for volt in run.results[f"{group}/largest_voltage"])
            centers = ", ".join(f"{x:.4g}" for x in run.results[f"{group}/best/centers"])
            pair = voltages if about["criterion"] == "voltage" else reach
            rows.append((run.label, about["body"], about["criterion"], centers, *pair))
    return Table(("placement", "on", "by", "centers (m)", "optimum", "evenly spaced"), rows)


TABLES: Mapping[str, Callable[[Sequence[Run]], Table]] = {
    "loops": loops_table,
    "zeros": zeros_table,
    "placements": placements_table,
    "warnings": warnings_table,
    "bending": bending_table,
    "peaks": peaks_table,
    "voltages": voltages_table,
    "settling": settling_table,
}
"""What the page calls them."""
