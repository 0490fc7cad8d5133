"""From a results file, or a modal body file, to a folder of figures."""

from __future__ import annotations

import fnmatch
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import NonUniformImage

from ...common.arrays import Array
from ...common.errors import InputError, did_you_mean, of_file, quoted
from ...common.files import check_folder, write_atomically
from ...fe_models.modal_body_file import is_modal_body_file, read_modal_body
from ...results.file import Results
from ..projection import COLORS, LIMIT
from .body_shape import draw_mesh, draw_modes
from .configurations import draw_bode, draw_configurations, draw_path, draw_robot_modes
from .shared import Curve, FigureRecord, curve_points, load_figures, motor_limits, read_points
from .standard import main_figures, standard_figures
from .style import DASHES, legend, line_style, literal, new_axes, shades, style

MANY, OFTEN = 4, 0.2  # columns, and part of the time at limits, above which lines hide each other
NEAR = 1e-3  # of a limit: how close values are that are at it
SHADE = 0.25  # opacity
NAMED = 6  # columns: of more, the legend has the first and the last


def draw_time_history(axes: Axes, figure: FigureRecord, results: Results) -> None:
    """Draw every curve of `figure` over time; a dataset with several columns as one shade for each.

    The times at which a value is at a limit are shaded.
    """
    for k, curve in enumerate(figure.curves):
        if curve.file is not None:
            time, values = read_points(curve.file, curve.data)
            (points,) = axes.plot(time, figure.scale * values, "x", color="black", markersize=5, label=curve.label)
            points.set(zorder=4, clip_on=figure.x_range is not None)
        else:
            _draw_columns(axes, curve, k, figure, results)
    axes.set_xlabel(figure.x_label)
    if not axes.images:
        for k, limit in enumerate(figure.limits):
            axes.axhline(limit, color=LIMIT, linestyle="--", label="limit" if k == 0 else None)
        axes.set_ylabel(figure.y_label)
        legend(axes)


def _draw_columns(axes: Axes, curve: Curve, k: int, figure: FigureRecord, results: Results) -> None:
    time, values = curve_points(results, curve, figure.scale)
    axes.margins(x=0)
    if is_crowded(values, figure.limits):
        _draw_map(axes, time, values, curve.label, figure)
        return
    if len(time) > 1 and (at := is_at_limit(values, figure.limits).any(axis=1)).any():
        label = None if axes.collections else "at a limit"
        look: dict[str, Any] = {"color": LIMIT, "alpha": SHADE, "linewidth": 0, "label": label}
        axes.fill_between(time, 0.0, 1.0, where=at, transform=axes.get_xaxis_transform(), **look)
    count = values.shape[1]
    if count == 1:
        axes.plot(time, values[:, 0], label=curve.label, **line_style(k, len(values), alone=len(figure.curves) == 1))
        return
    for column, color in enumerate(shades(count)):
        label = f"{curve.label} {column + 1}" if count <= NAMED or column in (0, count - 1) else None
        dashes = DASHES[column % len(DASHES)] if count <= MANY else "-"
        axes.plot(time, values[:, column], color=color, linestyle=dashes, linewidth=0.7, label=label)


def is_at_limit(values: Array, limits: tuple[float, ...]) -> Array:
    """Where values (T, n) are at one of the limits: (T, n). What goes beyond them passes them, and is at none."""
    near = np.isclose(values[..., None], limits or np.inf, rtol=NEAR, atol=0.0)
    is_within = np.abs(values).max(initial=0.0) <= (1.0 + NEAR) * np.abs(limits).max(initial=0.0)
    return np.asarray(near.any(axis=-1) & is_within)


def is_crowded(values: Array, limits: tuple[float, ...]) -> bool:
    """Whether many columns of values (T, n) go from limit to limit, so that the last line hides the others."""
    return values.shape[1] > MANY and bool(limits) and bool(is_at_limit(values, limits).mean() > OFTEN)


def _draw_map(axes: Axes, time: Array, values: Array, label: str, figure: FigureRecord) -> None:
    """A row for each column, in the color of its value: red at the upper limit, blue at the lower one."""
    count, limit = values.shape[1], max(map(abs, figure.limits))
    picture = NonUniformImage(axes, cmap="RdBu_r", extent=(time[0], time[-1], 0.5, count + 0.5))
    picture.set_data(time, np.arange(1, count + 1), values.T)
    picture.set_clim(-limit, limit)
    axes.add_image(picture)
    axes.set_xlim(time[0], time[-1])
    axes.set_ylim(0.5, count + 0.5)
    axes.set_yticks(range(1, count + 1))
    axes.grid(visible=False)
    axes.set_ylabel(label)
    axes.figure.colorbar(picture, ax=axes, label=figure.y_label)


def _draw_torque_speed(axes: Axes, figure: FigureRecord, results: Results) -> None:
    for k, curve in enumerate(figure.curves):
        x, values = curve_points(results, curve, figure.scale)
        axes.plot(x, values[:, 0], label=curve.label, **line_style(k, len(x), alone=len(figure.curves) == 1))
    if len(limits := motor_limits(results, figure)):
        axes.plot(*limits.T, color=LIMIT, linestyle="--", label="limits")
    axes.set_xlabel(figure.x_label)
    axes.set_ylabel(figure.y_label)
    legend(axes)


def draw_placement(axes: Axes, figure: FigureRecord, results: Results) -> None:
    """Reach of a single patch along the link by mode; below, the patches found and those spread evenly."""
    group = f"{figure.analysis}/placement"
    if not results.has(group):
        raise InputError(
            f'{results.path}: figure "{figure.name}": expected an analysis of kind = "placement", found'
            f' "{figure.analysis}"'
        )
    body = results.attributes(group)["body"]
    length = next(layout["length"] for layout in results.scene["pzt"] if layout["body"] == body)
    centers, frequency = results[f"{group}/candidates"], results[f"{group}/frequency"]
    for reach, f, color in zip(results[f"{group}/candidate_reach"], frequency, shades(len(frequency)), strict=True):
        axes.plot(centers, reach, color=color, label=f"{f:.4g} Hz")
    for k, (key, label) in enumerate((("best", "found"), ("even", "evenly spaced"))):
        places = [(x - length / 2, length) for x in results[f"{group}/{key}/centers"]]
        axes.broken_barh(places, (-0.12 * (k + 1), 0.08), facecolor=COLORS[k], edgecolor="white", label=label)
    axes.set_yticks([0.0, 0.25, 0.5, 0.75, 1.0])
    axes.set_xlabel(f"distance along {body} (m)")
    axes.set_ylabel("controllability by one patch")
    legend(axes)


DRAW = {"time": draw_time_history, "placement": draw_placement, "torque-speed": _draw_torque_speed}
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
