"""Movies: what is in them, read back by Pillow and by ffmpeg, and what is refused."""

import sys

import numpy as np
import pytest
from PIL import Image

from ffrobot.cli import cli
from ffrobot.common.errors import InputError, SolveError
from ffrobot.pictures.figures.movie import FACE, GROUND, write_motion
from ffrobot.pictures.movie_file import MovieOptions, movie_outputs
from ffrobot.pictures.view import view_movie

HALF = MovieOptions(analysis="forward", seconds=0.52, scale=1.0)
PIXELS = (576, 960)


@pytest.fixture(scope="module")
def results(slider_crank):
    return slider_crank.folder / "scene.results.h5"


@pytest.fixture(scope="module")
def gif(results, tmp_path_factory):
    path = tmp_path_factory.mktemp("movie") / "m.gif"
    assert write_motion(results, path, HALF) == []
    with Image.open(path) as movie:
        frames = []
        for k in range(movie.n_frames):
            movie.seek(k)
            assert movie.info["duration"] == 40  # ms
            frames.append(np.asarray(movie.convert("RGB"), dtype=np.int16))
        assert movie.info["loop"] == 0
    return np.array(frames)


def near(frames, color, reach=40):
    """Where pixels have that colour."""
    wanted = [int(color[k : k + 2], 16) for k in (1, 3, 5)]
    return np.abs(frames - wanted).max(axis=-1) <= reach


def test_gif_shows_the_whole_motion(gif, slider_crank):
    """The crank pin goes round: its angle in the picture, seen from the ground, against that of the solver."""
    assert gif.shape == (13, *PIXELS, 3)
    time = slider_crank.file["forward/time"][()]
    angle = slider_crank.file["forward/bodies/crank/angle"][()]
    ground_y, ground_x = centre_of(near(gif[0], GROUND, 8))
    for k, t in enumerate(np.linspace(time[0], time[-1], 13)):
        row = np.flatnonzero(time <= t + 1e-9)[-1]
        way = np.array([np.cos(angle[row]), np.sin(angle[row])])
        blue = np.argwhere(near(gif[k], FACE, 60))
        arm = np.stack([blue[:, 1] - ground_x, ground_y - blue[:, 0]], axis=1)
        across, along = np.abs(arm @ [-way[1], way[0]]), arm @ way
        assert np.count_nonzero((across < 6) & (along > 20) & (along < 100)) > 60, k


def centre_of(where):
    """Row and column of the middle of the triangle on the ground, left of the robot; bars hide parts of it."""
    rows, columns = np.nonzero(where[60:500, 90:950])
    left, right = columns.min(), columns[columns < columns.min() + 18].max()
    return 60 + rows[columns <= right].max() - (right - left) / 2, 90 + (left + right) / 2


def test_mp4_shows_the_same(gif, results, tmp_path):
    """H.264 decoded again by ffmpeg."""
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    arguments = ["plot", results, "--movie", tmp_path / "m.mp4", "--seconds", 0.52, "--analysis", "forward"]
    cli([*map(str, arguments), "--scale", "1"], standalone_mode=False)
    assert [path.name for path in tmp_path.iterdir()] == ["m.mp4"]
    reader = imageio_ffmpeg.read_frames(str(tmp_path / "m.mp4"))
    about = next(reader)
    assert about["size"] == PIXELS[::-1]
    assert about["fps"] == 25
    frames = np.array([np.frombuffer(frame, np.uint8).reshape(*PIXELS, 3) for frame in reader], dtype=np.int16)
    assert frames.shape == gif.shape
    differences = np.array([np.abs(gif - frame).mean(axis=(1, 2, 3)) for frame in frames])
    assert (differences.argmin(axis=1) == np.arange(13)).all()  # each like its own frame more than like any other
    assert differences.diagonal().max() < 3.0  # of 255


def test_movie_of_uneven_outputs_keeps_time():
    """Frames show the latest output not after their time, the first and the last at its ends."""
    time = np.array([0.0, 0.1, 0.15, 0.6, 1.0])
    outputs = movie_outputs(time, 0.44)
    assert len(outputs) == 11  # 25 a second
    np.testing.assert_array_equal(outputs, [0, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4])


def test_what_is_refused(results, two_link, tmp_path, monkeypatch):
    with pytest.raises(InputError, match=r'expected a name that ends in "\.gif" or "\.mp4", found "m\.avi"'):
        write_motion(results, tmp_path / "m.avi")
    with pytest.raises(InputError, match=r"expected an analysis that goes through time \(inverse, forward\), found"):
        write_motion(results, tmp_path / "m.gif", MovieOptions(analysis="forwards"))
    body = two_link.folder / "link1.h5"
    if body.exists():
        with pytest.raises(InputError, match="found a modal body"):
            view_movie(body, tmp_path / "m.gif")
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(SolveError, match=r"needs ffmpeg, which is not installed: .* pip install imageio-ffmpeg"):
        write_motion(results, tmp_path / "m.mp4")
    assert not list(tmp_path.iterdir())
