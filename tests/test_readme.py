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


def off_path(case, run):
    """Largest distance (m) from the path, as `solve` prints it."""
    return max(one.attrs["distance"] for one in case.file[f"{run}/off_path"].values())


CLAIMS = {  # text of the README with a number, the case that shows it, its unit in SI and how to read it
    r"leave (\d+) µm": ("two_link_tracking", 1e-6, lambda case: off_path(case, "without_patches")),
    r"at most \*\*(\d+) V\*\*": ("two_link_tracking", 1.0, lambda case: max(
        abs(case.file[f"carried/pzt/link{k}/voltage"][()]).max() for k in (1, 2))),
    r"leaves ([\d.]+) mm RMS": ("two_link_rest_to_rest", 1e-3, lambda case: (
        case.file["pd/control"].attrs["tip_error_rms"])),
}  # fmt: skip


@pytest.mark.nightly
@pytest.mark.parametrize("claim", CLAIMS)
def test_first_screen_states_what_a_run_shows(claim, solved):
    """To the digits that it has; the case's page, which is linked beside it, has the command."""
    case, unit, of = CLAIMS[claim]
    text = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    number = re.search(claim, text)[1]
    assert f"cases/{case}/README.md" in text
    assert f"ffrobot solve cases/{case}/scene.toml" in (ROOT / "cases" / case / "README.md").read_text(encoding="utf-8")
    digits = len(number.partition(".")[2])
    assert round(of(solved(case)) / unit, digits) == float(number)


@pytest.mark.nightly
def test_first_screen_states_bounds_that_runs_keep(solved):
    assert "less than 10 nm" in " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    assert off_path(solved("two_link_tracking"), "replay") < 1e-8


# text of the README with a number, and the cell of a case's table, with a unit, that its own tests compare with runs
CELLS = {
    r"leave (\d+) µm": ("two_link_tracking", "run", "`without_patches`", 1, 1e6),
    r"at most \*\*(\d+) V\*\*": ("two_link_tracking", "run", "`replay`", 0, 1.0),
    r"leaves ([\d.]+) mm RMS": ("two_link_rest_to_rest", "run", "`pd`", 0, 1.0),
    r"put the tool \*\*([\d.]+) mm\*\*": ("arm_6r", "run", "joints locked", 1, 1.0),
    r"gears ([\d.]+) mm": ("arm_6r", "gears", "motors on", 1, 1.0),
}


@pytest.mark.parametrize("claim", CELLS)
def test_first_screen_has_the_numbers_of_the_cases(claim):
    case, table, row, column, unit = CELLS[claim]
    number = re.search(claim, " ".join((ROOT / "README.md").read_text(encoding="utf-8").split()))[1]
    lines = (ROOT / "cases" / case / "README.md").read_text(encoding="utf-8").partition(f"\n| {table} |")[2]
    cells = next(line.split("|") for line in lines.splitlines() if line.startswith(f"| {row}"))[2:]
    assert f"{float(cells[column]) * unit:.{len(number.partition('.')[2])}f}" == number


DOCUMENTS = ["README.md", *sorted(str(path.relative_to(ROOT)) for path in ROOT.glob("cases/*/README.md"))]


@pytest.mark.parametrize("document", DOCUMENTS)
def test_readmes_link_to_what_is_there(document):
    path = ROOT / document
    links = re.findall(r"\]\((?!http)([^)#]+)\)", path.read_text(encoding="utf-8"))
    missing = [link for link in links if not link.endswith(".png") and not (path.parent / link).exists()]
    assert links
    assert not missing
