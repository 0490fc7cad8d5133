"""`python -m bench --part replays`: replays are measured beside the PCID that they follow."""

import pytest

from bench.replays import TOLERANCE, measure_replays
from ffrobot.run.watcher import Watcher
from ffrobot.scene.load import load_scene

pytestmark = [pytest.mark.alone, pytest.mark.nightly]


def test_with_all_forces_the_steps_are_those_of_pcid(case_copy):
    """Quiet machines show 2.0 and 3.2 times PCID; the dense output of its steps instead would take 4.8 and 6."""
    rows = measure_replays([load_scene(case_copy("two_link"))], 1, Watcher())
    for apply, largest, off in (("trajectory", 2.9, 1e-12), ("joints+pzt", 4.0, 1e-9)):
        (row,) = (
            row for row in rows if (row["what"], row["integrator"], row["tolerance"]) == (apply, "dop853", TOLERANCE)
        )
        assert row["steps"] == row["steps_of_pcid"]
        assert float(row["of_pcid"]) < largest
        assert float(row["off"]) < off
