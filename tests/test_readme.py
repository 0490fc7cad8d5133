"""The README's own arm, as a reader would copy it; and its numbers, against runs, scenes and records."""

import csv
import math
import re
import shlex
import tomllib
from importlib.metadata import version
from pathlib import Path

import h5py
import numpy as np
import pytest
import test_two_link

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


@pytest.mark.nightly
def test_first_screen_states_what_a_run_shows(solved):
    """To the digits that it has; what the case with a controller leaves is in a table, see below."""
    case, text = solved("two_link_tracking"), " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    voltage = max(abs(case.file[f"carried/pzt/link{k}/voltage"][()]).max() for k in (1, 2))
    found = {r"leave (\d+) µm": 1e6 * off_path(case, "without_patches"), r"at most \*\*(\d+) V\*\*": voltage}
    for claim, number in found.items():
        assert round(number) == float(re.search(claim, text)[1])
    assert "less than 10 nm" in text
    assert off_path(case, "replay") < 1e-8


@pytest.mark.nightly
def test_table_of_robustness_is_that_of_the_run(solved):
    """Of the case on the first screen: held commands and other links, in all three lanes."""
    case = solved("two_link_tracking", lambda text: text.replace('"carried"\n', '"carried"\nrobustness = {}\n', 1))
    lanes = case.file["carried/robustness"]
    causes = list(lanes.attrs["causes"])
    table = (ROOT / "cases/two_link_tracking/README.md").read_text(encoding="utf-8").partition(f"| {ROBUST} |")[2]
    for row, cause in (("zero-order hold of 1 ms", "zero-order hold of 1 ms"), ("links 1 %", "stiffness ± 1 %")):
        cells = next(line.split("|") for line in table.splitlines() if line.startswith(f"| {row}"))[2:5]
        for cell, lane in zip(cells, ("open_loop", "joint_control", "joint_control_without_voltages"), strict=True):
            assert float(cell) == pytest.approx(1e3 * lanes[lane][causes.index(cause)], rel=0.05)


# text of the README with a number, and the cell of a case's table, with a unit, that its own tests compare with runs
ROBUST = "largest distance of the tip from its path (mm)"
CELLS = {
    r"remains \([^)]*\)\): ([\d.]+) µm": ("two_link_tracking", ROBUST, "zero-order hold of 1 ms", 0, 1e3),
    r"ms, and ([\d.]+) mm, with patches": ("two_link_tracking", ROBUST, "links 1 % stiffer", 1, 1.0),
    r"([\d.]+) mm, with patches as without": ("two_link_tracking", ROBUST, "links 1 % stiffer", 2, 1.0),
    r"leave (\d+) µm": ("two_link_tracking", "run", "`without_patches`", 1, 1e6),
    r"at most \*\*(\d+) V\*\*": ("two_link_tracking", "run", "`replay`", 0, 1.0),
    r"leaves ([\d.]+) mm RMS": ("two_link_rest_to_rest", "run", "`pd`", 0, 1.0),
    r"put the tool \*\*([\d.]+) mm\*\*": ("arm_6r", "run", "joints locked", 1, 1.0),
    r"gears ([\d.]+) mm": ("arm_6r", "gears", "motors on", 1, 1.0),
    r"vibrates by ([\d.]+) mm": ("arm_6r", "behind gears", "swift.toml", 1, 1.0),
    r"shaper leaves \*\*([\d.]+) mm": ("arm_6r", "behind gears", "shaped.toml", 1, 1.0),
}


@pytest.mark.parametrize("claim", CELLS)
def test_first_screen_has_the_numbers_of_the_cases(claim):
    case, table, row, column, unit = CELLS[claim]
    number = re.search(claim, " ".join((ROOT / "README.md").read_text(encoding="utf-8").split()))[1]
    lines = (ROOT / "cases" / case / "README.md").read_text(encoding="utf-8").partition(f"\n| {table} |")[2]
    cells = next(line.split("|") for line in lines.splitlines() if line.startswith(f"| {row}"))[2:]
    assert f"{float(cells[column]) * unit:.{len(number.partition('.')[2])}f}" == number


def scene(case):
    return tomllib.loads((ROOT / "cases" / case / "scene.toml").read_text(encoding="utf-8"))


def printed(case, text):
    """Numbers of a case's README, which its own tests compare with runs."""
    return re.search(text, (ROOT / "cases" / case / "README.md").read_text(encoding="utf-8")).groups()


def record(name, **key):
    """The row of a table that `python -m bench` writes."""
    with (ROOT / "docs" / "benchmarks" / "two_link" / name).open(encoding="utf-8") as file:
        return next(row for row in csv.DictReader(file) if key.items() <= row.items())


def of_line():
    """Length of the line between (3/2, √3/2) and cos(π/4) times that, and its time."""
    return math.hypot(1.5, math.sqrt(3) / 2) * (1 - math.cos(math.pi / 4)), scene("two_link_tracking")["analysis"][0][
        "end"
    ]


def measured_beam():
    settles, frequency = r"settled within 0.5 mm +([\d.]+) +([\d.]+)", r"lowest frequency .*\+([\d.]+) %"
    return (*printed("piezo_beam_measured", settles), *printed("piezo_beam_measured", frequency))


def benchmark():
    row = record("work_precision.csv", integrator="dop853", tolerance="0.0001")
    return row["error_force"], row["seconds"]


HOLD = r"zero-order hold of (\d+) ms"
FACTS = {  # text of the README, and its numbers by their source
    r"along a ([\d.]+) m line in ([\d.]+) s": of_line,
    HOLD: lambda: printed("two_link_tracking", HOLD),
    r"sample time of (\d+) ms": lambda: (1e3 * scene("two_link_rest_to_rest")["analysis"][-1]["sample_time"],),
    r"arm\]\S+ carries (\d+) kg": lambda: (scene("arm_6r")["payload"][0]["mass"],),
    r"load of (\d+) kg; deflections are drawn (\d+) times": lambda: (
        scene("arm_6r")["payload"][0]["mass"], *printed("arm_6r", r"motion\.gif.*--scale (\d+)")),
    r"settles in ([\d.]+) s in the model and in ([\d.]+) s": lambda: measured_beam()[:2],
    r"settles in ([\d.]+) s, measured ([\d.]+) s; lowest frequency ([\d.]+) % high": measured_beam,
    r"independent code \| (1e-\d) of each peak in motions": lambda: (test_two_link.RELATIVE["two_link"],),
    r"fourteen 3D cases \S+ \S+ \S+ code \| (1e-\d) of each peak": lambda: (
        {14: 1e-6}[len(list((ROOT / "tests" / "checkpoints" / "spatial").glob("*.json")))],),
    r"within (\de-\d) of its peak \| ([\d.]+) s on one core": benchmark,
    r"mesh (\d+) %, modes (\d+) %": lambda: [
        100 * float(record("axes.csv", axis=axis, times="1")["error_force"]) for axis in ("mesh", "modes")],
}  # fmt: skip


@pytest.mark.parametrize("fact", FACTS)
def test_numbers_are_those_of_their_source(fact):
    """To the digits that they have."""
    numbers = re.search(fact, " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())).groups()
    for number, found in zip(numbers, FACTS[fact](), strict=True):
        exact = format(float(found), ".0e" if "e" in number else f".{len(number.partition('.')[2])}f")
        assert float(exact) == float(number)


def test_no_number_stands_without_a_source():
    """Numbers with a unit, outside the arm that is to be copied."""
    text = re.sub(r"```.*?```|^    .*?$", "", (ROOT / "README.md").read_text(encoding="utf-8"), flags=re.DOTALL | re.M)
    text = " ".join(text.split())
    claims = [match.span() for claim in (*FACTS, *CELLS, "less than 10 nm") for match in re.finditer(claim, text)]
    numbers = re.finditer(r"(?<![\w.-])\d[\d.]*(?:e-\d+|\*{0,2} (?:[nµmk]?m|m?s|kg|V|%|times|minutes|hours)\b)", text)
    missing = [number[0] for number in numbers if not any(a <= number.start() < b for a, b in claims)]
    assert not missing
    assert f"Version {version('ffrobot')}, " in text
