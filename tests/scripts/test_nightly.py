"""The tests that nightly.txt leaves to the night are there, and those beside them run by day."""

import re
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
LINES = (TESTS / "nightly.txt").read_text(encoding="utf-8").splitlines()[4:]


def test_tests_of_the_night_and_those_of_the_day_are_in_their_files():
    for name in {test.partition("[")[0] for line in LINES for test in line.split(" | ")}:
        file, function = name.split("::")
        assert re.search(rf"^def {function}\(", (TESTS / file).read_text(encoding="utf-8"), re.MULTILINE), name


def test_lines_are_in_order_and_each_is_once():
    assert sorted(set(LINES)) == LINES


def test_tests_of_the_night_are_collected_and_those_beside_them_run_by_day(request):
    """Where all tests are: pytest without files or words that choose."""
    chosen = request.config.option
    if chosen.file_or_dir or chosen.keyword or chosen.markexpr:
        pytest.skip("not all tests were collected")
    assert request.config.wrong_nights == []
