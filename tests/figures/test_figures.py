"""Figures of a case that is really solved: the standard ones, those of `figures.toml`, and what it refuses."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ffrobot.cli import cli
from ffrobot.common.errors import InputError
from ffrobot.pictures.figures.figure_file import load_figures
from ffrobot.pictures.figures.plot import plot_results

CASES = Path(__file__).parents[2] / "cases"


@pytest.fixture(scope="session")
def solved(tmp_path_factory):
    """Results of the slider-crank, in a folder without `figures.toml`."""
    path = tmp_path_factory.mktemp("solved") / "scene.results.h5"
    cli(["solve", str(CASES / "slider_crank" / "scene.toml"), "-o", str(path)], standalone_mode=False)
    return path


@pytest.fixture
def results(solved, tmp_path):
    return Path(shutil.copy(solved, tmp_path))


def stems(paths):
    return {path.name.removesuffix(path.suffix) for path in paths}


def figures_beside(results, text):
    path = results.parent / "figures.toml"
    path.write_text(text)
    return path


def test_standard_figures_are_png_and_pdf(results, tmp_path):
    written = plot_results(results, tmp_path / "figures")
    assert {path.suffix for path in written} == {".png", ".pdf"}
    assert all(path.stat().st_size > 1000 for path in written)
    expected = {"configurations_inverse", "path_slider", "deflection_rod.mid", "force_slider", "reaction_A"}
    assert expected <= stems(written)


def test_formats_are_those_asked_for(results, tmp_path):
    figures_beside(results, '[[figure]]\nname = "a"\ncurves = [{ data = "inverse/joints/O/reaction", label = "" }]')
    first, second = (plot_results(results, tmp_path / name, ["svg", "png"]) for name in ("first", "second"))
    assert [path.name for path in first] == ["a.svg", "a.png"]
    assert "<svg" in first[0].read_text(encoding="utf-8")
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in second]
    with pytest.raises(InputError, match='format: expected one or several of png, pdf, svg, found "png,eps"'):
        plot_results(results, tmp_path / "third", ["png", "eps"])
    assert not (tmp_path / "third").exists()


def test_figure_file_decides_what_is_drawn(results, tmp_path):
    case = CASES / "slider_crank"
    for name in ("figures.toml", "reference.csv"):
        shutil.copy(case / name, tmp_path)
    written = plot_results(results, tmp_path / "figures")
    assert stems(written) == {"fig02_mechanism", "fig03_actuator_force", "fig04_slider_motion", "fig05_rod_midpoint"}


def test_same_results_give_the_same_files(results, tmp_path):
    figures_beside(results, '[[figure]]\nname = "a"\ncurves = [{ data = "inverse/joints/O/reaction", label = "" }]')
    first, second = (plot_results(results, tmp_path / name) for name in ("first", "second"))
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in second]


@pytest.mark.parametrize("case", ["two_link", "slider_crank"])
def test_case_figures_are_those_of_the_paper(case):
    numbers = {"two_link": range(7, 18), "slider_crank": range(2, 6)}[case]
    titles = [record.title for record in load_figures(CASES / case / "figures.toml").figure]
    assert [title.split(":")[0] for title in titles] == [f"Fig. {number}" for number in numbers]


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (
            'curves = [{ data = "inverse/joints/Q/moment", label = "" }]',
            'expected the dataset "inverse/joints/Q/moment"',
        ),
        ('curves = [{ data = "inverse/joints/O/reaction[2]", label = "" }]', "expected column 2"),
        ('kind = "path"\ncurves = [{ data = "inverse/bodies/rod/angle", label = "" }]', "expected two columns"),
        ('curves = [{ data = "a", label = "", file = "none.csv" }]', "expected an existing file"),
        ('kind = "configurations"', 'expected the keys "analysis" and "times"'),
        ('kind = "configurations"\nanalysis = "invers"\ntimes = [0.0]', 'expected the dataset "invers/time"'),
        ("colour = 1", "found an unknown key"),
    ],
)
def test_wrong_figure_files_are_refused(results, tmp_path, text, complaint):
    figures_beside(results, f'[[figure]]\nname = "a"\n{text}\n')
    with pytest.raises(InputError) as error:
        plot_results(results, tmp_path / "figures")
    assert complaint in str(error.value)
    assert not (tmp_path / "figures").exists()


def test_wrong_results_are_refused(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        plot_results(tmp_path / "absent.h5", tmp_path)
    (tmp_path / "text.h5").write_text("no results")
    with pytest.raises(InputError, match="not a readable HDF5 file"):
        plot_results(tmp_path / "text.h5", tmp_path)


def test_matplotlib_is_loaded_for_plotting_only():
    program = "import sys, ffrobot.cli, ffrobot.run.solution; print('matplotlib' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"
