"""`ffrobot bench --part replays`: replays are measured beside the PCID that they follow."""

import pytest

pytestmark = pytest.mark.alone


@pytest.fixture(scope="module")
def rows(bench):
    keys = ("scene", "what", "integrator", "tolerance")
    return {tuple(row[key] for key in keys): row for row in bench("replays", "--repeat", "2")}


@pytest.mark.parametrize(("apply", "largest"), [("trajectory", 2.9), ("joints+pzt", 4.0)])
def test_with_all_forces_the_steps_are_those_of_pcid(rows, apply, largest):
    """Quiet machines show 2.0 and 3.2 times PCID; the dense output of its steps instead would take 4.8 and 6."""
    row = rows["two_link", apply, "dop853", "0.0001"]
    assert row["steps"] == row["steps_of_pcid"]
    assert float(row["of_pcid"]) < largest


def test_replays_return_to_pcid(rows):
    """Within round-off in equal steps, within the tolerance in others: free tips need shorter ones than held ones."""
    assert float(rows["two_link", "trajectory", "dop853", "0.0001"]["off"]) < 1e-12
    for scene in ("two_link", "arm_3r"):
        for integrator, tolerance in (("auto", "0.0001"), ("dop853", "1e-06")):
            row = rows[scene, "trajectory", integrator, tolerance]
            assert row["steps"] != row["steps_of_pcid"]
            assert float(row["off"]) < 1e-4


def test_motors_alone_take_shorter_steps(rows):
    """Links ring without the modal forces: steps fit those of PCID no more."""
    row = rows["two_link", "joints", "dop853", "0.0001"]
    assert int(row["steps"]) > 1.5 * int(row["steps_of_pcid"])
