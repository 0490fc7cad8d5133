"""Movies: what is in them, read back by Pillow and by ffmpeg, and what is refused; both programs show tools in 3D."""

import sys

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

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
            frames.append(np.asarray(movie.convert("RGB")))
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
    frames = (np.frombuffer(frame, np.uint8).reshape(*PIXELS, 3).astype(np.int16) for frame in reader)
    differences = np.array([[np.abs(one - frame).mean() for one in gif] for frame in frames])
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


# Azimuth −55°, elevation 25°: what goes right and up in the picture
AZIMUTH, ELEVATION = np.radians([-55.0, 25.0])
RIGHT = np.array([-np.sin(AZIMUTH), np.cos(AZIMUTH), 0.0])
UP = np.array([-np.sin(ELEVATION) * np.cos(AZIMUTH), -np.sin(ELEVATION) * np.sin(AZIMUTH), np.cos(ELEVATION)])
FRAMES = 6
SHORT = MovieOptions(seconds=FRAMES / 25, scale=1.0)


def frames_of(path):
    with Image.open(path) as movie:
        assert movie.n_frames == FRAMES
        for k in range(FRAMES):
            movie.seek(k)
            yield np.asarray(movie.convert("RGB"), dtype=np.float32)


def orange(frame):
    """Middle (column, row) of what is orange: the tool's axis x, from the tip onwards. Nothing else is."""
    red, green, blue = np.moveaxis(frame, 2, 0)
    rows, columns = np.nonzero((red > 1.6 * green) & (green > 1.2 * blue) & (red > 90))
    inside = rows < frame.shape[0] - 170  # above the directions and the colour bar
    rows, columns = rows[inside], columns[inside]
    assert len(rows) > 15
    return 0.5 * np.array([columns.min() + columns.max(), rows.min() + rows.max()])


@pytest.mark.parametrize("write", [write_motion, pytest.param(view_movie, marks=pytest.mark.nightly)])
def test_movie_shows_the_tool_where_it_is(arm_3r, tmp_path, write, request):
    """Pixels follow a + s (r + c x) of its place r and axis x, with one a, s, c for all frames and both directions."""
    if write is view_movie:
        request.getfixturevalue("can_draw")
    assert write(arm_3r.folder / "scene.results.h5", tmp_path / "m.gif", SHORT) == []
    seen = np.array([orange(frame) for frame in frames_of(tmp_path / "m.gif")])
    time = arm_3r.file["inverse/time"][()]
    rows = [np.flatnonzero(time <= t + 1e-9)[-1] for t in np.linspace(0.0, time[-1], FRAMES)]
    tip, e = (arm_3r.file[f"inverse/points/fore.tip/{name}"][()][rows] for name in ("position", "quaternion"))
    axis = Rotation.from_quat(e[:, [1, 2, 3, 0]]).apply([1.0, 0.0, 0.0])
    one, none = np.ones(FRAMES), np.zeros(FRAMES)
    across = np.stack([one, none, tip @ RIGHT, axis @ RIGHT], axis=1)
    upwards = np.stack([none, one, -tip @ UP, -axis @ UP], axis=1)  # rows count downwards
    matrix, places = np.concatenate([across, upwards]), seen.T.ravel()
    found = np.linalg.lstsq(matrix, places, rcond=None)[0]
    scale, length = found[2:]
    assert np.abs(matrix @ found - places).max() < 2.0  # pixels
    assert np.ptp(places[:FRAMES]) > 10.0
    assert scale > 200.0  # pixels per m: the robot fills the picture
    assert 0.02 < length / scale < 0.08  # m: half of a twelfth of the robot


def test_exaggeration_is_seen_and_told(arm_3r, tmp_path):
    """At twenty times the deflection the picture differs, and its title says so."""
    pictures = []
    for scale in (1.0, 20.0):
        path = tmp_path / f"{scale:g}.gif"
        write_motion(arm_3r.folder / "scene.results.h5", path, MovieOptions(seconds=FRAMES / 25, scale=scale))
        pictures.append([*frames_of(path)][::3])
    true, large = pictures
    assert np.abs((true[0] - large[0])[:30, :480]).max() > 100  # the title
    assert np.abs(orange(true[1]) - orange(large[1])).max() > 3.0
