"""Pages and the notebook, run as a reader would: files saved, commands typed, Python entered, answers compared."""

import base64
import copy
import doctest
import os
import re
import shlex
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
from forked_commands import LIMIT
from PIL import Image

DOCS = Path(__file__).parents[2] / "docs"
sys.path.insert(0, str(DOCS))

from notebook import NOTEBOOK, PNG, read_notebook, run_notebook  # noqa: E402
from palette import SAME, WIDEST, difference, pictures, reduced  # noqa: E402

# What their commands do has tests of its own: studies, solids, resumed runs, paths, tracking, controllers, pictures.
LONG = {
    "compare", "control", "design", "drive", "exchange", "hammer", "long_runs", "machine_paths", "measured", "modes",
    "motor_sizing", "solid", "space", "speed", "stiffness", "sweep", "tracking", "tutorial_urdf", "vibration", "view",
    "voltages",
}  # fmt: skip
PAGES = [DOCS / "tutorial.md", DOCS / "tutorial_urdf.md", *sorted((DOCS / "howto").glob("*.md"))]

BLOCK = re.compile(r"^```(?P<language>\w+)\n(?P<content>.*?)^```$", re.DOTALL | re.MULTILINE)
FILE = re.compile(r"`([\w.]+\.(?:toml|csv|py|urdf|sh))`")  # the last one in the paragraph before a file
PROGRESS = re.compile(r"ffrobot: .* \(\d+ s\)")  # a line every 30 s, where the machine is slow
DOCTEST = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


class Reader:
    """Somebody at an empty folder with a shell and a Python session."""

    def __init__(self, folder, page, environment, forks):
        self.folder, self.page, self.environment, self.forks = folder, page, environment, forks
        self.session = {}
        self.ran = 0

    def follow(self, text):
        for match in BLOCK.finditer(text):
            line = text.count("\n", 0, match.start("content")) + 1
            language, content = match["language"], match["content"]
            if language in ("toml", "text"):
                names = FILE.findall(text[: match.start()].rstrip().split("\n\n")[-1])
                assert names, f"{self.page}:{line}: a file without a name in the paragraph before it"
                (self.folder / names[-1]).write_text(content, encoding="utf-8")
            elif language == "console":
                for command, expected in re.findall(r"^\$ (.*)\n((?:(?!\$ ).*\n)*)", content, flags=re.MULTILINE):
                    self.type(command, expected, line)
            elif language == "pycon":
                self.enter(content, line)
            elif language == "python":
                exec(compile(content, f"{self.page}:{line}", "exec"), self.session)
                self.ran += 1
            else:
                pytest.fail(f"{self.page}:{line}: no way to run {language}")

    def type(self, command, expected, line):
        """Run a command; `…` in the answer stands for anything, blanks at the ends of lines do not count."""
        first, *arguments = shlex.split(command)
        if first == "ffrobot" and not set("|><;&$*") & set(re.sub(r'"[^"]*"', "", command)):
            done = self.forks.run(arguments, self.environment, self.folder, merged=True)
        else:
            done = subprocess.run(
                ["bash", "-c", command], cwd=self.folder, env=self.environment, text=True, timeout=LIMIT,
                stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            )  # fmt: skip
        assert done.returncode == 0, f"{self.page}:{line}: {command}\n{done.stdout}"
        if expected:
            lines = done.stdout.strip().splitlines()
            found = "\n".join(text.rstrip() for text in lines if not PROGRESS.fullmatch(text))
            pattern = ".*".join(re.escape(part) for part in expected.strip().split("…"))
            assert re.fullmatch(pattern, found, re.DOTALL), f"{self.page}:{line}: {command}\n{done.stdout}"
        self.ran += 1

    def enter(self, content, line):
        """Run a Python session with its answers."""
        test = doctest.DocTestParser().get_doctest(content, self.session, str(self.page), str(self.page), line)
        runner = doctest.DocTestRunner(optionflags=DOCTEST, verbose=False)
        report = []
        runner.run(test, out=report.append, clear_globs=False)
        assert runner.failures == 0, "".join(report)
        self.session.update(test.globs)
        self.ran += len(test.examples)


PICTURE = re.compile(r"!\[[^\]]*\]\((?P<file>[\w./-]+\.png)\)\n<!-- from (?P<source>[\w./-]+) -->")
DRAWN = "FFROBOT_DRAW_PAGES"  # in the environment: pictures are written anew, those that differ


def check_pictures(page, text, folder):
    """Pictures of a page are those that its commands have made."""
    for match in PICTURE.finditer(text):
        path, made = page.parent / match["file"], reduced(folder / match["source"], WIDEST)
        if os.environ.get(DRAWN) and not (path.exists() and difference(path.read_bytes(), made) < SAME):
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(made)
        is_same = difference(path.read_bytes(), made) < SAME or not version("matplotlib").startswith("3.10")  # letters
        assert is_same, f"{path}: {DRAWN}=1 pytest tests/docs/test_pages.py"


def test_pictures_have_palettes():
    """They are a third as large: `python docs/palette.py`."""
    for path in pictures():
        with Image.open(path) as picture:
            assert picture.mode in ("P", "L") or path.stat().st_size < 20_000, path


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, id=page.stem, marks=[pytest.mark.nightly] * (page.stem in LONG)) for page in PAGES],
)
def test_page_does_what_it_says(page, ffrobot, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    environment = ffrobot.environment | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    reader = Reader(tmp_path, page, environment, ffrobot.forks)
    text = page.read_text(encoding="utf-8")
    reader.follow(text)
    assert reader.ran >= 3
    check_pictures(page, text, tmp_path)


@pytest.mark.nightly
def test_notebook_shows_what_its_cells_do(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shown = read_notebook()
    for before, now in zip(shown["cells"], run_notebook(copy.deepcopy(shown))["cells"], strict=True):
        for old, new in zip(before.get("outputs", []), now.get("outputs", []), strict=True):
            assert old.get("text") == new.get("text"), f"run python docs/notebook.py ({NOTEBOOK})"
            if "data" in old:
                pictures = (base64.b64decode(output["data"][PNG]) for output in (old, new))
                assert difference(*pictures) < SAME, f"run python docs/notebook.py ({NOTEBOOK})"
