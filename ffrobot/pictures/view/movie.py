"""From a results file to a movie of its bodies as solids, by PyVista."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...common.errors import InputError
from ...common.files import write_atomically
from ...fe_models.modal_body_file import is_modal_body_file
from ...results.file import Results
from ..movie_file import Frame, MovieOptions, check_movie, movie_outputs, moving_analysis, write_movie
from .grids import results_grid
from .pictures import draw_pictures
from .view import motion_picture, visible_scale
from .vtkhdf import vtkhdf_image


def view_movie(results_path: Path, path: Path, options: MovieOptions | None = None) -> list[str]:
    """Write a movie (.gif, .mp4) of a results file. Returns notes on what could not be drawn as it is.

    Raises `InputError` where the results cannot be read, have no such analysis or none that goes through time, or for
    another suffix; `SolveError` where the movie cannot be made or written.
    """
    options = options or MovieOptions()
    notes: list[str] = []
    check_movie(path)
    if is_modal_body_file(results_path):
        raise InputError(f"{results_path}: movie: expected a results file, found a modal body: it does not move")
    with Results(results_path) as results, tempfile.TemporaryDirectory() as place:
        analysis = moving_analysis(results, options.analysis)
        outputs, shown = np.unique(movie_outputs(results.time(analysis), options.seconds), return_inverse=True)
        grid = results_grid(results, analysis, outputs, notes)
        steps = tuple(range(len(outputs)))
        scale = visible_scale(grid, steps) if options.scale is None else options.scale
        picture = motion_picture(results, analysis, outputs, grid, steps, scale, "deflection")
        file = Path(place) / "grid.vtkhdf"
        write_atomically(file, vtkhdf_image(grid), "grid", ours=True)
        draw_pictures([replace(picture, grid=str(file), path=place, movie=True)])
        write_movie(path, _frames(Path(place), [int(k) for k in shown]))
    return list(dict.fromkeys(notes))


def _frames(folder: Path, shown: Sequence[int]) -> Iterator[Frame]:
    from PIL import Image

    for k in shown:
        with Image.open(folder / f"{k:05d}.png") as image:
            yield np.asarray(image.convert("RGB"))
