"""`python -m bench --part evaluations`: every mechanism has its row, measured beside the program written by hand."""

import pytest

pytestmark = [pytest.mark.alone, pytest.mark.nightly]


@pytest.fixture(scope="module")
def rows(bench):
    return {row["what"]: row for row in bench("evaluations")}


def seconds(rows, what):
    return float(rows[what]["seconds_min"])


def test_more_is_slower(rows):
    """Six links than three, flexible ones than rigid; the program written by hand is the least and its own measure."""
    arms = [f"arm of {n} links × 10 modes in 3D, {n} constraints" for n in (3, 6)]
    hand_written = rows["two links × 10 modes, hand-written"]
    assert seconds(rows, arms[0]) < seconds(rows, arms[1])
    assert seconds(rows, "arm of 6 rigid links in 3D, 6 constraints") < seconds(rows, arms[1])
    assert float(hand_written["of_hand_written"]) == 1.0
    assert all(float(row["of_hand_written"]) >= 1.0 for row in rows.values())
