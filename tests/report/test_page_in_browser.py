"""The page in a real browser: no errors, no network, everything drawn, a mechanism that moves as it was solved."""

import numpy as np
import pytest


@pytest.fixture(scope="module")
def opened(browser, two_link_page):
    """The two-link page with all its charts, opened once."""
    browser.open(two_link_page)
    browser.draw_all()
    charts = browser.value("places.length")
    assert charts == len(browser.run("return document.querySelectorAll('[data-chart] .main-svg:first-child')")) > 30
    browser.check()
    return browser


@pytest.fixture
def paused(opened):
    """The two-link page, standing still at t = 0, to scale."""
    opened.slide("exaggeration", 0)
    opened.slide("time", 0)
    return opened


JOINTS = {"O": "link1.root", "A": "link2.root"}  # scene.toml


def joints_drawn(browser, run):
    """Coordinates of the joints of a run, and of the end of the path taken so far, by point."""
    drawn = browser.value(
        f"(() => {{ const r = MECHANISM.runs.findIndex((run) => run.label === '{run}'), run = MECHANISM.runs[r];"
        "const at = first[r] + run.bodies.length, trace = stage.data[at + 1], path = stage.data[at + 5];"
        "return [...run.joints.map((joint, i) => [joint.name, trace.x[i], trace.y[i]]),"
        "[run.tools[0].name, path.x.at(-1), path.y.at(-1)]] })()"
    )
    return {JOINTS.get(name, name): np.array(at) for name, *at in drawn}


def solved(two_link, point, t, analysis="inverse"):
    (row,) = two_link.rows(analysis, [t])
    return two_link.file[f"{analysis}/points/{point}/position"][row]


def show(browser, t, exaggeration=1.0):
    browser.slide("exaggeration", np.log10(exaggeration))
    browser.slide("time", 1000 * t)
    browser.wait(f"Math.abs(state.t - {t}) < 1e-9")


@pytest.mark.parametrize("t", [0.0, 0.25, 1.0])
def test_mechanism_is_where_it_was_solved(paused, two_link, t):
    show(paused, t)
    for point, at in joints_drawn(paused, "inverse").items():
        np.testing.assert_allclose(at, solved(two_link, point, t), rtol=0, atol=1e-6)  # numbers of 7 digits


def test_hidden_run_catches_up_when_shown(paused, two_link):
    show(paused, 1.0)
    hidden = joints_drawn(paused, "joints_only")["link2.tip"]
    np.testing.assert_allclose(hidden, solved(two_link, "link2.tip", 0.0), rtol=0, atol=1e-6)
    visible = (
        "const run = MECHANISM.runs.findIndex((r) => r.label === 'joints_only');"
        "Plotly.restyle(stage, { visible: arguments[0] }, stage.data.map((_, i) => i).filter("
        "(i) => i >= first[run] && (run + 1 === first.length || i < first[run + 1])))"
    )
    paused.run(visible, True)
    paused.wait("Math.abs(stage.data[first[2] + 7].x.length - 1001) < 1")  # the path taken, up to the end
    shown = joints_drawn(paused, "joints_only")["link2.tip"]
    paused.run(visible, "legendonly")
    np.testing.assert_allclose(shown, solved(two_link, "link2.tip", 1.0, "joints_only"), rtol=0, atol=1e-6)


def test_histories_show_what_the_file_holds(paused, two_link):
    curve = "document.querySelector('[data-chart=\"deflection_link2.tip\"]').data.find((d) => d.name === 'inverse, y')"
    # Plotly decodes the binary text into a typed array of its own.
    drawn = np.array(paused.value(f"Array.from({curve}._inputArray || {curve}.y._inputArray || {curve}.y)"))
    expected = 1e3 * two_link.file["inverse/points/link2.tip/deflection"][:, 1]  # in mm
    np.testing.assert_allclose(drawn, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def test_nothing_on_the_page_sends_data_away(paused):
    buttons = set(paused.value("[...document.querySelectorAll('.modebar-btn')].map((b) => b.dataset.title)"))
    assert {"Download plot", "Reset axes"} <= buttons
    assert not [title for title in buttons if "share" in title.lower() or "cloud" in title.lower()]
    assert paused.value("document.links.length") == paused.value("document.querySelectorAll('a[href^=\"#\"]').length")


def test_voltage_charts_mark_the_limit(paused):
    shapes = "document.querySelector('[data-chart=\"required_voltage_inverse_link1\"]').layout.shapes.map((s) => s.y0)"
    assert paused.value(shapes) == [-200, 200]  # V, `limit` in the scene file


def test_on_paper_charts_stand_in_two_columns(paused):
    """All of them drawn, none wider than half a page of A4; back on the screen as wide as there is room for."""
    widths = "drawn().filter((c) => c.dataset.chart).map((c) => c._fullLayout.width)"
    paused.run("window.dispatchEvent(new Event('beforeprint'))")
    paused.wait(f"{widths}.length === places.length && {widths}.every((w) => w === 340)")
    assert paused.value("[...document.querySelectorAll('details')].every((fold) => fold.open)")
    cut = "(c) => c.querySelector('.gtitle').getBoundingClientRect().right > c.getBoundingClientRect().right"
    assert not paused.value(f"drawn().filter((c) => c.dataset.chart).some({cut})")
    assert not paused.value("drawn().some((c) => +c.querySelector('.scrollbar')?.getAttribute('height') > 0)")
    paused.run("window.dispatchEvent(new Event('afterprint'))")
    paused.wait(f"{widths}.every((w) => w > 340)")


def test_phones_show_whole_titles_and_scroll_one_way_only(browser, page, slider_crank):
    """390 pixels wide: no page beside the page, no buttons over titles, no title that is cut off."""
    metrics = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    try:
        browser.open(page(slider_crank.folder / "scene.results.h5"))
        browser.draw_all()
        assert browser.value("document.documentElement.scrollWidth") == 390
        assert browser.value("document.querySelectorAll('.modebar-btn').length") == 0
        right_ends = "[...document.querySelectorAll('.gtitle')].map((title) => title.getBoundingClientRect().right)"
        ends = browser.value(right_ends)
        assert len(ends) > 10
        assert max(ends) <= 390
        browser.check()
    finally:
        browser.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
