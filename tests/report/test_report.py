"""What a report is made of: trees of joints, curves of many points, tables, and what it refuses."""

import html
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from beam_links import beam_link, tube
from datasets import datasets
from tables_3d import pin, planar

import ffrobot
from ffrobot.common.checksum import seal
from ffrobot.common.errors import InputError, SolveError
from ffrobot.common.version import VERSION
from ffrobot.pictures.motion import chosen_frames, targets
from ffrobot.pictures.report import write_report
from ffrobot.pictures.report.charts import MAX_POINTS, distinct_parts, kept_outputs, runs
from ffrobot.pictures.report.mechanism import mechanism
from ffrobot.pictures.report.page import table_of
from ffrobot.results.file import Results


@pytest.fixture
def results(two_link):
    with Results(two_link.folder / "scene.results.h5") as results:
        yield results


def test_curve_of_many_points_keeps_its_peaks():
    values = np.sin(np.linspace(0, 7, 300_000))
    values[123_456], values[234_567] = 9.0, -9.0
    kept = kept_outputs(values)
    assert len(kept) <= MAX_POINTS + 2
    assert {0, 123_456, 234_567, 299_999} <= set(kept)
    assert len(kept_outputs(values[:MAX_POINTS])) == MAX_POINTS


@pytest.mark.parametrize(
    ("paths", "labels"),
    [
        (["/c/beam/r.h5", "/c/solid/r.h5"], ["beam", "solid"]),
        (["../beam/r.h5", "r.h5"], ["beam", Path.cwd().name]),
        (["/c/beam/r.h5", "/c/beam/q.h5"], ["r.h5", "q.h5"]),
        (["/c/r.h5", "/c/deep/er/r.h5"], ["r.h5", "deep/er/r.h5"]),
        (["/a/x/r.h5", "/b/x/s.h5", "/b/x/r.h5"], ["a/x/r.h5", "b/x/s.h5", "b/x/r.h5"]),
        (["/c/r.h5", "/c/r.h5"], ["r.h5 (1)", "r.h5 (2)"]),
    ],
)
def test_files_of_the_same_scene_are_told_apart_by_their_paths(paths, labels):
    assert distinct_parts([Path(path) for path in paths]) == labels


def test_forward_analyses_are_measured_against_the_path_they_should_follow(results):
    by_name = {run.analysis: targets(run.results, run.analysis) for run in runs([results])}
    assert [target.point for target in by_name["joints_only"]] == ["link2.tip"]
    t = results.time("inverse")
    path = np.column_stack([1.5 * np.cos(np.pi * t / 4), np.sqrt(3) / 2 * np.cos(np.pi * t / 4)])  # scene.toml
    np.testing.assert_allclose(by_name["joints_only"][0].wanted, path, atol=1e-14)


def test_peaks_are_those_of_the_file(results, two_link):
    rows = {(analysis, what): (value, at) for analysis, what, value, at in table_of("peaks", runs([results])).rows}
    moment = two_link.file["inverse/joints/O/moment"]
    value, at = rows["inverse", "motor of joint O"]
    assert value == f"{moment.attrs['peak']:.4g} N·m"
    assert moment.attrs["peak"] > np.abs(moment[()]).max()  # between outputs
    assert float(at) == pytest.approx(moment.attrs["peak_time"], abs=1e-4)


def test_page_says_where_it_comes_from_and_what_the_summary_says(two_link_page, results):
    body = html.unescape(two_link_page.read_text(encoding="utf-8").partition('<script type="application')[0])
    files = [results.modal_files[name] for name in ("link1", "link2")]
    wanted = [text for file in files for text in (file.sha256, file.input_hash)]
    wanted += ["damping, which is zero", f"ffrobot {VERSION}", 'y = "sqrt(3)/2*cos(pi*t/4)"']  # skipped; of the scene
    wanted += [line.strip().removeprefix(f"{one.name}: ") for one in results.verdict.analyses for line in one.lines()]
    wanted += [text for texts in results.warnings.values() for text in texts]
    assert [text for text in wanted if text not in body] == []


def copy_of(case, folder):
    return shutil.copy(case.folder / "scene.results.h5", folder)


def test_page_without_modal_bodies_draws_links_through_their_points(two_link, tmp_path):
    path = tmp_path / "scene.results.h5"
    copy_of(two_link, path)
    with h5py.File(path, "r+") as file:
        file.attrs["modal_bodies"] = file.attrs["modal_bodies"].replace('.h5"', '.gone.h5"')
    seal(path)
    write_report([path], tmp_path / "r.html")
    text = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert "link1 is drawn through its points only" in text
    assert "No modal body file is where it was" in text


def test_results_that_stopped_early_have_a_page(two_link, tmp_path):
    path = copy_of(two_link, tmp_path / "stopped.results.h5")
    with h5py.File(path, "r+") as file:
        del file["joints_only"]
        for name, dataset in datasets(file["forward"]).items():
            values, about = dataset[:300], dict(dataset.attrs)
            del file["forward"][name]
            file["forward"][name] = values
            file["forward"][name].attrs.update(about)
        file["forward"].attrs["status"] = "interrupted"
    seal(path)
    write_report([path], tmp_path / "r.html")
    text = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert ">interrupted</td>" in text
    assert '>0.299 of 1</td><td class="short">300</td>' in text


def test_texts_of_a_scene_are_no_markup(two_link, tmp_path):
    path, evil = copy_of(two_link, tmp_path / "evil.results.h5"), "</script><script>alert(1)</script>"
    with h5py.File(path, "r+") as file:
        file.attrs["name"] = evil
        file.attrs["scene"] = file.attrs["scene"] + f"# {evil}"
        file.move("joints_only", "x<")
        file.attrs["scene"] = file.attrs["scene"].replace('"joints_only"', '"x<"')
    seal(path)
    write_report([path, path], tmp_path / "r.html")
    assert "<script>alert" not in (tmp_path / "r.html").read_text(encoding="utf-8")


def test_modal_body_beside_results_that_were_moved(two_link, tmp_path):
    path = copy_of(two_link, tmp_path / "scene.results.h5")
    with Results(path) as results:
        file = results.modal_files["link1"]
        shutil.copy(file.path, tmp_path / file.path.name)
    with h5py.File(path, "r+") as stored:
        stored.attrs["modal_bodies"] = stored.attrs["modal_bodies"].replace(str(file.path.parent), "/nowhere")
    seal(path)
    with Results(path) as results:
        assert results.modal_body("link1").name == "link1"
        with pytest.raises(InputError, match='"link2" was solved with, found none'):
            results.modal_body("link2")


def test_report_needs_no_matplotlib(two_link, tmp_path):
    """The extra `report` brings Plotly only. The page goes beside the first file."""
    path = copy_of(two_link, tmp_path / "scene.results.h5")
    program = (
        "import sys; sys.modules['matplotlib'] = None\nfrom ffrobot.cli import cli\n"
        f"cli(['report', {str(path)!r}], standalone_mode=False)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{path.with_suffix('.html')}\n"
    assert path.with_suffix(".html").stat().st_size < 8e6  # Plotly takes 4.8 MB of it


@pytest.mark.parametrize("missing", ["jinja2", "plotly"])
def test_what_is_not_installed_is_named(two_link, tmp_path, monkeypatch, missing):
    monkeypatch.setitem(sys.modules, missing, None)
    monkeypatch.delitem(sys.modules, "plotly.offline", raising=False)
    with pytest.raises(SolveError, match=rf"a report needs {missing}.*pip install plotly jinja2"):
        write_report([two_link.folder / "scene.results.h5"], tmp_path / "r.html")


MODES = {"count": 2, "family": "in-plane-bending"}


def test_what_moves_is_seen_first(tmp_path):
    """The page opens with the first analysis that goes through time; frames of `view` have the largest deflection."""
    arm = {"name": "arm", "link": beam_link(0.6, tube(0.02, 0.016), 4, nu=None, modes=MODES)}
    run = {"name": "swing", "kind": "pcid", "end": 1.0, "output_step": 0.01}
    path = {"name": "turn", "joint": "O", "value": "0.3*(1 - cos(6*t))"}
    tables = planar([arm], [pin("O", "ground", "arm.root")], {"name": "rest", "kind": "static"}, run, trajectory=[path])
    with ffrobot.solve(ffrobot.make_scene(**tables), tmp_path / "swing.h5") as results:
        sizes = np.linalg.norm(results["swing/points/arm.tip/deflection"], axis=1)
        frames = chosen_frames(results, "swing", 5)
        assert len(frames) == 5
        assert sizes[frames].max() > 0.99 * results.peak("swing/points/arm.tip/deflection")[0]
        entries = mechanism(runs([results]))[0]["runs"]
    assert {entry["label"]: entry["visible"] for entry in entries} == {"rest": False, "swing": True}
