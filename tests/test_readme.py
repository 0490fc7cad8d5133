"""The README's own arm, as a reader would copy it."""

import re
import shlex
import tomllib
from pathlib import Path

import h5py
import numpy as np
import pytest

from ffrobot.cli import cli

ROOT = Path(__file__).parents[1]


@pytest.fixture
def arm(tmp_path):
    """A folder with the files that the README shows."""
    for block in re.findall(r"```toml\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), flags=re.DOTALL):
        name = "scene.toml" if "analysis" in tomllib.loads(block) else "arm.toml"
        (tmp_path / name).write_text(block, encoding="utf-8")
    return tmp_path


def test_arm_of_the_readme_swings_a_quarter_turn(arm):
    cli(["solve", str(arm / "scene.toml")], standalone_mode=False)
    with h5py.File(arm / "scene.results.h5") as results:
        inverse = results["inverse"]
        assert inverse.attrs["status"] == "completed"
        turn = np.ptp(inverse["bodies/arm/angle"][:])
        moment = inverse["joints/shoulder/moment"][0]
    assert turn == pytest.approx(np.pi / 2, abs=1e-10)
    # At the first instant the motor turns the section at the shoulder only and the bar stays behind: it carries
    # the weights of bar and payload, but for the inertia of the modes that are left out.
    bar, payload, length = 2700.0 * np.pi / 4 * (0.02**2 - 0.016**2) * 0.6, 0.5, 0.6
    assert moment == pytest.approx(9.81 * length * (bar / 2 + payload), rel=1e-3)


def test_solve_prints_what_the_readme_quotes(arm, capsys):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    quoted = re.search(r"prints a summary .*\n\n((?:    .*\n)+)", text)[1]
    cli(["solve", str(arm / "scene.toml")], standalone_mode=False)
    printed = " ".join(capsys.readouterr().out.split())
    for line in quoted.splitlines():
        assert " ".join(line.strip(" …").split()) in printed


def test_every_command_of_the_readme_runs(arm, monkeypatch):
    monkeypatch.chdir(arm)
    commands = re.findall(r"^    ffrobot (\w+ [^#\n]+)", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert {"solve", "plot", "report", "view", "map", "feasibility"} == {command.split()[0] for command in commands}
    for command in commands:
        cli(shlex.split(command), standalone_mode=False)


DOCUMENTS = ["README.md", *sorted(str(path.relative_to(ROOT)) for path in ROOT.glob("cases/*/README.md"))]


@pytest.mark.parametrize("document", DOCUMENTS)
def test_readmes_link_to_what_is_there(document):
    path = ROOT / document
    links = re.findall(r"\]\((?!http)([^)#]+)\)", path.read_text(encoding="utf-8"))
    missing = [link for link in links if not link.endswith(".png") and not (path.parent / link).exists()]
    assert links
    assert not missing
