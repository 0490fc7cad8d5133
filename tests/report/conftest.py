"""Pages of solved cases, and a real browser to open them in."""

import io
import json
import shutil
import time

import numpy as np
import pytest
from PIL import Image
from selenium.webdriver import Chrome, ChromeOptions, ChromeService

from ffrobot.cli import cli

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")

# Remarks of the browser on the speed of its own graphics, made where Plotly draws in 3D.
GRAPHICS = ("willReadFrequently", "GPU stall due to ReadPixels", "software WebGL")


@pytest.fixture(scope="session")
def page(tmp_path_factory):
    """Write the report of results files; returns its path."""

    def write(*results):
        path = tmp_path_factory.mktemp("report") / "report.html"
        cli(["report", *map(str, results), "-o", str(path)], standalone_mode=False)
        return path

    return write


@pytest.fixture(scope="session")
def two_link_page(page, two_link):
    return page(two_link.folder / "scene.results.h5")


class Browser:
    """Chromium without a window."""

    def __init__(self):
        options = ChromeOptions()
        options.binary_location = CHROMIUM
        # WebGL in software, with which Plotly draws in 3D.
        for argument in ("--headless=new", "--enable-unsafe-swiftshader", "--no-sandbox", "--disable-gpu",
                         "--disable-dev-shm-usage", "--force-device-scale-factor=1",
                         "--window-size=1400,1000"):  # fmt: skip
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = Chrome(options=options, service=ChromeService(DRIVER))

    def open(self, path, *, playing=False):
        """Load a page and wait until the mechanism moves; stop it, so that all else is drawn faster."""
        self.driver.get("about:blank")  # ends the page before, of which charts may be half drawn
        self.driver.get_log("browser")
        self.driver.get(path.as_uri())
        self.wait("state.playing", 60)
        if not playing:
            self.run("play(false)")

    def run(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def value(self, expression):
        """The value of an expression; numbers keep all digits."""
        return json.loads(self.run(f"return JSON.stringify({expression})"))

    def wait(self, condition, seconds=20):
        end = time.monotonic() + seconds
        while not self.run(f"return {condition}"):
            assert time.monotonic() < end, f"not within {seconds} s: {condition}"
            time.sleep(0.05)

    def pictures(self, count):
        """Wait until the page has drawn so many pictures."""
        self.driver.execute_async_script(
            "const done = arguments[1]; let left = arguments[0];"
            "const next = () => left-- > 0 ? requestAnimationFrame(next) : done(); next()",
            count,
        )  # fmt: skip

    def draw_all(self):
        """Scroll through the page until every chart has been near the window."""
        for y in range(0, self.value("document.body.scrollHeight"), 700):
            self.draw_from(f"window.scrollTo(0, {y})")
        self.run("window.scrollTo(0, 0)")

    def draw_from(self, scroll):
        """Scroll, and wait for the charts that are in the window then."""
        self.run(scroll)
        self.wait(
            "[...document.querySelectorAll('[data-chart]')].every((c) => { const r = c.getBoundingClientRect();"
            "return r.top > innerHeight || r.bottom < 0 || c.querySelector('.main-svg') })"
        )

    def slide(self, name, value):
        """Move a slider as a user does."""
        self.run(
            "const slider = document.getElementById(arguments[0]); slider.value = arguments[1];"
            'slider.dispatchEvent(new Event("input"))',
            name, value,
        )  # fmt: skip

    def check(self):
        """The page wrote nothing to the console and asked for no other file."""
        messages = [entry["message"] for entry in self.driver.get_log("browser")]
        assert [message for message in messages if not any(remark in message for remark in GRAPHICS)] == []
        assert self.value('performance.getEntriesByType("resource").map((entry) => entry.name)') == []

    def screenshot(self, selector):
        """The colors (rows, columns, 3) of an element."""
        png = self.driver.find_element("css selector", selector).screenshot_as_png
        return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), dtype=int)


OPEN = []


@pytest.fixture(scope="session")
def browser():
    if CHROMIUM is None or DRIVER is None:
        pytest.skip("chromium and chromium-driver are not installed; test.sh installs them")
    browser = Browser()
    OPEN.append(browser)
    yield browser
    browser.driver.quit()


@pytest.fixture(scope="module", autouse=True)
def empty_page_at_the_end():
    """What a page draws would slow down tests that measure times."""
    yield
    for browser in OPEN:
        browser.driver.get("about:blank")
