"""The paper's two-link manipulator and slider-crank through `ffrobot solve`: their results files, number by number."""

import numpy as np
import pytest
from checkpoints import check_column, reference, with_analyses

CHECKPOINTS = {case: reference(f"{case}/reference.csv") for case in ("two_link", "slider_crank")}
VOLTAGES = reference("two_link/reference_voltages.csv")
RELATIVE = {"two_link": 1e-7, "slider_crank": 1e-6}  # of each quantity's peak


@pytest.fixture(scope="module")
def frame_motors(solved):
    """The inverse analysis alone, with joint angles between body frames."""
    inverse = ['name = "inverse"', 'kind = "pcid"', "end = 1.0", "output_step = 0.001", "tolerance = 1e-7"]
    return solved(
        "two_link", lambda text: with_analyses(text.replace('motors = "section"', 'motors = "frame"'), [inverse])
    )


@pytest.mark.parametrize(
    ("case", "name"), [(case, name) for case, table in CHECKPOINTS.items() for name in table if name != "t"]
)
def test_checkpoints(request, case, name):
    table = CHECKPOINTS[case]
    times = np.array(table["t"], dtype=float)
    check_column(request.getfixturevalue(case), "inverse", name, times, table[name], RELATIVE[case])


@pytest.mark.parametrize("motors", ["section", "frame"])
@pytest.mark.parametrize("name", [name for name in VOLTAGES if name.startswith("pzt/")])
def test_voltages(request, motors, name):
    case = request.getfixturevalue("two_link" if motors == "section" else "frame_motors")
    rows = [i for i, value in enumerate(VOLTAGES["motors"]) if value == motors]
    times = np.array([float(VOLTAGES["t"][i]) for i in rows])
    check_column(case, "inverse", name, times, [VOLTAGES[name][i] for i in rows], RELATIVE["two_link"])
