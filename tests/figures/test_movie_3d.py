"""Movies of scenes in 3D: both programs show the tool where it was solved, from the corner that they say."""

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from ffrobot.pictures.figures.movie import write_motion
from ffrobot.pictures.movie_file import MovieOptions
from ffrobot.pictures.view import view_movie

# Azimuth −55°, elevation 25°: what goes right and up in the picture
AZIMUTH, ELEVATION = np.radians([-55.0, 25.0])
RIGHT = np.array([-np.sin(AZIMUTH), np.cos(AZIMUTH), 0.0])
UP = np.array([-np.sin(ELEVATION) * np.cos(AZIMUTH), -np.sin(ELEVATION) * np.sin(AZIMUTH), np.cos(ELEVATION)])
FRAMES = 6
SHORT = MovieOptions(seconds=FRAMES / 25, scale=1.0)


def frames_of(path):
    with Image.open(path) as movie:
        assert movie.n_frames == FRAMES
        found = []
        for k in range(FRAMES):
            movie.seek(k)
            found.append(np.asarray(movie.convert("RGB"), dtype=float))
    return found


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
        pictures.append(frames_of(path))
    true, large = pictures
    assert np.abs((true[0] - large[0])[:30, :480]).max() > 100  # the title
    assert np.abs(orange(true[3]) - orange(large[3])).max() > 3.0
