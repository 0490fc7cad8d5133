"""Results of all cases, and of scenes of what these leave out, are those of reference files.

`make_references.py` made them by the program itself: they show that nothing has changed unnoticed, not that it is
right.
"""

import h5py
import numpy as np
import pytest
import reference_numbers
from reference_scenes import CASES, MADE, MORE, NIGHTLY

import ffrobot

pytestmark = pytest.mark.filterwarnings("ignore::ffrobot.FfrobotWarning")


def meets_its_reference(name, found):
    differing = reference_numbers.differing(name, found)
    worst = "\n".join(map(str, differing[:8]))
    assert not differing, f"{len(differing)} of {len(found)} numbers of {name} are not those of its reference:\n{worst}"


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.nightly] * (name in NIGHTLY)) for name in CASES]
)
def test_cases(name, solved):
    """Solved by commands, so that the memory of their meshes goes with them."""
    path = CASES[name]
    found = reference_numbers.reduced(solved(path.parent.name, scene=path.name).file)
    meets_its_reference(name, found)


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.nightly] * (name in MORE)) for name in MADE])
def test_made_scenes(name):
    with ffrobot.solve(MADE[name]()) as results:
        meets_its_reference(name, reference_numbers.of_results(results))


def test_every_reference_is_of_a_scene():
    assert {path.stem for path in reference_numbers.FOLDER.glob("*.npz")} == CASES.keys() | MADE.keys()


@pytest.fixture
def changed(tmp_path):
    """The largest differences of a small results file from its own reference after a change."""

    def differences(change):
        found = []
        for number in (0, 1):
            with h5py.File(tmp_path / f"{number}.h5", "w") as file:
                file["inverse/joints/O/moment"] = np.linspace(0.0, -4.0, 50)
                file["inverse/joints/A/moment"] = 1e-9 * np.ones(50)
                file["inverse/joints/A"].attrs["type"] = "revolute"
                file["inverse/joints/O/moment"].attrs["peak"] = 4.0
                file["inverse"].attrs["status"] = "completed"
                file.create_group("inverse/settling/A.tip").attrs.update(residual=1e-4, at_end=1e-15, tolerance=1e-3)
                if number:
                    change(file["inverse"])
                found.append(reference_numbers.reduced(file))
        reference_numbers.write(found[0], tmp_path / "kept.npz")
        return reference_numbers.differences(found[1], reference_numbers.read(tmp_path / "kept.npz"))

    return differences


def numbers(group):
    group["joints/O/moment"][...] *= 1 + 1e-5


def a_text(group):
    group["joints/A"].attrs["type"] = "prismatic"


def a_gap(group):
    group["joints/O/moment"][-1] = np.nan


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (numbers, "inverse/joints/O/moment: differs by 4e-05, allowed 4e-06"),
        (a_text, "inverse/joints/A@type: expected () revolute, found () prismatic"),
        (a_gap, "inverse/joints/O/moment: differs by inf"),
        (lambda group: group.__delitem__("joints/A/moment"), "inverse/joints/A/moment: missing"),
        (lambda group: group.__setitem__("new", 1.0), "inverse/new: not in the reference"),
        (
            lambda group: group["joints/O/moment"].attrs.__setitem__("peak", 4.1),
            "inverse/joints/O/moment@peak: differs",
        ),
        (
            lambda group: group["settling/A.tip"].attrs.__setitem__("residual", 1.1e-4),
            "inverse/settling/A.tip@residual: differs by 1e-05, allowed 2e-06",
        ),
    ],
)
def test_a_change_is_found_and_named(changed, change, message):
    worst, *others = changed(change)
    assert worst.share > 1
    assert str(worst).startswith(message)
    assert not any(other.share > 1 for other in others)


def test_rounding_is_none(changed):
    def round_off(group):
        group["joints/O/moment"][...] *= 1 + 1e-9
        group["joints/A/moment"][...] = 2e-9  # next to nothing beside that of the other joint
        group["settling/A.tip"].attrs["at_end"] = 3e-15  # m, next to nothing beside the tolerance

    assert changed(round_off)[0].share <= 1
