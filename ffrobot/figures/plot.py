"""From a results file to a folder of figures, PNG and PDF."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

from matplotlib.figure import Figure

from ..errors import InputError
from ..files import write_atomically
from ..results_file import Results
from .configurations import draw_configurations
from .figure_file import FigureFile, FigureRecord, load_figures
from .path import draw_path
from .standard import standard_figures
from .style import new_axes, style
from .time_history import draw_time_history

DRAW = {"time": draw_time_history, "path": draw_path, "configurations": draw_configurations}

# No dates and no versions: the same results give the same files.
METADATA = {"png": {"Software": None}, "pdf": {"CreationDate": None, "Producer": None, "Creator": None}}


def plot_results(results_path: Path, folder: Path) -> list[Path]:
    """Draw the figures of a results file into `folder`, which is made when absent.

    A file `figures.toml` beside the results says which figures and how; without one, the standard figures are drawn.
    Returns the files written, a PNG and a PDF of each figure. Raises `InputError` where the results or `figures.toml`
    cannot be read, or name what is not there.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: output: expected a folder, found a file")
    figure_file = results_path.parent / "figures.toml"
    written = []
    with Results(results_path) as results, style():
        figures = load_figures(figure_file) if figure_file.is_file() else FigureFile(figure=standard_figures(results))
        for record in figures.figure:
            picture = draw(record, results)
            for extension in ("png", "pdf"):
                path = folder / f"{record.name}.{extension}"
                write_atomically(path, _image(picture, extension), "figure", make_folder=True)
                written.append(path)
    return written


def draw(record: FigureRecord, results: Results) -> Figure:
    """Draw one figure."""
    picture, axes = new_axes(record.title)
    DRAW[record.kind](axes, record, results)
    if record.x_range is not None:
        axes.set_xlim(*record.x_range)
    if record.y_range is not None:
        axes.set_ylim(*record.y_range)
    return picture


def _image(picture: Figure, extension: str) -> bytes:
    stream = BytesIO()
    picture.savefig(stream, format=extension, metadata=METADATA[extension])
    return stream.getvalue()
