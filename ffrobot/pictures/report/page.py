"""From results files to one HTML file that needs no network."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from ...common.errors import InputError, SolveError
from ...common.files import write_atomically
from ...common.outputs import check_not_an_input
from ...common.version import VERSION
from ...results.file import Results
from ..studies.study import Study, read_study, study_files
from .charts import Chart, folded, history_charts, runs, sources
from .diagrams import DrawnDiagram, StudyPart
from .mechanism import link_modes, mechanism, surface_modes
from .tables import TABLES, analyses_table, origins_table, verdicts

HERE = Path(__file__).parent
OWN = ("page.js", "modes.js", "player.js", "mechanism.js", "page.css")  # what the template calls page_js, …


def write_report(paths: Sequence[Path], path: Path) -> None:
    """Write a page about one results file, or several side by side, to `path`; an earlier report is replaced.

    `paths` may have studies, too: their files, or folders of design commands. Raises `InputError` where a file is no
    results file and no study, or `path` would cost a file of another kind, `SolveError` where the page cannot be
    written or Plotly is not installed.
    """
    check_not_an_input(path)
    if path.is_dir():
        raise InputError(f"{path}: output: expected a file name, found a folder")
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f'{path}: output: expected a name that ends in ".html", found "{path.name}"')
    found = [(p, study_files(p)) for p in paths]
    studies = [(file, read_study(file)) for _, files in found for file in files]
    with ExitStack() as stack:
        results = [stack.enter_context(Results(p)) for p, files in found if not files]
        write_atomically(path, report(results, studies).encode(), "report")


def report(files: Sequence[Results], studies: Sequence[tuple[Path, Study]] = ()) -> str:
    """The page as text."""
    try:
        from jinja2 import Environment, FileSystemLoader, StrictUndefined
        from plotly.offline import get_plotlyjs, get_plotlyjs_version
    except ModuleNotFoundError as error:
        raise SolveError(f"a report needs {error.name}, which is not installed: pip install plotly jinja2") from None
    environment = Environment(
        loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    parts = [StudyPart(number, file, study) for number, (file, study) in enumerate(studies, start=1)]
    own = {name.replace(".", "_"): (HERE / name).read_text(encoding="utf-8") for name in OWN}
    versions = {"plotly_version": get_plotlyjs_version(), "ffrobot_version": VERSION}
    page = environment.get_template("page.html")
    return page.render(_content(files, parts), plotly_js=get_plotlyjs(), **own, **versions)


def _content(files: Sequence[Results], studies: Sequence[StudyPart]) -> dict[str, Any]:
    solved, charts = _of_results(files) if files else ({}, [])
    drawn: list[Chart | DrawnDiagram] = [*charts, *(chart for part in studies for chart in part.charts)]
    names = [*(results.name for results in files), *(part.study.scene_name for part in studies)]
    return {
        "title": ", ".join(dict.fromkeys(names)),
        "solved": bool(files),
        "studies": studies,
        "charts": _script_data({c.name: {"data": c.traces, "layout": c.layout} for c in drawn}),
        "origins": origins_table(files, studies),
        "scenes": [(source or r.name, r.scene_text) for r, source in zip(files, sources(files), strict=True)],
        **solved,
    }


def _of_results(files: Sequence[Results]) -> tuple[dict[str, Any], list[Chart]]:
    all_runs = runs(files)
    is_plane = _is_plane(files)
    moving, notes = mechanism(all_runs)
    modes, histories, answers = link_modes(all_runs), history_charts(files), verdicts(all_runs)
    shapes = surface_modes(modes)
    content = {
        "mechanism": _script_data(moving),
        "is_plane": is_plane,
        "shapes": shapes["links"],
        "modes_3d": _script_data(shapes),
        "histories": folded(histories),
        "modes": modes,
        "analyses": analyses_table(all_runs, answers),
        "verdicts": answers,
        **{name: table(all_runs) for name, table in TABLES.items()},
        "notes": notes,
        "skipped": [(source, line) for r, source in zip(files, sources(files), strict=True) for line in r.skipped],
    }
    return content, [*histories, *(chart for link in modes for chart in link.charts)]


def _is_plane(files: Sequence[Results]) -> bool:
    kinds = {results.space.is_plane: results.path for results in files}
    if len(kinds) == 2:
        raise InputError(
            f"report: expected results all of planar or all of 3D scenes, found {kinds[False]} of a 3D and"
            f" {kinds[True]} of a planar one: write a report of each"
        )
    return True in kinds


def _script_data(value: object) -> str:
    """JSON that may stand inside a script element: nothing in it ends the element."""
    return json.dumps(value, ensure_ascii=True, separators=(",", ":")).replace("<", "\\u003c")
