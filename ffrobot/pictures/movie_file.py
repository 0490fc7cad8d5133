"""Movies from pictures: GIF by Pillow, MP4 (H.264) by ffmpeg, which receives the pictures one by one."""

import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterable
from contextlib import suppress
from io import BytesIO
from itertools import chain, repeat
from pathlib import Path

import numpy as np

from ..common.arrays import Array, Indices, NDArray
from ..common.errors import InputError, SolveError, did_you_mean
from ..common.files import check_ending, write_atomically
from ..common.structs import struct
from ..results.file import Results

Frame = NDArray[np.uint8]  # (height, width, 3) red, green, blue
FRAMES_A_SECOND = 25
SECONDS = 8.0  # of a movie, unless asked for otherwise


@struct
class MovieOptions:
    """Options of a movie."""

    analysis: str | None = None  # None: the first over time
    seconds: float = SECONDS  # duration of the movie, which shows the whole analysis, faster or slower than in truth
    scale: float | None = None  # exaggeration of deflections; None: chosen for visibility


def movie_outputs(time: Array, seconds: float) -> Indices:
    """Return the output (m,) shown in each of m frames of a movie of some `seconds`; some are shown several times.

    It is the latest one not after even steps of `time` (T,), s.
    """
    wanted = np.linspace(time[0], time[-1], max(2, round(FRAMES_A_SECOND * seconds)))
    reach = 1e-9 * (time[-1] - time[0])
    return np.asarray(np.searchsorted(time, wanted + reach, side="right") - 1, dtype=np.intp)


Draw = Callable[[Results, str, Indices, float | None, list[str]], Iterable[Frame]]
"""Function that draws a frame for each of some outputs of an analysis, by an exaggeration, and adds to notes."""


def make_movie(results_path: Path, path: Path, options: MovieOptions | None, draw: Draw) -> list[str]:
    """Write a movie (.gif, .mp4) of a results file with frames by `draw`; return notes on simplifications.

    Raises:
        InputError: results cannot be read, have no such analysis or none over time; another suffix.
        SolveError: the movie cannot be made or written.
    """
    options = options or MovieOptions()
    notes: list[str] = []
    check_ending(path, "movie", (".gif", ".mp4"))
    image = _gif_image if path.suffix.lower() == ".gif" else _mp4_image
    if image is _mp4_image:
        _ffmpeg()  # before frames are drawn
    with Results(results_path) as results:
        moving = [name for name in results.analyses if len(results.time(name)) > 1]
        analysis = options.analysis or next(iter(moving), "")
        if analysis not in moving:
            other = f'"{analysis}"{did_you_mean(analysis, moving)}' if analysis else "none"
            names = f" ({', '.join(moving)})" if moving else ""
            raise InputError(f"{results.path}: movie: expected an analysis that goes through time{names}", other)
        outputs, counts = np.unique(movie_outputs(results.time(analysis), options.seconds), return_counts=True)
        drawn = draw(results, analysis, outputs, options.scale, notes)
        frames = chain.from_iterable(map(repeat, drawn, counts.tolist()))
        write_atomically(path, image(frames), "movie", make_folder=True)
    return list(dict.fromkeys(notes))


def _gif_image(frames: Iterable[Frame]) -> bytes:
    from PIL import Image

    first, *rest = [Image.fromarray(frame).quantize(256, Image.Quantize.FASTOCTREE) for frame in frames]
    stream = BytesIO()
    first.save(stream, "GIF", save_all=True, append_images=rest, duration=1000 // FRAMES_A_SECOND, loop=0)
    return stream.getvalue()


def _mp4_image(frames: Iterable[Frame]) -> bytes:
    """H.264 in MP4 as every browser and slide program shows it: even sizes, 4:2:0, its index at the front."""
    remaining = iter(frames)
    first = next(remaining)
    height, width = first.shape[:2]
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "movie.mp4"
        # fmt: off
        command = [
            _ffmpeg(), "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}",
            "-r", str(FRAMES_A_SECOND), "-i", "-", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", "libx264",
            "-pix_fmt", "yuv420p", "-crf", "20", "-movflags", "+faststart", "-bitexact", str(path),
        ]
        # fmt: on
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            assert process.stdin is not None
            with suppress(BrokenPipeError):  # it has ended early, and said why
                for frame in chain([first], remaining):
                    process.stdin.write(frame.tobytes())
            said = process.communicate()[1].decode(errors="replace").strip().splitlines()
        if process.returncode or not path.is_file():
            raise SolveError(f"ffmpeg failed: {said[-1] if said else 'no reason given'}")
        return path.read_bytes()


def _ffmpeg() -> str:
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
