"""The tests that nightly.txt leaves to the night are there, and those beside them run by day."""

from pathlib import Path

import pytest

LINES = (Path(__file__).parents[1] / "nightly.txt").read_text(encoding="utf-8").splitlines()[4:]


def test_lines_are_in_order_and_each_is_once():
    assert sorted(set(LINES)) == LINES


def test_tests_of_the_night_are_collected_and_those_beside_them_run_by_day(request):
    """Where all tests are: pytest without files or words that choose."""
    chosen = request.config.option
    if chosen.file_or_dir or chosen.keyword or chosen.markexpr:
        pytest.skip("not all tests were collected")
    assert request.config.wrong_nights == []
