"""Studies of design commands on the page, alone and beside results, in a real browser."""

import numpy as np
import pytest

from ffrobot.pictures.report import write_report
from ffrobot.pictures.studies.study import (
    Axis,
    Band,
    Bars,
    Parallel,
    Points,
    Progress,
    Series,
    Study,
    StudyTable,
    axis_of_goal,
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
        Axis(label="joint.1.gear_ratio", values=(10.0, 20.0, 50.0, 100.0), low=10.0, high=1000.0, logarithmic=True),
        Axis(label="link", values=(0.0, 1.0, 1.0, 0.0), low=-0.5, high=1.5, names=("<thin>", "thick")),
        axis_of_goal("mass (kg)", MASSES, limit=2.8),
    )
    designs = Parallel(
        name="designs", title="4 designs", axes=axes, states=STATES, designs=tuple(f"design {k}" for k in range(4))
    )
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
        labels=("", "price 2"), x=(1e-3, 2e-3), y=(2.0, 1.5), joined=True, sure=(True, False),
    )  # fmt: skip
    write_study(study("front", curve), folder)
    return folder


def open_alone(browser, folder, tmp_path):
    page = tmp_path / "page.html"
    write_report([folder], page)
    browser.driver.get_log("browser")
    browser.driver.get(page.as_uri())
    browser.run("document.querySelectorAll('[data-chart]').forEach(drawChart)")
    browser.wait("[...document.querySelectorAll('[data-chart]')].every((c) => c.querySelector('.main-svg'))")


def chart(browser, name):
    return browser.value(f"document.querySelector('[data-chart$=\"_{name}\"]').data.map((t) => [t.name, t.x, t.y])")


def test_a_page_of_studies_alone(browser, folder, tmp_path):
    """No motion, nothing that the browser complains of, every diagram drawn."""
    open_alone(browser, folder, tmp_path)
    assert browser.complaints == []
    assert browser.value("places.length") == 6
    assert browser.value("[...document.querySelectorAll('nav a')].map((a) => a.textContent)") == [
        "Design",
        "Input files and versions",
    ]
    assert browser.value("document.title") == "arm <1> – ffrobot"
    text = browser.run("return document.querySelector('#design').innerText")
    assert "8.08 N m instead of 8 saves 0.1 kg" in text
    assert browser.value("document.querySelectorAll('.verdict.good').length") == 1


def test_lines_of_designs(browser, folder, tmp_path):
    """Each by its state, the best one last and on top; the failed one ends before the goal; axes by logarithms."""
    open_alone(browser, folder, tmp_path)
    lines = {name: (x, y) for name, x, y in chart(browser, "designs")}
    assert list(lines) == ["failed", "beyond a limit", "within limits", "best", "limit, pointing beyond it"]
    assert lines["failed"][0] == [0, 1, None]
    assert lines["best"][0] == [0, 1, 2, None]
    np.testing.assert_allclose(lines["best"][1][:2], [0.5, 0.25])  # 100 of 10 to 1000
    marks = browser.value(
        "[...document.querySelectorAll('[data-chart$=\"_designs\"] .annotation-text')].map((t) => t.textContent)"
    )
    for text in ("joint.1.gear_ratio", "10 –", "100 –", "1000 –", "<thin> –", "mass (kg)"):
        assert text in marks
    wide = "document.querySelector('[data-chart$=\"_designs\"]').getBoundingClientRect().width"
    assert browser.value(wide) > 0.9 * browser.value("document.querySelector('main').clientWidth") - 100


def test_convergence_and_bands(browser, folder, tmp_path):
    open_alone(browser, folder, tmp_path)
    best = {name: y for name, _, y in chart(browser, "convergence")}
    assert best["best so far"] == [None, None, 2.5, 2.0]
    assert best["within limits"] == [2.5]
    named = browser.value(
        "document.querySelector('[data-chart$=\"_band_moment\"]').data"
        ".filter((t) => t.showlegend !== false).map((t) => t.name)"
    )
    assert named == ["lowest and highest sample", "5% to 95%", "median", "nominal values"]


def test_beside_results(browser, page, folder, two_link):
    """Motion and designs on one page."""
    path = page(two_link.folder / "scene.results.h5", folder)
    browser.open(path)
    browser.run("document.querySelectorAll('[data-chart]').forEach(drawChart)")
    browser.wait("document.querySelector('[data-chart$=\"_designs\"] .main-svg')")
    assert browser.complaints == []
    found = browser.value("[...document.querySelectorAll('nav a')].map((a) => a.textContent)")
    assert found == ["Motion", "Summary", "Histories", "Modes", "Design", "Input files and versions"]
