"""Pages of scenes in 3D in a real browser: drawn without a complaint, as it was solved, moving, turned by a drag."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from selenium.webdriver import ActionChains

from ffrobot.common.errors import InputError
from ffrobot.pictures.motion import MovingBody
from ffrobot.pictures.projection import COLORS
from ffrobot.pictures.report import write_report
from ffrobot.pictures.report.charts import Chart, history_charts, runs
from ffrobot.pictures.report.page import table_of
from ffrobot.pictures.shapes import Shape, thickened
from ffrobot.results.file import Results

FLOATS = 2e-6  # m: numbers of the page have 7 digits, lengths are about 1 m
WAIT = 60  # s: without a graphics card, beside other work


def played(browser, path):
    """Open a page, which plays by itself, and stop it."""
    browser.open(path, playing=True)
    browser.wait("state.playing && state.t > 0", WAIT)
    before, at = trace(browser, 2), browser.value("state.t")
    browser.wait(f"Math.abs(state.t - {at}) > 0.02", WAIT)
    browser.run("play(false)")
    browser.wait("!state.showing", WAIT)
    assert np.abs(trace(browser, 2) - before).max() > 1e-4
    browser.check()
    kinds = browser.value("stage.data.map((trace) => trace.type)")
    assert kinds.count("mesh3d") == 3  # bodies, of both cases


@pytest.fixture(scope="module")
def paused(browser, page, arm_3r):
    """The arm's page, standing still."""
    played(browser, page(arm_3r.folder / "scene.results.h5"))
    return browser


def show(browser, t, exaggeration=1.0):
    browser.wait("!state.showing", WAIT)
    browser.run("state.t = arguments[0]; state.s = arguments[1]; return show()", t, exaggeration)
    browser.wait("!state.showing", WAIT)


def trace(browser, number):
    """Coordinates (n, 3) of the number-th trace of the first run; nulls are left out."""
    data = f"stage.data[first[0] + {number}]"
    rows = browser.value(f"['x', 'y', 'z'].map((c) => Array.from({data}[c]))")
    return np.array([row for row in zip(*rows, strict=True) if row[0] is not None], dtype=float)


def pixels(browser):
    """The picture of the robot, (rows, columns): where it is in its colour, a blue."""
    red, green, blue = np.moveaxis(browser.screenshot("#mechanism")[:-60], 2, 0)  # without the legend
    return (blue > red + 60) & (blue > green + 20)


def test_page_of_a_closed_loop(browser, page, slider_crank_3d):
    played(browser, page(slider_crank_3d.folder / "scene.results.h5"))


@pytest.mark.parametrize("t", [0.0, 0.1, 0.6])
def test_tubes_are_where_they_were_solved(paused, arm_3r, t):
    """Rings of the forearm's ends about the places of the file, with the tube's radius; joints and tool likewise."""
    show(paused, t)
    (row,) = arm_3r.rows("inverse", [t])
    at = {name: arm_3r.file[f"inverse/points/fore.{name}/position"][row] for name in ("root", "tip")}
    surface = trace(paused, 2)
    for place in at.values():
        away = np.linalg.norm(surface - place, axis=1)
        assert np.abs(away - 0.004).min() < 2e-5  # fore.toml; sections stay plane to first order of their slope
        assert away.min() > 0.0035
    joints = trace(paused, 4)
    np.testing.assert_allclose(joints[2], at["root"], rtol=0, atol=FLOATS)
    tool = trace(paused, 5)  # x of the tool frame
    e = arm_3r.file["inverse/points/fore.tip/quaternion"][row]
    np.testing.assert_allclose(tool[0], at["tip"], rtol=0, atol=FLOATS)
    along = (tool[1] - tool[0]) / np.linalg.norm(tool[1] - tool[0])
    np.testing.assert_allclose(along, Rotation.from_quat([*e[1:], e[0]]).as_matrix()[:, 0], atol=2e-5)


def test_exaggerated_links_stay_joined(paused, arm_3r):
    """At 20 times the deflection: the rings at both sides of the elbow have one middle, and the tip is off its path."""
    show(paused, 0.1, 20.0)
    upper, fore, joints = trace(paused, 1), trace(paused, 2), trace(paused, 4)
    for surface, radius in ((upper, 0.0055), (fore, 0.004)):
        assert np.abs(np.linalg.norm(surface - joints[2], axis=1) - radius).min() < 5e-4
    (row,) = arm_3r.rows("inverse", [0.1])
    moved = trace(paused, 5)[0] - arm_3r.file["inverse/points/fore.tip/position"][row]
    assert np.linalg.norm(moved) > 0.05  # 5 mm of deflection across, 19 times


def drag(browser, selector, pixels, moves=9):
    """Drag to the right as a hand does: the page sees every move (what falls between two pictures is lost)."""
    middle = browser.driver.find_element("css selector", selector)
    ActionChains(browser.driver).move_to_element(middle).click_and_hold().perform()
    for _ in range(moves):
        browser.pictures(2)
        ActionChains(browser.driver).move_by_offset(pixels // moves, 0).perform()
    browser.pictures(2)
    ActionChains(browser.driver).release().perform()


def test_drag_turns_the_scene(paused):
    """Pictures of later times keep the camera that the user has chosen; the z axis stays upright."""
    eye = "Object.values((({eye}) => ({x: eye.x, y: eye.y, z: eye.z}))(stage._fullLayout.scene._scene.getCamera()))"
    show(paused, 0.2)
    before, picture = np.array(paused.value(eye)), pixels(paused)
    drag(paused, "#mechanism", 90)
    paused.wait(f"Math.abs(stage._fullLayout.scene._scene.getCamera().eye.x - {before[0]}) > 0.2", WAIT)
    turned = np.array(paused.value(eye))
    assert np.linalg.norm(turned) == pytest.approx(np.linalg.norm(before), rel=1e-3)
    assert turned[2] == pytest.approx(before[2], abs=1e-3)
    show(paused, 0.25)
    np.testing.assert_allclose(paused.value(eye), turned, atol=1e-3)
    assert (pixels(paused) ^ picture).sum() > 200


def test_charts_and_tables_of_the_arm(arm_3r):
    with Results(arm_3r.folder / "scene.results.h5") as results:
        charts = {chart.name: chart for chart in history_charts([results])}
        rows = {what: value.split() for _, what, value, _ in table_of("peaks", runs([results])).rows}
        largest = np.abs(results["inverse/joints/waist/moment"]).max()
    range_of_error = charts["error_tool"].layout["yaxis"]["autorangeoptions"]["include"]
    assert range_of_error == pytest.approx([0.0, 1e-6])  # mm: rounding is a line at zero
    assert {"error_tool", "path_tool", "force_tool", "moment_waist", "energy_inverse", "modal_inverse_fore"} <= {
        *charts
    }
    value, unit = rows["motor of joint waist"]
    assert unit == "N·m"
    assert float(value) == pytest.approx(largest, rel=1e-3)
    assert rows["distance of fore.tip from its path"] == ["<", "1", "nm"]


def test_a_run_has_one_colour_on_the_page(two_link):
    """In all charts that compare runs that of the mechanism, whatever else is drawn there."""
    with Results(two_link.folder / "scene.results.h5") as results:
        charts = {chart.name: chart for chart in history_charts([results])}
    expected = dict(zip(("inverse", "forward", "joints_only"), COLORS, strict=False))
    for name in ("path_tip", "error_tip", "moment_O", "deflection_link2.tip", "coordinate_A", "angle_link1"):
        found = {trace["name"].removesuffix(", y"): trace["line"]["color"] for trace in charts[name].traces}
        assert {run: found[run] for run in expected} == expected
    assert charts["path_tip"].traces[0]["line"]["color"] not in COLORS  # the prescribed path


def test_many_runs_have_a_chart_for_each_component(arm_3r):
    with Results(arm_3r.folder / "scene.results.h5") as results:
        charts = {chart.name: chart for chart in history_charts([results] * 3)}
    assert "path_tool" not in charts
    for axis in "xyz":
        names = [trace["name"].partition(": ")[2] for trace in charts[f"path_tool_{axis}"].traces]
        assert names == ["prescribed", "inverse"] * 3


@pytest.mark.parametrize(("largest", "visible"), [(1.9, "legendonly"), (2.1, True)])
def test_limits_far_beyond_curves_wait_for_a_click(largest, visible):
    chart = Chart("moment_O", "motor of joint O", "torque (N·m)", limits=(-20.0, 20.0))
    chart.add("run", np.array([0.0, 1.0]), np.array([0.0, -largest]))
    chart.add("diverged", np.array([0.0, 1.0]), np.array([0.0, 1e6]), visible="legendonly")
    assert [line["visible"] for line in chart.layout["shapes"]] == [visible] * 2
    assert chart.layout["showlegend"]


def test_bars_stand_for_lines():
    """Closed surfaces: every edge between two triangles, once each way; a ring as far off the line as asked."""
    points = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.4], [0.3, 0.0, 0.4]])
    position, still = np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0, 0.0]])
    nothing = {"point_names": (), "points": position[:0], "deflection": position[:, :0], "sections": still[:, :0]}
    body = MovingBody(name="rod", position=position, orientation=still, modal=None, shift=position, **nothing)
    line = Shape(body, points, np.zeros((3, 3, 0)), np.zeros((1, 0)), np.array([[0, 1], [1, 2]]))
    dot = Shape(body, points[:1], np.zeros((1, 3, 0)), np.zeros((1, 0)), np.zeros((1, 1), dtype=int))
    for shape in (thickened(line, 0.01), thickened(dot, 0.01)):
        edges = np.concatenate([shape.cells[:, [0, 1]], shape.cells[:, [1, 2]], shape.cells[:, [2, 0]]])
        assert {tuple(e) for e in edges} == {tuple(e[::-1]) for e in edges}
        assert len({tuple(e) for e in edges}) == len(edges)
        a, b, c = (shape.points[shape.cells[:, k]] for k in range(3))
        assert np.sum(np.einsum("ti,ti->t", a, np.cross(b, c))) > 0  # six times the volume: normals outwards
    bar = thickened(line, 0.01)
    np.testing.assert_allclose(np.linalg.norm(bar.points[:8, :2], axis=1), 0.01)


def test_plane_and_space_have_pages_of_their_own(arm_3r, slider_crank, tmp_path):
    paths = [case.folder / "scene.results.h5" for case in (arm_3r, slider_crank)]
    with pytest.raises(InputError, match=r"all of planar or all of 3D scenes, found .* of a 3D and .* of a planar one"):
        write_report(paths, tmp_path / "r.html")
