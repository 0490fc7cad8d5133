"""Studies of design commands on the page, alone and beside results, in a real browser."""

import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

from ffrobot.common.checksum import seal
from ffrobot.pictures.report import write_report
from ffrobot.pictures.studies.figures import draw
from ffrobot.pictures.studies.study import (
    LOOKS,
    Band,
    Bars,
    DesignAxis,
    Parallel,
    Points,
    Progress,
    Series,
    Study,
    StudyTable,
    axis_of_response,
    read_study,
    write_study,
)

STATES = ("exceeded", "failed", "kept", "best")
MASSES = (3.0, None, 2.5, 2.0)
TIME = tuple(np.linspace(0.0, 1.0, 30))


def history(factor):
    return tuple(factor * np.sin(np.array(TIME) + 0.1))


def study(name, *diagrams, good=None):
    return Study(
        ffrobot_version="0", name=name, title="The best design", scene="arm/scene.toml", scene_name="arm <1>",
        headline="least mass: 2 kg", good=good, facts=("price: 8.08 N m instead of 8 saves 0.1 kg",),
        tables=(StudyTable(heading=("key", "best"), rows=(("payload.0.mass", "0.5"),)),), diagrams=diagrams,
    )  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One diagram of each kind."""
    folder = tmp_path_factory.mktemp("studies")
    axes = (
        DesignAxis(
            label="joint.1.gear_ratio", values=(10.0, 20.0, 50.0, 100.0), low=10.0, high=1000.0, logarithmic=True
        ),
        DesignAxis(label="link", values=(0.0, 1.0, 1.0, 0.0), low=-0.5, high=1.5, names=("<thin>", "thick")),
        axis_of_response("mass (kg)", MASSES, limit=2.8),
    )
    designs = Parallel(name="designs", title="4 designs", axes=axes, states=STATES)
    progress = Progress(
        name="convergence", title="mass", y_label="mass (kg)", values=MASSES, states=STATES, best=(None, None, 2.5, 2.0)
    )
    write_study(study("optimum", designs, progress, good=True), folder)
    tornado = Bars(
        name="tornado_mass",
        title="mass",
        x_label="%",
        labels=("a", "b"),
        series=(Series(values=(2.0, -1.0)),),
        signed=True,
    )
    write_study(study("sensitivity", tornado), folder)
    indices = Bars(
        name="ranking_mass", title="mass", x_label="Sobol index (%)", labels=("a", "b"),
        series=tuple(Series(label=text, values=(60.0, 30.0), errors=(2.0, 1.0)) for text in ("alone", "with others")),
    )  # fmt: skip
    band = Band(
        name="band_moment", title="moment", y_label="moment (N m)", time=TIME, nominal=history(1.0),
        median=history(1.01), low=history(0.9), high=history(1.1), lowest=history(0.8), highest=history(1.2),
        band_label="5% to 95%",
        worst_label="lowest and highest sample",
    )  # fmt: skip
    write_study(study("uncertainty", indices, band), folder)
    curve = Points(
        name="front", title="mass against deflection", x_label="deflection (m)", y_label="mass (kg)",
        x=(1e-3, 2e-3), y=(2.0, 1.5), sure=(True, False),
    )  # fmt: skip
    write_study(study("front", curve), folder)
    return folder


def test_a_page_of_studies_alone(browser, folder, tmp_path):
    """No motion, nothing that the browser complains of, every diagram in view under its title."""
    page = tmp_path / "page.html"
    write_report([folder], page)
    browser.driver.get_log("browser")
    browser.driver.get(page.as_uri())
    browser.check()
    assert browser.value("places.length") == 0
    pictures = "[...document.querySelectorAll('.diagrams img')]"
    browser.wait(f"{pictures}.every((one) => one.complete)")
    assert sorted(browser.value(f"{pictures}.map((one) => one.alt)")) == [
        "4 designs", "mass", "mass", "mass", "mass against deflection", "moment",
    ]  # fmt: skip
    assert min(browser.value(f"{pictures}.map((one) => one.naturalWidth)")) > 200
    assert browser.value("[...document.querySelectorAll('nav a')].map((a) => a.textContent)") == [
        "Design",
        "Input files and versions",
    ]
    assert browser.value("document.title") == "arm <1> – ffrobot"
    text = browser.run("return document.querySelector('#design').innerText")
    assert "8.08 N m instead of 8 saves 0.1 kg" in text
    assert browser.value("document.querySelectorAll('.verdict.good').length") == 1


def drawn(folder, file, name):
    (diagram,) = (one for one in read_study(folder / file).diagrams if one.name == name)
    return draw(diagram)


def names(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_lines_of_designs(folder):
    """Each by its state, the best one last and on top; the failed one ends before the response; axes by logarithms."""
    picture = drawn(folder, "optimum.json", "designs")
    assert names(picture) == ["failed", "beyond a limit", "within limits", "best", "limit, pointing beyond it"]
    (axes,) = picture.axes
    lines = [line for line in axes.lines if len(line.get_xdata()) in (2, 3) and line.get_linewidth() != 0.6]
    np.testing.assert_array_equal(lines[0].get_xdata(), [0, 1])
    best = next(line for line in axes.lines if line.get_linewidth() == LOOKS["best"].width)
    np.testing.assert_array_equal(best.get_xdata(), [0, 1, 2])
    np.testing.assert_allclose(best.get_ydata()[:2], [0.5, 0.25])  # 100 of 10 to 1000
    texts = [text.get_text().replace("\n", "") for text in axes.texts]
    assert {"joint.1.gear_ratio", "10", "100", "1000", "<thin>", "mass (kg)"} <= set(texts)


def test_convergence_and_bands(folder):
    (axes,) = drawn(folder, "optimum.json", "convergence").axes
    curves = {line.get_label(): line.get_ydata() for line in axes.lines}
    np.testing.assert_array_equal(curves["best so far"], [np.nan, np.nan, 2.5, 2.0])
    assert curves["within limits"] == [2.5]
    band = drawn(folder, "uncertainty.json", "band_moment")
    assert names(band) == ["lowest and highest sample", "5% to 95%", "median", "nominal values"]


def test_beside_results(browser, page, folder, slider_crank, two_link, tmp_path):
    """Motions of two scenes and designs on one page; <b> of a name is not bold, neither in HTML nor in Plotly."""
    path = Path(shutil.copy(two_link.folder / "scene.results.h5", tmp_path))
    with h5py.File(path, "r+") as file:
        file.attrs["name"] = "<b>A & B</b>"
    seal(path)
    browser.open(page(path, slider_crank.folder / "scene.results.h5", folder))
    browser.draw_from("document.querySelector('#histories').scrollIntoView()")
    drawn = len(browser.run("return document.querySelectorAll('[data-chart] .main-svg:first-child')"))
    assert browser.value("places.length") > 40 > drawn > 1
    browser.check()
    assert browser.value("document.querySelector('h1').textContent").startswith("<b>A & B</b>")
    legend = "[...document.querySelectorAll('#mechanism .legendtext')].map((item) => item.textContent)"
    assert "<b>A & B</b>: inverse" in browser.value(legend)
    links = browser.value("[...document.querySelectorAll('nav a')].map((a) => a.textContent)")
    assert links == ["Motion", "Summary", "Histories", "Modes", "Design", "Input files and versions"]
    assert browser.value("document.querySelectorAll('.diagrams img').length") == 6
