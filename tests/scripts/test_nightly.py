"""The tests that nightly.txt leaves to the night, and those of the day beside them, are there."""

import re
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
LINES = (TESTS / "nightly.txt").read_text(encoding="utf-8").splitlines()[4:]


@pytest.mark.parametrize("line", LINES)
def test_a_test_of_the_night_has_one_of_the_day(line):
    night, day = line.split(" | ")
    of_night, of_day = (name.partition("[")[0] for name in (night, day))
    for name in (of_night, of_day):
        file, function = name.split("::")
        assert re.search(rf"^def {function}\(", (TESTS / file).read_text(encoding="utf-8"), re.MULTILINE), name
    assert of_day not in {other.partition(" | ")[0] for other in LINES}
    assert "[" in night or of_day != of_night


def test_lines_are_in_order_and_each_is_once():
    assert sorted(set(LINES)) == LINES


def test_tests_of_the_night_are_collected_and_those_beside_them_run_by_day(request):
    """Where all tests are: pytest without files or words that choose."""
    chosen = request.config.option
    if chosen.file_or_dir or chosen.keyword or chosen.markexpr:
        pytest.skip("not all tests were collected")
    assert request.config.wrong_nights == []
