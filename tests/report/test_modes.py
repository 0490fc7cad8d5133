"""Modes in 3D: what the page is given, coarse where meshes are large, and what the browser draws of it."""

import numpy as np
import pytest
import trimesh

from ffrobot.pictures.report.mechanism import MAX_TRIANGLES
from ffrobot.pictures.shapes import AMPLITUDE, body_surface, coarsened, drawn_mode
from ffrobot.results.file import Results


def test_large_surfaces_become_coarse_and_keep_their_section():
    """A bar of 1 × 0.02 × 0.03 m, each edge in 64 parts."""
    bar = trimesh.creation.box((1.0, 0.02, 0.03))
    for _ in range(6):
        bar = bar.subdivide()
    points, triangles = np.array(bar.vertices), np.array(bar.faces)
    assert len(triangles) > 8 * MAX_TRIANGLES
    kept, coarse = coarsened(points, triangles, MAX_TRIANGLES)
    assert MAX_TRIANGLES / 3 < len(coarse) <= MAX_TRIANGLES
    assert np.ptp(points[kept], axis=0) == pytest.approx([1.0, 0.02, 0.03], rel=0.05)
    assert coarse.max() == len(kept) - 1
    a, b, c = points[kept][coarse].transpose(1, 0, 2)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    assert area == pytest.approx(2 * (0.02 + 0.03) + 2 * 0.02 * 0.03, rel=0.1)  # still all the way around


@pytest.fixture(scope="module")
def shown(browser, page, solid_arm):
    """The page of a solid link, its modes in 3D drawn: opened once for all tests."""
    browser.open(page(solid_arm / "scene.results.h5"))
    browser.run("modeStage.scrollIntoView()")
    browser.wait("modeStage.data && modeStage.data.length === 2")
    return browser


def choose(browser, element, value):
    browser.run(
        "const box = document.getElementById(arguments[0]); box.value = arguments[1];"
        'box.dispatchEvent(new Event("change"))',
        element, value,
    )  # fmt: skip


def drawn(browser):
    return np.array(browser.value("[0, 1, 2].map((c) => Array.from(modeStage.data[1]['xyz'[c]]))")).T


def test_modes_are_those_of_the_link(shown, solid_arm):
    with Results(solid_arm / "scene.results.h5") as results:
        body = results.modal_body("arm")
    mesh = body_surface(body)
    names = shown.value("[...document.querySelectorAll('#mode-number option')].map((option) => option.textContent)")
    assert names == [f"{k + 1}: {f:.5g} Hz, {body.family[k]}" for k, f in enumerate(body.frequency)]
    for k, amplitude in ((0, 1.0), (1, 1.0), (3, -0.5)):
        choose(shown, "mode-number", k)
        shown.slide("mode-amplitude", amplitude)
        shown.wait(f"modeState.mode === {k} && modeState.amplitude === {amplitude}")
        displacement, size = drawn_mode(mesh.mode_shapes[:, :, k], body.length)
        # Modes have 16 bits: the largest displacement is 32767 steps.
        expected = mesh.points + amplitude * displacement
        np.testing.assert_allclose(drawn(shown), expected, rtol=0, atol=AMPLITUDE * body.length / 32767)
        intensity = np.array(shown.value("Array.from(modeStage.data[1].intensity)"))
        np.testing.assert_allclose(intensity, size, rtol=0, atol=1e-4)
    shown.check()


def test_picture_of_a_mode_moves_with_the_slider(shown):
    choose(shown, "mode-number", 0)
    pictures = []
    for amplitude in (1, -1):
        shown.slide("mode-amplitude", amplitude)
        shown.wait(f"modeState.amplitude === {amplitude}")
        pictures.append(np.ptp(shown.screenshot("#modes-3d")[:, :800], axis=2) > 60)  # without the colour bar
    up, down = pictures
    assert min(up.sum(), down.sum()) > 2000
    assert (up & ~down).sum() > 1000


def test_play_swings_the_mode(shown):
    shown.slide("mode-amplitude", 1)
    shown.wait("modeState.amplitude === 1")
    shown.run("document.getElementById('mode-play').click()")
    shown.wait("modeState.playing && modeState.amplitude !== 1")
    shown.run("document.getElementById('mode-play').click()")
    assert shown.value("modeState.playing") is False


def test_page_of_a_solid_stays_small(page, solid_arm):
    """Plotly itself takes 4.9 MB; surface and modes of a link at most half a megabyte."""
    text = page(solid_arm / "scene.results.h5").read_text(encoding="utf-8")
    begin = text.index('id="modes-3d-data"')
    assert text.index("</script>", begin) - begin < 0.5e6
    assert len(text) < 6e6


def test_dark_pages_have_dark_pictures(shown):
    """When the reader's system turns dark, a corner of the picture does."""
    media = {"features": [{"name": "prefers-color-scheme", "value": "dark"}]}
    shown.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", media)
    try:
        shown.wait("modeStage.layout.paper_bgcolor === '#14181f'")
        assert shown.screenshot("#modes-3d")[-5, 4].tolist() == [0x14, 0x18, 0x1F]
    finally:
        shown.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
