"""The documentation as a site: builds without a warning, and leaves out no command, key or public name."""

import html
import json
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import ffrobot as package
from ffrobot.cli import cli
from ffrobot.schema import schema

DOCS = Path(__file__).parents[2] / "docs"
CASES = DOCS.parent / "cases"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the built site."""
    repository, folder = (tmp_path_factory.mktemp(name) for name in ("repository", "site"))
    source = repository / "docs"
    shutil.copytree(DOCS, source, ignore=shutil.ignore_patterns("_build"))
    shutil.copytree(CASES, repository / "cases", ignore=shutil.ignore_patterns("*.h5"))
    build = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", source, folder]
    done = subprocess.run(build, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def words(page):
    """The text of a page, without markup."""
    return html.unescape(re.sub(r"<[^>]+>", "", page.read_text(encoding="utf-8")))


def reference(page):
    """A page of the reference, as the repository has it."""
    return (DOCS / "reference" / f"{page}.md").read_text(encoding="utf-8")


def test_every_command_and_option_is_documented():
    text = reference("commands")
    for name, command in cli.commands.items():
        assert f"ffrobot {name}" in text
        for parameter in command.params:
            is_public = parameter.param_type_name == "option" and not parameter.hidden
            assert (parameter.opts[-1] in text) == is_public or parameter.param_type_name == "argument"


@pytest.mark.nightly
def test_first_page_greets_with_a_picture_the_commands_and_all_cases(site):
    """Cards link to the READMEs of the cases as pages of the site; their pictures are there."""
    page = (site / "index.html").read_text(encoding="utf-8")
    text = words(site / "index.html")
    assert "./demo.sh" in text
    assert "./test.sh" in text
    greeting = page[: page.index('id="gallery"')]
    assert 'class="hero"' in greeting
    for readme in CASES.glob("*/README.md"):
        name, lines = readme.parent.name, readme.read_text(encoding="utf-8").splitlines()
        key = re.search(r"\*\*(.+?)\*\*", next(line for line in lines if line.startswith("> ")))[1]
        assert key in text, name
        assert f'href="cases/{name}.html"' in page
        own = words(site / "cases" / f"{name}.html").replace("\N{RIGHT SINGLE QUOTATION MARK}", "'")
        assert lines[0].removeprefix("# ") in own
    pictures = re.findall(r'<img[^>]*src="([^"]+)"', page)
    assert len(pictures) > len(list(CASES.glob("*/README.md")))
    assert all((site / picture).is_file() for picture in pictures)


@pytest.mark.nightly
def test_search_knows_keys_and_messages(site):
    """The index that the site's search looks in: words of it, and which pages have them."""
    index = (site / "searchindex.js").read_text(encoding="utf-8")
    found = json.loads(index.removeprefix("Search.setIndex(").rstrip(")"))
    pages = found["docnames"]
    for word, page in {
        "moment_limit": "reference/scene_keys",
        "attachment_mod": "reference/link_keys",  # as the stemmer leaves it
        "youngs_modulus": "reference/link_keys",
        "expect": "reference/messages",
    }.items():
        places = found["terms"][word]
        assert pages.index(page) in (places if isinstance(places, list) else [places]), word


def test_pages_that_are_generated_are_those_in_the_repository(monkeypatch):
    """They can be read there without building anything. If this fails: python docs/key_tables.py, interfaces.py, …"""
    monkeypatch.syspath_prepend(str(DOCS))
    from benchmark_tables import benchmark_page
    from gallery import gallery_page
    from interfaces import interface_pages
    from key_tables import files_page, key_pages

    measured = DOCS / "developer" / "benchmark_records.md"
    pages = {**key_pages(), **interface_pages(), "files.md": files_page()}
    pages |= {measured.name: benchmark_page(DOCS / "benchmarks", measured)}
    assert (DOCS / "cases.md").read_text(encoding="utf-8") == gallery_page(), "python docs/gallery.py"
    for name, text in pages.items():
        assert (measured if name == measured.name else DOCS / "reference" / name).read_text(encoding="utf-8") == text, (
            f"{name}: python docs/key_tables.py, interfaces.py or benchmark_tables.py"
        )


def test_modules_that_refuse_what_is_not_supported_exist(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS))
    from key_tables import UNSUPPORTED

    for name in {where for _, _, where in UNSUPPORTED}:
        spec = find_spec(name)
        assert spec is not None, name
        text = Path(spec.origin).read_text(encoding="utf-8")
        assert "raise InputError" in text or "raise ValueError" in text, name


def test_first_page_lists_all_pages_for_readers_of_the_repository():
    """There the lists of the site are not links."""
    text = (DOCS / "index.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\* \[.*\]\((.*)\.(?:md|ipynb)\)$", text, flags=re.MULTILINE)
    assert listed == re.findall(r"^[a-z_/]+$", text, flags=re.MULTILINE)


WORDS = [
    *sorted(DOCS.rglob("*.md")),
    *sorted(CASES.glob("*/README.md")),
    DOCS.parent / "README.md",
    DOCS.parent / "CONTRIBUTING.md",
]


@pytest.mark.parametrize("kind", ["link", "scene", "figures"])
def test_every_key_is_documented(kind):
    text = reference(f"{kind}_keys")
    described = schema(kind)
    elsewhere = schema("link")["$defs"] if kind == "scene" else {}
    records = [described, *(record for name, record in described["$defs"].items() if name not in elsewhere)]
    keys = {key for record in records for key in record.get("properties", {})}
    assert len(keys) > 10
    missing = sorted(key for key in keys if not re.search(rf"\b{key}\b", text))
    assert not missing


def test_every_public_name_is_documented():
    text = reference("python")
    missing = [name for name in package.__all__ if name not in text and name not in ("FfrobotError", "Scene")]
    assert not missing


def test_every_public_member_is_documented(monkeypatch):
    """Of classes on the page, also what they inherit: dir() has all."""
    monkeypatch.syspath_prepend(str(DOCS))
    from interfaces import CLASSES, RETURNED, python_page

    for one in (*(getattr(package, name) for name in CLASSES), *RETURNED):
        section = python_page().partition(f"### {one.__name__}\n")[2].partition("\n### ")[0]
        for name in dir(one):
            member, of_package = getattr(one, name), one.__module__.split(".")[0]
            home = getattr(getattr(member, "fget", getattr(member, "func", member)), "__module__", "")
            if not name.startswith("_") and str(home).startswith(of_package) and not isinstance(member, type):
                assert f"* `{name}`: " in section, f"{one.__name__}.{name} has no docstring, or the page leaves it out"


@pytest.mark.parametrize("page", WORDS, ids=lambda page: f"{page.parent.name}/{page.stem}")
def test_pages_are_whole(page):
    """No link to nowhere, no path of the repository that is not there, no line that a reflow has cut out of its block.

    As the repository shows the page: links and pictures within it, and the list of pages of the site.
    """
    text, root, block = page.read_text(encoding="utf-8"), DOCS.parent, r"^```([^\n]*)\n(.*?)^```$"
    prose = re.sub(block, "", text, flags=re.DOTALL | re.MULTILINE)
    places = [place for place in re.findall(r"\]\(([^)#\s]+)[^)]*\)", prose) if "://" not in place]
    for language, content in re.findall(block, text, re.DOTALL | re.MULTILINE):
        if language == "{toctree}":
            names = [line for line in content.splitlines() if line and not line.startswith(":")]
            assert all(list(page.parent.glob(f"{name}.*")) for name in names)
    assert not [place for place in places if not (page.parent / place).exists()]
    tops = {path.name for path in root.iterdir() if path.is_dir() and path.name != "build"}
    named = re.findall(r"`([\w.-]+(?:/[\w.*-]+)*/[\w*-]+\.\w+)`", text)
    of_page = (root / name for name in named if name.split("/")[0] in tops)
    assert not [path for path in of_page if not list(root.glob(str(path.relative_to(root)))) and ".h5" not in path.name]
    assert not re.search(r"[ \t]$|^ (?! )(?!\*)", prose, re.MULTILINE), "blanks at the beginning or the end of a line"
    for line in re.findall(r"^ {4}(\S+)", prose, re.MULTILINE):
        first = root / line
        assert not first.is_file() or first.stat().st_mode & 0o100, f"{line} is no command: has its line been wrapped?"


@pytest.mark.nightly
def test_pages_are_reached_from_the_first(site):
    pages = {path.relative_to(site).as_posix() for path in site.rglob("*.html")} - {"genindex.html", "search.html"}
    start = (site / "index.html").read_text(encoding="utf-8")
    assert pages - {"index.html"} <= set(re.findall(r'href="([^"#]+\.html)"', start))


@pytest.mark.nightly
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
