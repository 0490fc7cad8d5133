"""From results files to one HTML file that needs no network."""

import hashlib
from base64 import b64encode
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

from ...common.errors import InputError, SolveError
from ...common.files import check_ending, write_atomically
from ...common.peaks import largest
from ...common.version import VERSION
from ...mbs.inversion.zero_dynamics import is_unstable
from ...results.file import Results
from ...results.joints import labelled_coordinates
from ...results.tables import Cells, analysis_cells, loop_cells, placement_cells, settling_cells, voltage_cells
from ...results.verdict import AnalysisVerdict, millimeters, number
from ..figures.shared import bending_points
from ..motion import targets
from ..studies.study import Study, read_study, study_files
from .charts import AnalysisRun, Chart, folded, history_charts, labelled, path_error, runs
from .mechanism import link_modes, mechanism, surface_modes


class Table(NamedTuple):
    """A heading row, and rows of text."""

    heading: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]


def table_of(name: str, runs: Sequence[AnalysisRun]) -> Table:
    """Return a table over all runs; `name`: a key of `TABLES`."""
    first, cells_of = TABLES[name]
    named = [(run.label, cells) for run in runs for cells in cells_of(run.results, run.analysis)]
    heading = (first, *(key.replace("\n", " ") for key in named[0][1])) if named else ()
    return Table(heading, [(name, *cells.values()) for name, cells in named])


def _warnings_table(runs: Sequence[AnalysisRun]) -> Table:
    rows = [(run.label, "warning", text) for run in runs for text in run.results.warnings.get(run.analysis, ())]
    rows += [(run.label, "note", text) for run in runs for text in run.results.notes.get(run.analysis, ())]
    return Table(("analysis", "", "text"), rows)


BENDING = {
    "deflection (% of length)": ("largest_deflection", 100),
    "rotation (rad)": ("largest_rotation", 1),
    "foreshortening (mm)": ("foreshortening", 1e3),
    "change of stiffness (%)": ("stiffness_change", 100),
    "error of points (% of length)": ("position_error", 100),
    "of moments (% of peak)": ("relative_error", 100),
}


def _bending(results: Results, analysis: str) -> Iterator[Cells]:
    for body in results.names(f"{analysis}/bodies"):
        about = results.attributes(f"{analysis}/bodies/{body}")
        if "largest_deflection" in about:
            values = {key: f"{float(f'{scale * about[of]:.2g}'):g}" for key, (of, scale) in BENDING.items()}
            yield {"link": body, **values}


def _peaks(results: Results, analysis: str) -> Iterator[Cells]:
    peaks = list[tuple[str, str, float]]()
    for target in targets(results, analysis):
        error = path_error(results, analysis, target)
        most, at = largest(results.time(analysis)[: len(error)], error)
        peaks.append((f"distance of {target.point} from its path", millimeters(most), at))
    for label, coordinate in labelled_coordinates(results.scene).items():
        if results.has(moment := f"{analysis}/joints/{coordinate.joint}/moment"):
            peak, at = results.peak(moment + coordinate.column)
            peaks.append((f"motor of joint {label}", f"{number(peak)} {coordinate.force_unit}", at))
    for point in bending_points(results, analysis):
        deflection, at = results.peak(f"{analysis}/points/{point}/deflection")
        peaks.append((f"deflection of {point}", millimeters(deflection), at))
    yield from ({"largest": what, "value": value, "at (s)": f"{at:.4g}"} for what, value, at in peaks)


def _origins_table(files: Sequence[Results], studies: Sequence[tuple[Path, Study]]) -> Table:
    rows = []
    for results, source in labelled(files):
        rows.append((source or results.name, "results", str(results.path), _sha256(results.path.read_bytes())))
        rows.append(("", "written by", f"ffrobot {results.ffrobot_version}", ""))
        rows.append(("", "scene text", results.name, _sha256(results.scene_text.encode())))
        for name, file in results.modal_files.items():
            rows.append(("", f"modal body of {name}", str(file.path), file.sha256))
            rows.append(("", f"link content of {name}", "", file.input_hash))
    for path, study in studies:
        rows.append((_title(study), "study", str(path), _sha256(path.read_bytes())))
        rows.append(("", "written by", f"ffrobot {study.ffrobot_version}", ""))
        rows.append(("", "scene file", study.scene, ""))
    return Table(("results", "what", "where", "SHA-256"), rows)


def _title(study: Study) -> str:
    return f"{study.title}: {study.scene_name}"


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _verdict(label: str, verdict: AnalysisVerdict) -> dict[str, Any]:
    """The answer of one run and the lines below it; `mood` is "good", "bad" or "" where nothing is asked."""
    headline, *facts = verdict.lines()
    is_bad = verdict.status != "completed" or verdict.feasible is False
    return {
        "label": label,
        "mood": "bad" if is_bad else "good" if verdict.feasible else "",
        "headline": headline.removeprefix(f"{verdict.name}: "),
        "facts": [fact.strip() for fact in facts],
    }


def _zeros(results: Results, analysis: str) -> Iterator[Cells]:
    if not results.has(group := f"{analysis}/zero_dynamics"):
        return
    about, zeros = results.attributes(group), results[f"{group}/zeros"]
    kind = "minimum phase" if about["minimum_phase"] else "not minimum phase: stable inversion"
    if about["minimum_phase"] and is_unstable(zeros @ (1.0, 1.0j)).any():
        kind += " at rest; what grows on the way does too little to matter"
    yield {
        "zeros along the path": kind,
        "share of the vibration in the output": f"{about['factor']:.3g}",
        "largest real part (1/s)": f"{zeros[..., 0].max():.4g}",
        "nearest to the axis (1/s)": number(abs(zeros[..., 0]).min()),
    }


TABLES: Mapping[str, tuple[str, Callable[[Results, str], Iterable[Cells]]]] = {
    "analyses": ("analysis", analysis_cells),
    "loops": ("closed loop", loop_cells),
    "zeros": ("motors only", _zeros),
    "placements": ("placement", placement_cells),
    "bending": ("analysis", _bending),
    "peaks": ("analysis", _peaks),
    "voltages": ("voltages of", voltage_cells),
    "settling": ("residual vibration", settling_cells),
}
"""Tables of the page by name: heading of the column with names of runs, and function of further cells."""


def write_report(paths: Sequence[Path], path: Path) -> None:
    """Write a page about one results file, or several side by side, to `path`; an earlier report is replaced.

    `paths` may include studies: their files, or folders of design commands.

    Raises:
        InputError: a file is no results file and no study, or `path` is a file of another kind.
        SolveError: the page cannot be written, or Plotly is not installed.
    """
    check_ending(path, "output", (".html", ".htm"))
    files = {p: study_files(p) for p in paths}
    studies = [(file, read_study(file)) for p in paths for file in files[p]]
    with ExitStack() as stack:
        results = [stack.enter_context(Results(p)) for p in paths if not files[p]]
        write_atomically(path, page_of(_content(results, studies)).encode(), "report")


def page_of(content: Mapping[str, Any]) -> str:
    """Return the HTML page by the variables of its template. Raises `SolveError` if Plotly or Jinja is missing."""
    try:
        from jinja2 import Environment, FileSystemLoader, StrictUndefined
        from plotly.offline import get_plotlyjs, get_plotlyjs_version
    except ModuleNotFoundError as error:
        raise SolveError(f"a report needs {error.name}, which is not installed: pip install plotly jinja2") from None
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.policies["json.dumps_kwargs"] = {"separators": (",", ":")}
    versions = {"plotly_version": get_plotlyjs_version(), "ffrobot_version": VERSION}
    return environment.get_template("page.html").render(content, plotly_js=get_plotlyjs(), **versions)


def _content(files: Sequence[Results], studies: Sequence[tuple[Path, Study]]) -> dict[str, Any]:
    solved, charts = _of_results(files) if files else ({}, [])
    names = [*(results.name for results in files), *(study.scene_name for _, study in studies)]
    return {
        "title": ", ".join(dict.fromkeys(names)),
        "heading": "Design",
        "solved": bool(files),
        "studies": [_study_part(study) for _, study in studies],
        "charts": {c.name: {"data": c.traces, "layout": c.layout} for c in charts},
        "origins": _origins_table(files, studies),
        "scenes": [(source or r.name, r.scene_text) for r, source in labelled(files)],
        **solved,
    }


def _study_part(study: Study) -> dict[str, Any]:
    try:
        from ..studies.figures import svg_of
    except ModuleNotFoundError as error:
        raise SolveError(
            f"diagrams of studies need {error.name}, which is not installed: pip install matplotlib"
        ) from None
    return {
        "study": study,
        "title": _title(study),
        "mood": {True: "good", False: "bad", None: ""}[study.good],
        "pictures": [(diagram.title, b64encode(svg_of(diagram)).decode()) for diagram in study.diagrams],
    }


def _of_results(files: Sequence[Results]) -> tuple[dict[str, Any], list[Chart]]:
    all_runs = runs(files)
    planes = {results.space.is_plane: results.path for results in files}
    if len(planes) == 2:
        raise InputError(
            "report: expected results all of planar or all of 3D scenes",
            f"{planes[False]} of a 3D and {planes[True]} of a planar one: write a report of each",
        )
    moving, notes = mechanism(all_runs)
    modes, histories = link_modes(all_runs), history_charts(files)
    shapes, judged = surface_modes(modes), (one for results in files for one in results.verdict.analyses)
    content = {
        "mechanism": moving,
        "is_plane": True in planes,
        "shapes": shapes["links"],
        "modes_3d": shapes,
        "histories": folded(histories),
        "modes": modes,
        "verdicts": [_verdict(run.label, one) for run, one in zip(all_runs, judged, strict=True)],
        "warnings": _warnings_table(all_runs),
        **{name: table_of(name, all_runs) for name in TABLES},
        "notes": notes,
        "skipped": [(source, line) for r, source in labelled(files) for line in r.skipped],
    }
    return content, [*histories, *(chart for link in modes for chart in link.charts)]
