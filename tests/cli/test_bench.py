"""`ffrobot bench` on a scene of a user: tables, figures, errors that fall with the tolerance, refusals."""

import json
import re

import pytest
import tomli_w
from beam_links import beam_link, rectangle
from small_robots import rows
from tables_3d import pin, planar

from ffrobot import InputError
from ffrobot.bench.precision import Point, TimedRun, _is_hopeless
from ffrobot.cli import cli

MODES = {"count": 2, "family": "in-plane-bending", "attachment_modes": False}
LINK = beam_link(0.5, rectangle(0.01, 0.02), 4, nu=None, name="arm", modes=MODES)
PATCHES = {"length": 0.1, "width": 0.02, "thickness": 1e-3, "modulus": 63e9, "d31": 110e-12, "structural": False}
HELD = {"name": "held", "kind": "static"}
SCENE = planar(
    [{"name": "arm", "link": "arm.toml"}],
    [pin("shoulder", "ground", "arm.root")],
    *(HELD, {"name": "inverse", "kind": "pcid", "end": 0.02, "output_step": 0.001}),
    trajectory=[{"name": "lift", "point": "arm.tip", "y": "0.1*sin(t)"}],
    pzt=[{"body": "arm", "count": 2} | PATCHES],
)
RUN = ("--tolerances", "1e-3,1e-6", "--integrators", "dopri5,dop853", "--repeat", "2")
INTEGRATES = "expected one that integrates over time, pcid or forward, found"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench")
    (folder / "arm.toml").write_text(tomli_w.dumps(LINK), encoding="utf-8")
    (folder / "scene.toml").write_text(tomli_w.dumps(SCENE), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def done(ffrobot, folder):
    ffrobot.ok("bench", "scene.toml", *RUN, cwd=folder)
    return folder / "scene.bench"


def error(row, kind):
    return float(row[f"error_{kind}"])


def test_record_says_on_what_and_against_what(done):
    record = json.loads((done / "work_precision.json").read_text(encoding="utf-8"))
    assert record["machine"]["cores"] >= 1
    assert "-O3" in record["machine"]["compiler"]
    assert record["reference"]["integrator"] != record["reference"]["other"]
    assert max(record["reference"]["error"].values()) < 1e-6
    assert len(record["inputs"]["bodies"]["arm"]) == 64
    assert [row["repetitions"] for row in record["rows"]] == [2] * 4


def test_sources_of_error_add_up(done):
    axes = {(row["axis"], row["times"]): row for row in rows(done / "axes.csv")}
    own = [axes["mesh", "1"], axes["modes", "1"], axes["time", "1"]]
    # frequencies are of order 4, the slopes of modes between nodes, on which patches work, of order 2 to 3
    for kind, factor in {"displacement": 8, "force": 8, "voltage": 3}.items():
        assert error(axes["mesh", "2"], kind) < error(axes["mesh", "1"], kind) / factor
        assert error(axes["total", "1"], kind) < 1.05 * sum(error(row, kind) for row in own)
    assert error(axes["modes", "1.5"], "displacement") < error(axes["modes", "1"], "displacement")


def test_figures(done):
    kinds = ("displacement", "force", "moment", "voltage")
    for name in (*(f"work_precision_{kind}" for kind in kinds), "error_mesh", "error_modes"):
        assert (done / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        assert (done / f"{name}.pdf").read_bytes().startswith(b"%PDF")


def test_runs_over_budget_stay_in_the_table(ffrobot, folder):
    run = ("--tolerances", "1e-6", "--integrators", "dop853,generalized-alpha", "--budget", "0.03")  # 40 000 steps
    assert ffrobot("bench", "scene.toml", *run, "--part", "work-precision", "-o", "short", cwd=folder).returncode == 0
    explicit, implicit = rows(folder / "short" / "work_precision.csv")
    assert (explicit["status"], explicit["repetitions"]) == ("completed", "5")
    assert (implicit["status"], implicit["repetitions"], implicit["error_force"]) == ("over budget", "1", "")


def test_an_integrator_a_hundred_times_slower_is_asked_no_further():
    """At 1e-4 it is measured, as at that tolerance nothing was known of it; at 1e-5 not, whatever others take there."""

    def point(integrator, tolerance, seconds, status="completed"):
        return Point(integrator, tolerance, TimedRun(integrator, status, seconds), {}, [seconds])

    known = [point("dop853", 1e-3, 0.01), point("dop853", 1e-4, 0.02), point("dop853", 1e-5, 0.04)]
    slow = [point("generalized-alpha", 1e-3, 0.5), point("generalized-alpha", 1e-4, 2.1)]
    assert not _is_hopeless([*known, slow[0]], "generalized-alpha", 1e-4)
    assert _is_hopeless([*known, *slow], "generalized-alpha", 1e-5)
    assert not _is_hopeless([*known, *slow], "radau", 1e-5)
    assert not _is_hopeless(slow, "generalized-alpha", 1e-5)  # with nothing to compare with


MISTAKES = {
    "unknown analysis": (["--analysis", "inverze"], 'scene.toml: analysis: expected one of "inverse", found "inverze"'),
    "analysis at rest": (["--analysis", "held"], f'scene.toml: analysis "held": {INTEGRATES} kind = "static"'),
    "unknown integrator": (["--integrators", "dop583"], 'found "dop583" (did you mean "dop853"?)'),
    "tolerance": (["--tolerances", "1e-3,2"], "--tolerances: expected numbers from 1e-10 to below 1, found 2"),
    "output": (["-o", "arm.toml"], "arm.toml: output: expected a folder, found a file"),
}


@pytest.mark.parametrize(("arguments", "named"), MISTAKES.values(), ids=MISTAKES)
def test_refused(folder, monkeypatch, arguments, named):
    monkeypatch.chdir(folder)
    before = sorted(folder.rglob("*"))
    with pytest.raises(InputError, match=re.escape(named)):
        cli(["bench", "scene.toml", *arguments], standalone_mode=False)
    assert sorted(folder.rglob("*")) == before


def test_nothing_to_integrate_is_refused(tmp_path, refused):
    (tmp_path / "arm.toml").write_text(tomli_w.dumps(LINK), encoding="utf-8")
    (tmp_path / "scene.toml").write_text(tomli_w.dumps(SCENE | {"analysis": [HELD]}), encoding="utf-8")
    assert f'scene.toml: analysis: {INTEGRATES} "static"' in refused(tmp_path, "bench", "scene.toml")
