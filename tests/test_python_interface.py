"""`import ffrobot`: what the command line does, in a few lines of Python."""

import gc
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version

import numpy as np
import pytest
import tomli_w
from beam_links import beam_link, tube
from tables_3d import pin, planar

import ffrobot
from ffrobot.cli import cli
from ffrobot.mbs.run.record import Run
from ffrobot.present import console
from ffrobot.run.watcher import Watcher

LINK = beam_link(0.6, tube(0.02, 0.016), 10, name="arm", modes={"count": 3, "family": "in-plane-bending"})
MOMENT = "inverse/joints/shoulder/moment"
KEYS = {"time", "bodies/arm/angle", "points/arm.tip/position[0]", "joints/shoulder/moment", "energy/kinetic"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the modal body of an arm."""
    folder = tmp_path_factory.mktemp("arm")
    ffrobot.make_link(LINK, folder / "arm.h5")
    return folder


def swing(folder, **changes):
    keys = planar(
        [{"name": "arm", "modal": folder / "arm.h5"}], [pin("shoulder", "ground", "arm.root")],
        {"name": "inverse", "kind": "pcid", "end": np.float64(0.02), "output_step": 0.001},
        name="swing", initial={"state": "static"},
        trajectory=[{"name": "turn", "joint": "shoulder", "value": "0.5*sin(t)"}],
    )  # fmt: skip
    return ffrobot.make_scene(folder=folder, **keys | {"gravity": np.array([0.0, -9.81])} | changes)


@pytest.fixture(scope="module")
def results(folder):
    return ffrobot.solve(swing(folder))


def test_scene_made_in_python_is_the_scene_of_a_file(folder, results):
    scene = swing(folder)
    (folder / "swing.toml").write_text(scene.text, encoding="utf-8")
    from_file = ffrobot.solve(folder / "swing.toml")
    assert ffrobot.load_scene(folder / "swing.toml").analysis == scene.analysis
    assert results.columns("inverse").keys() >= KEYS
    for name, values in from_file.columns("inverse").items():
        np.testing.assert_array_equal(values, results.columns("inverse")[name])


def test_nothing_of_a_run_stays_beside_its_results(folder):
    """States between outputs are many: they go at once, not when Python searches for cycles of objects."""
    gc.collect()
    gc.disable()
    try:
        before = {id(one) for one in gc.get_objects() if isinstance(one, Run)}
        results = ffrobot.solve(swing(folder))
        assert not [one for one in gc.get_objects() if isinstance(one, Run) and id(one) not in before]
    finally:
        gc.enable()
    assert len(results.time("inverse")) == 21


def test_several_solves_at_once(folder):
    """From threads, links of their own included: to the last bit what one after the other computes."""

    def solved(k):
        link = LINK | {"geometry": LINK["geometry"] | {"length": 0.6 + 0.01 * k}}
        body = [{"name": "arm", "link": link} if k else {"name": "arm", "modal": folder / "arm.h5"}]
        return ffrobot.solve(swing(folder, body=body)).columns("inverse")

    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(solved, [0, 1, 2, 0, 1, 2]))
    for k in range(3):
        for name, values in solved(k).items():
            np.testing.assert_array_equal(values, together[k][name])
            np.testing.assert_array_equal(values, together[k + 3][name])


def test_link_in_the_scene_is_that_of_its_file(folder, results):
    """Under the body's name where it has none, and in TOML as in Python."""
    keys = LINK | {"geometry": LINK["geometry"] | {"length": np.float64(0.6)}}
    del keys["name"]
    scene = swing(folder, body=[{"name": "arm", "link": keys}])
    (folder / "inline.toml").write_text(scene.text, encoding="utf-8")
    assert "[body.link.geometry" in scene.text
    for inline in (scene, folder / "inline.toml"):
        np.testing.assert_array_equal(ffrobot.solve(inline)[MOMENT], results[MOMENT])


def test_link_made_of_a_dictionary(folder, tmp_path):
    made = ffrobot.make_link(LINK, tmp_path / "arm.h5")
    assert made.path == tmp_path / "arm.h5"
    np.testing.assert_array_equal(made.body.frequency, ffrobot.read_modal_body(folder / "arm.h5").frequency)
    assert not ffrobot.make_link(LINK, tmp_path / "arm.h5").computed
    again = [ffrobot.make_link(LINK | {"damping": {"ratio": 0.05}}) for _ in range(2)]
    assert [one.computed for one in again] == [True, False]  # from the cache, by content
    assert again[0].path == again[1].path
    assert again[0].path.parent.name == "links"
    with pytest.raises(ffrobot.InputError, match=r"<link made in Python>: modes\.count: expected a whole number"):
        ffrobot.make_link(LINK | {"modes": {"count": "three"}})


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"body": [{"name": "arm", "link": 3}]}, 'body "arm": link: expected the name of a link file in quotes or a t'),
        ({"gravity": [0.0, 1j]}, "expected numbers, text, lists and tables"),
        ({"analysis": None}, "analysis: expected a value, since this key is required"),
    ],
)
def test_mistakes_are_named_as_in_a_file(folder, changes, complaint):
    with pytest.raises(ffrobot.InputError, match=complaint) as error:
        swing(folder, **changes)
    assert "<scene made in Python>: " in str(error.value)


class Stopping(Watcher):
    """Ctrl-C comes in the first analysis, which is over at once."""

    def stage(self, title):
        if title == 'analysis "first"':
            signal.raise_signal(signal.SIGINT)


def test_a_signal_between_analyses_does_not_leave_the_others_out_in_silence(folder, tmp_path):
    two = [{"name": "first", "kind": "static"}, {"name": "second", "kind": "static"}]
    with pytest.raises(ffrobot.SolveError, match="stopped on request before all analyses"):
        ffrobot.solve(swing(folder, analysis=two), tmp_path / "r.h5", watcher=Stopping())
    with ffrobot.Results(tmp_path / "r.h5") as results:
        assert results.attributes("first")["status"] == "completed"


def test_warnings_name_no_folder_of_a_scene_without_a_file(folder):
    rough = {"name": "rough", "kind": "fcid", "shape": "zero", "end": 0.01, "output_step": 0.001}
    with pytest.warns(ffrobot.FfrobotWarning) as given:
        ffrobot.solve(swing(folder, analysis=[rough]))
    assert all(str(each.message).startswith('<scene made in Python>: analysis "rough": ') for each in given)


def test_run_that_stops_early_keeps_its_file(folder, tmp_path):
    few = {"name": "inverse", "kind": "pcid", "end": 0.02, "output_step": 0.001, "max_steps": 3}
    with pytest.raises(ffrobot.SolveError, match="raise max_steps"):
        ffrobot.solve(swing(folder, analysis=[few]), tmp_path / "r.h5")
    with ffrobot.Results(tmp_path / "r.h5") as results:
        assert results.attributes("inverse")["status"] == "too many steps"
        assert str(results.verdict) == "inverse: ended early (too many steps)"
        assert results.verdict["inverse"].feasible is None


def test_objects_print_what_they_are(folder, results):
    # 2700 kg/m³ · π/4 (0.02² − 0.016²) m² · 0.6 m = 0.18322 kg
    body = ffrobot.read_modal_body(folder / "arm.h5")
    assert repr(body).startswith(
        "ModalBody('arm'): beam, cantilever, 0.6 m, 0.18322 kg, 3 modes and 2 attachment modes of "
    )
    assert repr(swing(folder)) == ("Scene('swing'): bodies arm; joints shoulder; trajectories turn; analyses inverse")
    assert repr(results).splitlines()[1] == "  inverse: pcid, 21 outputs up to 0.02 s, completed"
    closed = ffrobot.solve(swing(folder))
    closed.close()
    assert repr(closed).endswith("closed")


def test_every_public_name_is_there():
    assert set(ffrobot.__all__) <= set(dir(ffrobot))
    for name in ffrobot.__all__:
        assert getattr(ffrobot, name).__doc__
    with pytest.raises(AttributeError, match="no attribute 'sovle'"):
        ffrobot.sovle  # noqa: B018
    assert ffrobot.__version__ == version("ffrobot")


def test_results_may_be_left_open(tmp_path):
    """HDF5 closes them after Python has ended."""
    script = "import ffrobot; results = ffrobot.solve('scene.toml'); results.append = [results]"
    rod = {"mass": 1.0, "inertia": 0.1, "center": [0.3, 0.0], "points": {"root": [0.0, 0.0]}}
    fall = {"name": "fall", "kind": "forward", "end": 0.1, "output_step": 0.1}
    tables = planar([{"name": "rod", "rigid": rod}], [pin("pin", "ground", "rod.root")], fall)
    (tmp_path / "scene.toml").write_text(tomli_w.dumps(tables), encoding="utf-8")
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_results_in_memory_can_be_saved_and_drawn(folder, results, tmp_path):
    """As those in a file: figures, page, view, the same numbers."""
    saved = results.save(tmp_path / "saved.h5")
    with ffrobot.Results(saved) as again:
        np.testing.assert_array_equal(again[MOMENT], results[MOMENT])
    assert ffrobot.plot_results(results, tmp_path / "figures", ["svg"])
    assert ffrobot.view_file(results, tmp_path / "view", pictures=False)
    ffrobot.write_report(results, tmp_path / "one.html")
    ffrobot.write_report([results, saved], tmp_path / "two.html")
    assert (tmp_path / "one.html").stat().st_size < (tmp_path / "two.html").stat().st_size
    with pytest.raises(ffrobot.InputError, match="found one of kind html"):
        results.save(tmp_path / "one.html")


@pytest.mark.parametrize(("library", "view"), [("pandas", "frame"), ("xarray", "to_xarray")])
def test_library_that_is_not_installed(results, monkeypatch, library, view):
    monkeypatch.setitem(sys.modules, library, None)
    monkeypatch.delitem(sys.modules, "ffrobot.results.labelled", raising=False)
    with pytest.raises(
        ffrobot.SolveError, match=f"this needs {library}, which is not installed: pip install {library}"
    ):
        getattr(results, view)("inverse")


def test_pandas_view(results):
    frame = results.frame("inverse")
    assert frame.index.name == "time"
    np.testing.assert_array_equal(frame.index, results.time("inverse"))
    np.testing.assert_array_equal(frame["joints/shoulder/moment"], results[MOMENT])
    assert "time" not in frame.columns


def test_xarray_has_dimensions_units_and_coordinates(results, folder, tmp_path):
    """Every history as in the file; components by the names of their axes, modes by their numbers; NetCDF."""
    pytest.importorskip("xarray")
    dataset = results.to_xarray("inverse")
    assert set(dataset.data_vars) | {"time"} == set(results.histories("inverse"))
    for name, values in dataset.data_vars.items():
        np.testing.assert_array_equal(values, results[f"inverse/{name}"])
        assert values.dims[0] == "time"
        assert "units" in values.attrs
    np.testing.assert_array_equal(dataset["time"], results.time("inverse"))
    tip, modal = dataset["points/arm.tip/position"], dataset["bodies/arm/modal"]
    np.testing.assert_array_equal(tip.sel(axis="y"), results["inverse/points/arm.tip/position"][:, 1])
    assert list(modal["mode of arm"]) == list(range(1, results.modal_body("arm").mode_count + 1))
    units = {name: dataset[f"joints/shoulder/{name}"].attrs["units"] for name in ("coordinate", "rate", "moment")}
    assert units == {"coordinate": "rad", "rate": "rad/s", "moment": "N m"}
    assert dataset.attrs["kind"] == "pcid"
    held = ffrobot.solve(swing(folder, analysis=[{"name": "held", "kind": "static"}])).to_xarray("held")
    assert held["joints_locked/frequency"].dims == ("time", "joints_locked/frequency 1")
    for number, each in enumerate((dataset, held)):
        each.to_netcdf(tmp_path / f"{number}.nc", engine="scipy")


def test_verdict_says_what_the_file_holds(folder, tmp_path, capsys):
    """Peaks, RMS and limits of the motor, the deflection, what to try next; `ffrobot solve` prints the answer."""
    scene = swing(folder, joint=[pin("shoulder", "ground", "arm.root", moment_limit=0.4)])
    results = ffrobot.solve(scene)
    found = results.verdict["inverse"]
    moment, deflection = results[MOMENT], results["inverse/points/arm.tip/deflection"]
    motor = found.motors["shoulder"]
    assert motor.moment == results.attributes("inverse/joints/shoulder/moment")["peak"] > 0.4
    assert motor.moment == pytest.approx(np.abs(moment).max(), rel=1e-5)  # of outputs, which may miss the top
    square = (moment[1:] ** 2 + moment[:-1] ** 2).mean() / 2
    assert motor.rms_moment == pytest.approx(np.sqrt(square), rel=1e-5)
    assert found.feasible is False
    assert found.answer.startswith("limits exceeded: motor shoulder (required/available = ")
    largest = pytest.approx(np.linalg.norm(deflection, axis=1).max(), rel=1e-5)
    assert found.deflection == (largest, "arm.tip", pytest.approx(0.0, abs=5e-4))
    assert any("less load" in text for text in found.advice)  # m g L/2 = 0.539 N·m exceeds the limit at rest
    (folder / "limited.toml").write_text(scene.text, encoding="utf-8")
    cli(["solve", str(folder / "limited.toml"), "-o", str(tmp_path / "r.h5")], standalone_mode=False)
    printed = " ".join(capsys.readouterr().out.split())
    assert "inverse pcid limits exceeded" in printed
    assert "limits exceeded" in results._repr_html_()
    with pytest.raises(KeyError):
        results.verdict["invers"]


def test_progress_in_a_log_is_a_line_now_and_then(capsys, monkeypatch):
    monkeypatch.setattr(console, "EVERY", 0.0)
    with console.Display() as display:
        display.stage('analysis "inverse"')
        display.advance(0.25, 1.0)
    lines = capsys.readouterr().err.splitlines()
    told = [line.partition(" (")[0] for line in lines]
    assert told == ['ffrobot: analysis "inverse"', 'ffrobot: analysis "inverse", 0.25 of 1']


def test_numbers_of_numpy_with_more_digits(folder):
    """`tolist` leaves them as they are."""
    payload = [{"point": "arm.tip", "mass": np.longdouble("0.5"), "center": np.array([0.1, 0.0], np.longdouble)}]
    assert swing(folder, payload=payload).payload == swing(folder, payload=[payload[0] | {"mass": 0.5}]).payload


def optimised(**wrong):
    ffrobot.optimise("scene.toml", **{"vary": ["a=1:2"]} | wrong)


MISTAKES = {
    r'^optimise: method: expected "auto", "slsqp", .* or "all", found \'SLSQP\'': lambda: optimised(method="SLSQP"),
    "^optimise: vary: expected a list of texts, found 'a=1:2'": lambda: optimised(vary="a=1:2"),
    "^optimise: starts: expected a whole number, found 1.5": lambda: optimised(starts=1.5),
    "^optimise: processes: 0 is not in the range": lambda: optimised(processes=0),
    "^optimise: tolerance: nan is not a finite number": lambda: optimised(tolerance=float("nan")),
    "expected a scene file, or a scene .*, found dict": lambda: ffrobot.solve({"name": "x"}),
    "resume: expected the output of the run": lambda: ffrobot.solve("scene.toml", resume=True),
    "plot_results: formats: expected a list of texts, found 'png'": lambda: ffrobot.plot_results("r.h5", "f", "png"),
    "fit_measured: vary: expected a list of texts": lambda: ffrobot.fit_measured("arm.toml", "modes.csv", "material"),
}


@pytest.mark.parametrize("says", MISTAKES)
def test_arguments_of_another_kind(says):
    with pytest.raises(ffrobot.InputError, match=says):
        MISTAKES[says]()


def test_a_group_is_no_dataset(results):
    with pytest.raises(ffrobot.InputError, match=r'found the group "inverse/joints/shoulder" of .*shoulder/moment"'):
        results["inverse/joints/shoulder"]
