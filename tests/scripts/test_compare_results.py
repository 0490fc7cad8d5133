"""scripts/compare_results.py: equal files are equal, and each way to differ is told."""

import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

SCRIPT = Path(__file__).parents[2] / "scripts" / "compare_results.py"


@pytest.fixture
def folders(tmp_path):
    """Two folders with the same file."""
    for name, seconds in (("before", 1.0), ("after", 2.0)):
        (tmp_path / name).mkdir()
        with h5py.File(tmp_path / name / "arm.results.h5", "w") as file:
            file.attrs.update({"format": "ffrobot-results", "ffrobot_version": name})
            file["inverse/time"] = np.linspace(0, 1, 5)
            file["inverse/force"] = np.array([[1.0, np.nan], [-4.0, 2.0]])
            file["inverse"].attrs["wall_seconds"] = seconds
            file["inverse"].attrs["steps"] = 7
    return tmp_path / "before", tmp_path / "after"


def compare(folders, *options):
    command = [sys.executable, SCRIPT, *folders, *options]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    return done.returncode, done.stdout


def test_equal_but_for_seconds_and_version(folders):
    assert compare(folders) == (0, "2 datasets compared, 0 differences\n")
    assert compare([folder / "arm.results.h5" for folder in folders])[0] == 0


def change(name, value):
    def edit(file):
        del file[name]
        file[name] = value

    return edit


def attribute(name, value):
    return lambda file: file["inverse"].attrs.__setitem__(name, value)


CHANGES = {
    "a bit": (
        change("inverse/time", np.nextafter(np.linspace(0, 1, 5), 2)),
        "inverse/time: differs by 2.22e-16, 2.22e-16 of the peak",
    ),
    "a shape": (change("inverse/time", np.zeros(4)), "inverse/time: float64 (5,) became float64 (4,)"),
    "a place without value": (
        change("inverse/force", np.array([[1.0, 0.0], [-4.0, 2.0]])),
        "inverse/force: not a number in other places",
    ),
    "a dataset more": (lambda file: file.__setitem__("inverse/new", 1.0), "inverse/new: only after"),
    "a dataset less": (lambda file: file.__delitem__("inverse/time"), "inverse/time: only before"),
    "an attribute": (attribute("steps", 8), "inverse: attribute steps: 7 became 8"),
    "an attribute more": (attribute("rejected", 1), "inverse: attribute rejected: only after"),
}


@pytest.mark.parametrize(("edit", "line"), CHANGES.values(), ids=CHANGES)
def test_what_differs_is_told(folders, edit, line):
    with h5py.File(folders[1] / "arm.results.h5", "a") as file:
        edit(file)
    code, output = compare(folders)
    assert code == 1
    assert output.splitlines()[0] == f"arm.results.h5: {line}"
    assert output.splitlines()[-1].endswith(", 1 differences")


def test_a_tolerance_is_of_the_largest_value(folders):
    with h5py.File(folders[1] / "arm.results.h5", "a") as file:
        change("inverse/force", np.array([[1.0 + 3e-6, np.nan], [-4.0, 2.0]]))(file)
    assert compare(folders, "--relative", "1e-6")[0] == 0
    assert compare(folders, "--relative", "5e-7")[0] == 1


def test_a_missing_file_and_nothing_to_compare(folders, tmp_path):
    (folders[1] / "arm.results.h5").rename(folders[1] / "leg.results.h5")
    code, output = compare(folders)
    assert code == 1
    assert [line.split(": ")[1] for line in output.splitlines()[:2]] == ["missing", "missing"]
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    assert compare((tmp_path / "a", tmp_path / "b"))[0] == 1
