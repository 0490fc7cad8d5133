"""Results of all cases, and of scenes of what these leave out, are those of reference files.

`make_references.py` made them by the program itself: they show that nothing has changed unnoticed, not that it is
right.
"""

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


def test_changes_are_named_and_rounding_is_none():
    """Of a moment by 1e-5 of it, a name, a gap, a dataset that goes or comes; and not by 1e-9."""
    expected = reference_numbers.read(reference_numbers.path_of("arm_in_3d_as_built"))
    moment, of_type = "inverse/joints/q1/moment", "inverse/joints/q1@type"
    entry, (words, peak) = expected[moment], (expected[of_type].text, expected[moment].size)
    gap = np.append(entry.numbers[:-1], np.nan)
    for name, changed, said in (
        (moment, entry._replace(numbers=entry.numbers * (1 + 1e-9)), None),
        (moment, entry._replace(numbers=entry.numbers * (1 + 1e-5)), f"differs by {1e-5 * peak:.3g}, allowed"),
        (moment, entry._replace(numbers=gap), "differs by inf"),
        (f"{moment}@peak", expected[f"{moment}@peak"]._replace(numbers=np.array([1.03 * peak])), "differs by"),
        (of_type, expected[of_type]._replace(text="prismatic"), f"expected () {words}, found () prismatic"),
        ("new", entry, reference_numbers.NEW),
    ):
        told = [f"{name}: {said}"] if said else []
        for differing in reference_numbers.differing("arm_in_3d_as_built", expected | {name: changed}):
            assert str(differing).startswith(told.pop())
        assert not told
    del expected[moment]
    (lost,) = reference_numbers.differing("arm_in_3d_as_built", expected)
    assert str(lost) == f"{moment}: missing"
