"""From a results file, or a modal body file, to a folder of figures."""

from __future__ import annotations

import fnmatch
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TypeVar

from matplotlib.figure import Figure

from ...common.errors import InputError, did_you_mean, of_file, quoted
from ...common.files import check_folder, write_atomically
from ...fe_models.modal_body_file import is_modal_body_file, read_modal_body
from ...results.file import Results
from .body_shape import draw_mesh, draw_modes
from .configurations import draw_bode, draw_configurations, draw_path, draw_robot_modes
from .figure_file import FigureRecord, load_figures
from .standard import main_figures, standard_figures
from .style import literal, new_axes, style
from .time_history import draw_placement, draw_time_history, draw_torque_speed

DRAW = {"time": draw_time_history, "placement": draw_placement, "torque-speed": draw_torque_speed}
DRAW_WHOLE = {  # with axes of their own
    "path": draw_path,
    "configurations": draw_configurations,
    "bode": draw_bode,
    "modes": draw_robot_modes,
}

# No dates and no versions: the same results give the same files.
METADATA = {
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Producer": None, "Creator": None},
    "svg": {"Date": None, "Creator": None},
}
FORMATS = ("png", "pdf")  # unless asked for otherwise


def plot_file(path: Path, folder: Path, formats: Sequence[str] = FORMATS, only: Sequence[str] = ()) -> list[Path]:
    """Draw the figures of a results file or of a modal body file, whichever it is, into `folder`: see the two."""
    plot = plot_modal_body if is_modal_body_file(path) else plot_results
    return plot(path, folder, formats, only)


def plot_modal_body(path: Path, folder: Path, formats: Sequence[str] = FORMATS, only: Sequence[str] = ()) -> list[Path]:
    """Draw mesh and lowest modes of a modal body file into `folder`, which is made when absent; see `plot_results`.

    Returns the files written, each figure in all `formats`: "png", "pdf", "svg". Raises `InputError` where the file
    cannot be read, or for another format.
    """
    check_folder(folder)
    _check_formats(formats)
    body = read_modal_body(path)
    with style():
        wanted = chosen({"mesh": draw_mesh, "modes": draw_modes}, only)
        return [
            path
            for name, draw_it in wanted.items()
            for path in write_figure(literal(draw_it(body)), folder, name, formats)
        ]


def plot_results(
    results_path: Path, folder: Path, formats: Sequence[str] = FORMATS, only: Sequence[str] = ()
) -> list[Path]:
    """Draw the figures of a results file into `folder`, which is made when absent.

    A file `figures.toml` beside the results says which figures and how; without one, the main ones of the standard
    figures are drawn. `only` are names of those that are wanted, or patterns such as "moment_*", or "*" for all.
    Returns the files written, each figure in all `formats`: "png", "pdf", "svg". Raises `InputError` where the results
    or `figures.toml` cannot be read, or name what is not there, or for another format.
    """
    check_folder(folder)
    _check_formats(formats)
    figure_file = results_path.parent / "figures.toml"
    written: list[Path] = []
    with Results(results_path) as results, style():
        if figure_file.is_file():
            for record in _records(load_figures(figure_file).figure, only):
                label = f'{figure_file}: figure "{record.name}"'
                with of_file(label), _formulas(label):
                    written += write_figure(draw(record, results), folder, record.name, formats)
        else:
            for record in _records((standard_figures if only else main_figures)(results), only):
                written += write_figure(literal(draw(record, results)), folder, record.name, formats)
    return written


T = TypeVar("T")


def _records(figures: Sequence[FigureRecord], only: Sequence[str]) -> list[FigureRecord]:
    names = chosen(dict.fromkeys(figure.name for figure in figures), only)
    return [figure for figure in figures if figure.name in names]


def chosen(figures: Mapping[str, T], only: Sequence[str]) -> dict[str, T]:
    """The figures whose name is one of `only`, or like one; all without.

    Raises `InputError` for a pattern that none is like.
    """
    for pattern in only:
        if not any(fnmatch.fnmatchcase(name, pattern) for name in figures):
            raise InputError(
                f"--only: expected the name of a figure, or a pattern that fits one ({quoted(figures)}), found"
                f' "{pattern}"{did_you_mean(pattern, figures)}'
            )
    patterns = only or ["*"]
    return {
        name: figure
        for name, figure in figures.items()
        if any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)
    }


@contextmanager
def _formulas(label: str) -> Iterator[None]:
    """What matplotlib cannot draw of a figure that the user describes: a formula between `$` that is none, a range."""
    try:
        yield
    except ValueError as error:
        raise InputError(f"{label}: {str(error).strip().splitlines()[0]}") from None


def draw(record: FigureRecord, results: Results) -> Figure:
    """Draw one figure."""
    if record.kind in DRAW_WHOLE:
        picture = DRAW_WHOLE[record.kind](record, results)
    else:
        picture, axes = new_axes(record.title)
        DRAW[record.kind](axes, record, results)
    if record.x_range is not None:
        picture.axes[0].set_xlim(*record.x_range)
    if record.y_range is not None:
        picture.axes[0].set_ylim(*record.y_range)
    return picture


def _check_formats(formats: Sequence[str]) -> None:
    if not formats or not set(formats) <= set(METADATA):
        raise InputError(f'format: expected one or several of {", ".join(METADATA)}, found "{",".join(formats)}"')


def write_figure(picture: Figure, folder: Path, name: str, formats: Sequence[str] = FORMATS) -> list[Path]:
    """A picture in all formats."""
    paths = [folder / f"{name}.{extension}" for extension in formats]
    for path, extension in zip(paths, formats, strict=True):
        write_atomically(path, _image(picture, extension), "figure", make_folder=True)
        picture.set_layout_engine(None)  # other formats take the layout of the first: two of four drawings less
    return paths


def _image(picture: Figure, extension: str) -> bytes:
    stream = BytesIO()
    with warnings.catch_warnings():  # of characters that the font lacks: a box stands for them
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        warnings.filterwarnings("ignore", message="constrained_layout not applied")  # texts longer than the figure
        picture.savefig(stream, format=extension, metadata=METADATA[extension])
    return stream.getvalue()
