"""What design commands leave for the report: axes of parallel coordinates, states of designs, bands, files."""

import html

import numpy as np
import pytest
import tomli_w
from small_robots import SWING, rows

import ffrobot
from ffrobot.design.responses import parse_response
from ffrobot.pictures.studies.study import Band, Bars, Parallel, Progress, read_study, study_files
from ffrobot.results.file import Results
from ffrobot.results.write import results_image
from ffrobot.run.solve import solve_scene
from ffrobot.scene.load import make_scene

OUTER, INNER = "links.arm.geometry.section.outer", "links.arm.geometry.section.inner"
DENSITY = "links.arm.material.density"


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("studies") / "scene.toml"
    path.write_text(tomli_w.dumps(SWING), encoding="utf-8")
    return path


def diagrams(study):
    return {one.name: one for one in study.diagrams}


def test_all_designs_of_a_search(scene):
    """Each as what it is; the line of a failed one ends where its responses would begin.

    Every tube of two catalogues: wide holes in narrow tubes fail, thin walls are beyond the limit.
    """
    vary = [f"{OUTER} in {{0.015, 0.02, 0.025}}", f"{INNER},{DENSITY} in {{0.010:2700.0, 0.016:2700.0, 0.0195:7800.0}}"]
    searched = ffrobot.optimise(scene, vary, minimise="mass", subject_to=["frequency 1 arm >= 40"])
    study = searched.study()
    assert study.good
    parallel, progress = diagrams(study)["designs"], diagrams(study)["convergence"]
    assert isinstance(parallel, Parallel)
    assert isinstance(progress, Progress)
    labels = [OUTER, INNER, DENSITY, "mass (kg)", "frequency 1 arm (Hz)"]
    assert [axis.label for axis in parallel.axes] == labels
    assert (parallel.axes[4].limit, parallel.axes[4].sense) == (40.0, -1)
    for outer, inner, mass, frequency, state, far in zip(
        *(parallel.axes[k].values for k in (0, 1, 3, 4)), parallel.states, progress.best, strict=True
    ):
        if inner >= outer:
            assert (state, mass, frequency) == ("failed", None, None)
        else:
            assert state in (("kept", "best") if frequency >= 40.0 else ("exceeded",))
            assert mass == pytest.approx(
                np.pi / 4 * (outer**2 - inner**2) * 0.6 * (7800.0 if inner > 0.019 else 2700.0)
            )
        assert far is None or far >= searched.value
    assert progress.best[-1] == searched.value
    assert parallel.states.count("best") == 1
    assert {"failed", "exceeded", "kept"} <= set(parallel.states)
    assert parallel.axes[3].values[parallel.states.index("best")] == searched.value


def test_files_of_a_command(ffrobot, scene, tmp_path):
    """Figures and study; a number that is varied in its logarithm has such an axis; the page is made of the folder."""
    folder = tmp_path / "found"
    done = ffrobot(
        "optimise", scene, "--minimise", "mass", "--subject-to", "frequency 1 arm >= 60",
        "--vary", f"{OUTER}=0.017:0.03:log", "-o", folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    for name in ("designs.png", "designs.pdf", "convergence.png"):
        assert (folder / name).stat().st_size > 1000
    (file,) = study_files(folder)
    study = read_study(file)
    axes = diagrams(study)["designs"].axes
    assert (axes[0].logarithmic, axes[0].low, axes[0].high) == (True, 0.017, 0.03)
    assert any("frequency 1 arm: 59.4 Hz instead of 60 saves" in fact for fact in study.facts)
    masses = [float(row["mass"]) for row in rows(folder / "designs.csv")]
    np.testing.assert_allclose(axes[1].values, masses, rtol=1e-12)
    ffrobot.ok("report", folder)
    page = (tmp_path / "found.html").read_text(encoding="utf-8")
    assert page.count("data:image/svg+xml;base64,") == len(study.diagrams) == 2
    assert all(html.escape(fact) in page for fact in study.facts)


def test_tornado_and_bands(scene, tmp_path):
    """From Python: `write_study` writes what the commands do."""
    matters = ffrobot.sensitivity(scene, ["mass"], [OUTER, INNER])
    (tornado,) = matters.study().diagrams
    assert isinstance(tornado, Bars)
    assert tornado.labels == (OUTER, INNER)
    np.testing.assert_allclose(tornado.series[0].values, [2.0 / 0.36, -2.0 * 0.64 / 0.36], rtol=1e-6)
    sure = ffrobot.uncertainty(
        scene, ["mass", "joints.shoulder.moment"], ["payload.0.mass=±5%", f"{DENSITY}=normal:1%"], by="gradients",
    )  # fmt: skip
    study = sure.study()
    band = diagrams(study)["band_joints_shoulder_moment"]
    assert isinstance(band, Band)
    for low, inner_low, middle, inner_high, high in zip(
        band.lowest, band.low, band.nominal, band.high, band.highest, strict=True
    ):
        assert low < inner_low < middle < inner_high < high
    deviations = np.array(sure.bands[0].statistics.deviation)
    assert np.all(np.array(band.highest) - band.nominal <= 2.0 * np.sqrt(2.0) * deviations)
    written = [path.name for found in (matters, sure) for path in ffrobot.write_study(found, tmp_path)]
    for name in ("sensitivity.json", "tornado_mass.png", "uncertainty.json", "ranking_mass.pdf"):
        assert name in written
        assert (tmp_path / name).stat().st_size > 500
    assert [file.name for file in study_files(tmp_path)] == ["sensitivity.json", "uncertainty.json"]
    assert read_study(tmp_path / "uncertainty.json") == study


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "expected a study of ffrobot as JSON"),
        ("[1]", 'expected a study of ffrobot (format "ffrobot-study"), found another file'),
        (
            '{"format": "ffrobot-study", "format_version": 7}',
            "expected format_version 1, found 7: run the command again",
        ),
        ('{"format": "ffrobot-study", "format_version": 1, "name": "sensitivity"}', "study.json: ffrobot_version"),
        (None, "expected a folder of ffrobot sensitivity, optimise or uncertainty"),
    ],
)
def test_files_that_are_no_studies(refused, tmp_path, content, message):
    """Nor a folder without any."""
    if content:
        (tmp_path / "study.json").write_text(content, encoding="utf-8")
    assert message in refused(tmp_path, "report", "study.json" if content else ".")


PATCHES = {
    "body": "arm", "count": 3, "length": 0.1, "width": 0.01, "thickness": 5e-4, "modulus": 63e9, "d31": 110e-12,
    "structural": False, "limit": 20.0,
}  # fmt: skip
ANALYSES = [
    *SWING["analysis"],
    {
        "name": "forward", "kind": "forward", "actuation": "inverse", "apply": "joints",
        "end": 0.1, "output_step": 0.01,
    },
]  # fmt: skip
RESPONSES = [
    "peak joints.shoulder.moment", "rms forward.points.arm.tip.deflection", "energy joints.shoulder",
    "peak pzt.arm.required_voltage", "peak joints.shoulder.reaction", "mean trajectories.swing.force",
    "peak forward.bodies.arm.modal", "at 0.05 energy.kinetic", "mass arm", "frequency 1 arm",
]  # fmt: skip


def test_runs_write_what_responses_read(tmp_path):
    """And evaluate nothing else: with the bits of a whole solve."""
    scene = make_scene(folder=tmp_path, **SWING | {"pzt": [PATCHES], "analysis": ANALYSES})
    image = results_image(solve_scene(scene))
    for response in map(parse_response, RESPONSES):
        with Results.from_image(image, scene.path) as whole:
            reading = response.read(whole)
            part = results_image(solve_scene(scene, wanted=frozenset(whole.asked)))
            with Results.from_image(part, scene.path) as results:
                assert repr(response.read(results)) == repr(reading)
                assert set(results) < set(whole)
                assert len(results.keys()) < len(whole.keys()) / 2
                for name in results:
                    np.testing.assert_array_equal(results[name], whole[name])
