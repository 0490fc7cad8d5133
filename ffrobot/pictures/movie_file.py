"""Movies from pictures: GIF through Pillow, MP4 (H.264) through ffmpeg, which is given the pictures as they come."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from io import BytesIO
from itertools import chain, repeat
from pathlib import Path

import numpy as np

from ..common.arrays import Indices, NDArray
from ..common.errors import InputError, SolveError, did_you_mean
from ..common.files import check_ending, write_atomically
from ..results.file import Results

Frame = NDArray[np.uint8]  # (height, width, 3) red, green, blue
FRAMES_A_SECOND = 25
SECONDS = 8.0  # of a movie, unless asked for otherwise
COLORS = 256  # of a frame of a GIF


@dataclass(frozen=True)
class MovieOptions:
    """Options of a movie."""

    analysis: str | None = None  # the first that goes through time if None
    seconds: float = SECONDS  # how long it plays; the whole of the analysis is shown, faster or slower than in truth
    scale: float | None = None  # of deflections; as large as can be seen well if None


def _moving_analysis(results: Results, wanted: str | None) -> str:
    moving = [name for name in results.analyses if len(results.time(name)) > 1]
    if (wanted is None and not moving) or (wanted is not None and wanted not in moving):
        other = "none" if wanted is None else f'"{wanted}"{did_you_mean(wanted, moving)}'
        names = f" ({', '.join(moving)})" if moving else ""
        raise InputError(f"{results.path}: movie: expected an analysis that goes through time{names}", other)
    return wanted or moving[0]


def movie_outputs(time: NDArray[np.float64], seconds: float) -> Indices:
    """Return the outputs (m,) that a movie of the given seconds shows: evenly spaced over `time` (T,).

    A movie shows the latest output not after its own time, as often as need be.
    """
    count = max(2, round(FRAMES_A_SECOND * seconds)) if len(time) > 1 else 1
    wanted = np.linspace(time[0], time[-1], count)
    reach = 1e-9 * (time[-1] - time[0])
    return np.asarray(np.searchsorted(time, wanted + reach, side="right") - 1, dtype=np.intp)


Draw = Callable[[Results, str, Indices, float | None, list[str]], Iterator[Frame]]
"""A frame for each of some outputs of an analysis, by a scale of deflections, with notes."""


def make_movie(results_path: Path, path: Path, options: MovieOptions | None, draw: Draw) -> list[str]:
    """Write a movie (.gif, .mp4) of a results file with frames by `draw`; return notes on what is simplified.

    Raises `InputError` where the results cannot be read, have no such analysis or none that goes through time, or for
    another suffix; `SolveError` where the movie cannot be made or written.
    """
    options = options or MovieOptions()
    notes: list[str] = []
    check_ending(path, "movie", (".gif", ".mp4"))
    is_gif = path.suffix.lower() == ".gif"
    if not is_gif:
        ffmpeg()  # before frames are drawn
    with Results(results_path) as results:
        analysis = _moving_analysis(results, options.analysis)
        outputs, counts = np.unique(movie_outputs(results.time(analysis), options.seconds), return_counts=True)
        image = _gif_image if is_gif else mp4_image
        drawn = draw(results, analysis, outputs, options.scale, notes)
        frames = chain.from_iterable(map(repeat, drawn, counts.tolist()))
        write_atomically(path, image(frames), "movie", make_folder=True)
    return list(dict.fromkeys(notes))


def _gif_image(frames: Iterable[Frame]) -> bytes:
    from PIL import Image

    first, *rest = [Image.fromarray(frame).quantize(COLORS, Image.Quantize.FASTOCTREE) for frame in frames]
    stream = BytesIO()
    hundredths = 100 // FRAMES_A_SECOND  # the unit of the format
    first.save(stream, "GIF", save_all=True, append_images=rest, duration=10 * hundredths, loop=0)
    return stream.getvalue()


def mp4_image(frames: Iterable[Frame]) -> bytes:
    """H.264 in MP4 as every browser and slide program shows it: even sizes, 4:2:0, its index at the front."""
    remaining = iter(frames)
    first = next(remaining)
    height, width = first.shape[:2]
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "movie.mp4"
        # fmt: off
        command = [
            ffmpeg(), "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}",
            "-r", str(FRAMES_A_SECOND), "-i", "-", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", "libx264",
            "-pix_fmt", "yuv420p", "-crf", "20", "-movflags", "+faststart", "-bitexact", str(path),
        ]
        # fmt: on
        with (Path(place) / "errors").open("w+b") as errors:
            with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=errors, stderr=errors) as process:
                assert process.stdin is not None
                try:
                    for frame in (first, *remaining):
                        process.stdin.write(np.ascontiguousarray(frame).tobytes())
                    process.stdin.close()
                except BrokenPipeError:
                    pass  # it has ended early, and said why
            errors.seek(0)
            said = errors.read().decode(errors="replace").strip().splitlines()
        if process.returncode or not path.is_file():
            raise SolveError(f"ffmpeg failed: {said[-1] if said else 'no reason given'}")
        return path.read_bytes()


def ffmpeg() -> str:
    """The program that makes MP4: the one on the PATH, or that of imageio-ffmpeg. Raises `SolveError`."""
    if program := shutil.which("ffmpeg"):
        return program
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    except (ModuleNotFoundError, RuntimeError):
        raise SolveError(
            "a movie in MP4 needs ffmpeg, which is not installed: apt install ffmpeg, or pip install imageio-ffmpeg;"
            " a .gif needs neither"
        ) from None
