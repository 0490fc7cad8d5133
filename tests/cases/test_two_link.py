"""The paper's two-link manipulator and slider-crank through `ffrobot solve`: their results files, number by number."""

import json
from pathlib import Path

import numpy as np
import pytest
from checkpoints import check_column, reference, with_analyses

from ffrobot.fe_models.modal_body_file import read_modal_body

CHECKPOINTS = {case: reference(f"{case}/reference.csv") for case in ("two_link", "slider_crank")}
VOLTAGES = reference("two_link/reference_voltages.csv")
RELATIVE = {"two_link": 1e-7, "slider_crank": 1e-6}  # of each quantity's peak
PZT = ("link1", "link2")


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


def modal_force_per_volt(body):
    """Φ_V (modes, patches) by hand: Shabana 2022, eq. 14, times the turn of a patch's end sections.

    Ten patches of 0.05 m, 0.025 m wide and 0.75 mm thick, on a bar 0.015 m high; sections turn by cubics in an element.
    """
    moment = 63e9 * 110e-12 * 0.025 * (0.015 + 0.75e-3) / 2
    x, elements = body.stations.position[:, 0], body.stations.element

    def rotation(at):
        element = next(element for element in elements if x[element[0]] <= at <= x[element[3]])
        powers = np.vander(x[element] - at, 4)  # the constant of the cubic about `at` is its value there
        return np.linalg.solve(powers, body.stations.rotation[element, 2])[3]

    centers = (np.arange(10) + 0.5) / 10
    return moment * np.array([rotation(center + 0.025) - rotation(center - 0.025) for center in centers]).T


def test_voltages_within_the_limit(two_link):
    """`voltage` keeps to 200 V and leaves less of the modal forces unmet than `required_voltage` cut there would."""
    inverse, modal_files = two_link.file["inverse"], json.loads(two_link.file.attrs["modal_bodies"])
    for body in PZT:
        group = inverse[f"pzt/{body}"]
        required, voltage, unmet = (group[name][()] for name in ("required_voltage", "voltage", "residual_force"))
        assert group.attrs["limit"] == 200.0
        assert np.abs(voltage).max() == 200.0
        residual = group["residual"][()]
        np.testing.assert_allclose(residual, np.linalg.norm(unmet, axis=1), rtol=1e-12)
        assert np.all(residual[1:] > 0.0)
        cut = np.clip(required, -200.0, 200.0)
        Phi_V = modal_force_per_volt(read_modal_body(Path(modal_files[body]["path"])))
        modal_force = inverse[f"bodies/{body}/modal_force"][()]
        np.testing.assert_allclose(required @ Phi_V.T, modal_force, atol=1e-9 * np.abs(modal_force).max())
        np.testing.assert_allclose((required - voltage) @ Phi_V.T, unmet, atol=1e-9 * np.abs(unmet).max())
        assert np.all(
            residual <= np.linalg.norm((required - cut) @ Phi_V.T, axis=1) * (1 + 1e-6) + 1e-6 * residual.max()
        )


def test_frame_motors_leave_link_1_to_its_motor(two_link, frame_motors):
    """The moments are those of the other definition; only the patches of link 1 have nothing left to do."""
    for joint in ("O", "A"):
        a, b = (case.file[f"inverse/joints/{joint}/moment"][()] for case in (two_link, frame_motors))
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-6 * np.abs(a).max())
    assert np.abs(frame_motors.file["inverse/pzt/link1/required_voltage"]).max() < 1e-3
