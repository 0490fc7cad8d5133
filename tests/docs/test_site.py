"""The documentation as a site: builds without a warning, and leaves out no command, key or public name."""

import html
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import ffrobot as package
from ffrobot.cli import cli
from ffrobot.schema import schema

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the built site."""
    source, folder = (tmp_path_factory.mktemp(name) for name in ("docs", "site"))
    shutil.copytree(DOCS, source, dirs_exist_ok=True, ignore=shutil.ignore_patterns("_build", "*_keys.md"))
    build = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", source, folder]
    done = subprocess.run(build, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def words(page):
    """The text of a page, without markup."""
    return html.unescape(re.sub(r"<[^>]+>", "", page.read_text(encoding="utf-8")))


def test_every_command_and_option_is_documented(site):
    text = words(site / "reference" / "commands.html")
    for name, command in cli.commands.items():
        assert f"ffrobot {name}" in text
        for parameter in command.params:
            assert parameter.opts[-1] in text or parameter.param_type_name == "argument"


@pytest.mark.parametrize("kind", ["link", "scene"])
def test_every_key_is_documented(site, kind):
    text = words(site / "reference" / f"{kind}_keys.html")
    described = schema(kind)
    records = [described, *described["$defs"].values()]
    keys = {key for record in records for key in record.get("properties", {})}
    assert len(keys) > 20
    missing = sorted(key for key in keys if not re.search(rf"\b{key}\b", text))
    assert not missing


def test_every_public_name_is_documented(site):
    text = words(site / "reference" / "python.html")
    missing = [name for name in package.__all__ if name not in text and name not in ("FfrobotError", "Scene")]
    assert not missing


def test_pages_are_reached_from_the_first(site):
    pages = {path.relative_to(site).as_posix() for path in site.rglob("*.html")} - {"genindex.html", "search.html"}
    start = (site / "index.html").read_text(encoding="utf-8")
    assert pages - {"index.html"} <= set(re.findall(r'href="([^"#]+\.html)"', start))


def test_pages_need_no_network(site):
    """Scripts (MathJax, too), styles and pictures are part of the site."""
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        needed = re.findall(r'<(?:script|img)\b[^>]*\bsrc="([^"]+)"', text)
        needed += re.findall(r'<link\b[^>]*rel="stylesheet"[^>]*href="([^"]+)"', text)
        files = [name.partition("?")[0] for name in needed]
        missing = [name for name in files if not (page.parent / name).exists()]
        assert not missing, page.name
    assert 'src="_static/mathjax/' in (site / "theory.html").read_text(encoding="utf-8")
