"""Figures of a case that is really solved: the standard ones, those of `figures.toml`, and what it refuses."""

import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ffrobot.common.errors import InputError
from ffrobot.mbs.joints.joint import MotorLimits
from ffrobot.pictures.figures.plot import draw_time_history, plot_file
from ffrobot.pictures.figures.shared import Curve, FigureRecord, curve_points, limit_curves, read_points
from ffrobot.pictures.figures.style import new_axes
from ffrobot.pictures.motion import visible_exaggeration
from ffrobot.results.file import Results

CASES = Path(__file__).parents[2] / "cases"


@pytest.fixture
def results(slider_crank, tmp_path):
    """Of the slider-crank, in a folder without `figures.toml`."""
    return Path(shutil.copy(slider_crank.folder / "scene.results.h5", tmp_path))


def stems(paths):
    return {path.name.removesuffix(path.suffix) for path in paths}


def figures_beside(results, text):
    path = results.parent / "figures.toml"
    path.write_text(text)
    return path


def test_standard_figures_are_png_and_pdf(results, tmp_path):
    written = plot_file(results, tmp_path / "figures")
    assert {path.suffix for path in written} == {".png", ".pdf"}
    assert all(path.stat().st_size > 1000 for path in written)
    assert stems(written) == {"configurations_inverse", "path_slider", "deflection_rod.mid", "force_slider"}


def test_formats_are_those_asked_for(results, tmp_path):
    figures_beside(results, '[[figure]]\nname = "a"\ncurves = [{ data = "inverse/joints/O/reaction", label = "" }]')
    first, second = (plot_file(results, tmp_path / name, ["svg", "png"]) for name in ("first", "second"))
    assert [path.name for path in first] == ["a.svg", "a.png"]
    assert "<svg" in first[0].read_text(encoding="utf-8")
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in second]
    with pytest.raises(InputError, match='format: expected one or several of png, pdf, svg, found "png,eps"'):
        plot_file(results, tmp_path / "third", ["png", "eps"])
    assert not (tmp_path / "third").exists()


def test_figure_file_decides_what_is_drawn(results, tmp_path):
    case = CASES / "slider_crank"
    for name in ("figures.toml", "reference.csv"):
        shutil.copy(case / name, tmp_path)
    written = plot_file(results, tmp_path / "figures")
    assert stems(written) == {"fig02_mechanism", "fig03_actuator_force", "fig04_slider_motion", "fig05_rod_midpoint"}


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ('curves = [{ data = "inverse/Q/moment", label = "" }]', 'expected the dataset "inverse/Q/moment"'),
        ('curves = [{ data = "inverse/joints/O/reaction[2]", label = "" }]', "expected column 2"),
        ('kind = "path"\ncurves = [{ data = "inverse/bodies/rod/angle", label = "" }]', "expected two columns"),
        ('curves = [{ data = "a", label = "", file = "none.csv" }]', "expected an existing file"),
        ('kind = "configurations"', 'expected "analysis", "times" in kind'),
        ('kind = "configurations"\nanalysis = "invers"\ntimes = [0.0]', 'expected the dataset "invers/time"'),
        ("colour = 1", "found an unknown key"),
    ],
)
def test_wrong_figure_files_are_refused(results, tmp_path, text, complaint):
    figures_beside(results, f'[[figure]]\nname = "a"\n{text}\n')
    with pytest.raises(InputError) as error:
        plot_file(results, tmp_path / "figures")
    assert complaint in str(error.value)
    assert not (tmp_path / "figures").exists()


def test_only_the_figures_asked_for(results, tmp_path):
    written = plot_file(results, tmp_path / "some", ["png"], ["reaction_*", "path_slider"])
    assert stems(written) == {"path_slider", *(f"reaction_{joint}" for joint in ("O", "A", "B", "guide"))}
    with pytest.raises(InputError, match=r'--only: expected the name of a figure.*found "reactoin_A" \(did you mean'):
        plot_file(results, tmp_path / "none", ["png"], ["reactoin_A"])
    assert not (tmp_path / "none").exists()


def test_limits_of_a_motor_over_its_speed():
    """Every point of the curve is at one limit and within the others; without limits there is none."""
    limits = MotorLimits(moment=20.0, speed=5.0, power=40.0)

    def drawn(limits, *largest):
        points = limit_curves(limits, *largest)
        return points[~np.isnan(points).any(axis=1)]

    points = drawn(limits, 4.0, 18.0)
    speed, moment = np.abs(points).T
    shares = np.array([moment / 20.0, speed / 5.0, speed * moment / 40.0])
    np.testing.assert_allclose(shares.max(axis=0), 1.0, rtol=1e-12)
    assert {tuple(sign) for sign in np.sign(points)} >= {(1, 1), (-1, 1), (1, -1)}
    assert len(limit_curves(MotorLimits(), 4.0, 18.0)) == 0
    np.testing.assert_allclose(np.abs(drawn(MotorLimits(power=40.0), 4.0, 18.0)).prod(axis=1), 40.0, rtol=1e-12)
    speed, moment = np.abs(drawn(MotorLimits(moment=3.0), 4.0, 2.0)).T
    np.testing.assert_array_equal(moment, 3.0)
    assert 4.0 < speed.max() < 5.0  # no farther than the data ask for
    corners = drawn(MotorLimits(moment=3.0, speed=2.0), 0.1, 0.1)  # a rectangle, however small the data
    assert {tuple(point) for point in np.abs(corners)} == {(0, 3), (2, 3), (2, 0)}


def test_magnitude_scale_and_x_of_a_curve(results):
    name = "inverse/joints/A/reaction"
    with Results(results) as held:
        x, values = curve_points(held, Curve(data=name, label="", magnitude=True, x="inverse/joints/O/rate"), 1e3)
        np.testing.assert_allclose(values[:, 0], 1e3 * np.hypot(*held[name].T), rtol=1e-12)
        np.testing.assert_array_equal(x, held["inverse/joints/O/rate"])


@pytest.mark.parametrize(("deflection", "s"), [(0.0, 1.0), (1e-7, 1.0), (1e-5, 1000.0), (1e-3, 50.0), (0.2, 1.0)])
def test_exaggeration_of_what_can_be_seen(deflection, s):
    """Five percent of a robot of one meter at most; none of a rigid robot."""
    assert visible_exaggeration(1.0, deflection) == s


def voltages_drawn(time, voltages):
    """Between limits of ±200 V."""
    results = SimpleNamespace(data=lambda _: voltages, time=lambda _: time)
    record = FigureRecord(name="v", curves=(Curve(data="v", label="patch"),), y_label="voltage (V)", limits=(-200, 200))
    figure, axes = new_axes("")
    draw_time_history(axes, record, results)
    figure.canvas.draw()
    return axes


@pytest.mark.parametrize(("patches", "is_map"), [(10, True), (4, False)])
def test_many_saturated_voltages_are_drawn_as_a_map(patches, is_map):
    """A row for each patch with its voltage; few patches as lines, with their limits, and times at these shaded."""
    time = np.linspace(0.0, 1.0, 50)
    axes = voltages_drawn(time, 200.0 * np.sign(np.sin(np.outer(time + 0.01, np.arange(1.0, patches + 1.0)) * 9.0)))
    assert len(axes.images) == is_map
    assert len(axes.lines) == (0 if is_map else patches + 2)
    assert len(axes.collections) == (0 if is_map else 1)
    if is_map:
        assert axes.images[0].get_clim() == (-200.0, 200.0)
        assert axes.get_ylabel() == "patch"


def test_times_at_a_limit_are_shaded():
    """From 0.5 s on the second patch is at its limit; 0.1 % below it is not."""
    time = np.linspace(0.0, 1.0, 101)
    voltages = np.stack([199.7 * np.sin(2 * np.pi * time), np.minimum(400.0 * time, 200.0)], axis=1)
    (shade,) = voltages_drawn(time, voltages).collections
    (span,) = shade.get_paths()
    assert [span.vertices[:, 0].min(), span.vertices[:, 0].max()] == pytest.approx([0.5, 1.0])


def test_cells_of_points_that_are_no_numbers_are_named_by_their_line(tmp_path):
    (tmp_path / "points.csv").write_text("t,a,b\n0,1,2\n# rest\n1,3\n")
    time, values = read_points(tmp_path / "points.csv", "a")
    assert (time.tolist(), values.tolist()) == ([0.0, 1.0], [1.0, 3.0])
    with pytest.raises(InputError, match=r"line 4: expected 2 numbers .*, found '1'"):
        read_points(tmp_path / "points.csv", "b")
