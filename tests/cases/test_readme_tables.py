"""Numbers in tables of the cases' READMEs, against runs.

The program wrote them, in two to five digits. That they are right is tested against closed forms, by identities and by
orders, and in test_two_link.py and test_cases.py against independent codes.
"""

import re
from itertools import product

import numpy as np
import pytest
from checkpoints import check_table, column, peak, readme_table, tip_error
from reference_scenes import NIGHTLY

from ffrobot import Results


def peaks(*names):
    """Of datasets, with the name of a row for {}; deflections after "mm" in mm."""

    def of_row(case, row):
        values = [column(case.file, name.removeprefix("mm ").format(row)) for name in names]
        return [peak(one) * (1e3 if name.startswith("mm ") else 1.0) for one, name in zip(values, names, strict=True)]

    return of_row


def metrics(*keys):
    """Of closed loops that are stable, one in each row; distances in mm."""

    def of_row(case, row):
        about = case.file[f"{row}/control"].attrs
        return [about[key] * (1.0 if key.startswith("peak_") else 1e3) for key in keys]

    return of_row


def bars_with_patches(case, row):
    group = case.file[f"inverse/patch_structure/{row}"]
    bare, patched = group["frequency"][()]
    return [*np.diff(group["mass"][()]), *100 * (patched / bare - 1)[[0, 4, 9]]]


def split(case, row):
    of = "split" if row.startswith("split") else "inverse"
    key = "required_voltage" if row == "full" else "voltage"
    volts = 0.0 if row.endswith("motors") else max(peak(case.file[f"{of}/pzt/link{k}/{key}"]) for k in (1, 2))
    y = case.file[f"{row}/points/link2.tip/deflection"][:, 1]
    vibration = y[50:-50] - np.convolve(y, np.full(101, 1 / 101), "valid")
    return [volts, tip_error(case.file, row, of), peak(vibration)]


def frequencies(case, row):
    """Modes 3 to 6, and the largest real part of a pole."""
    analysis = "at_rest" if row == "rest" else "along"
    (k,) = [0] if row == "rest" else case.rows(analysis, [float(re.search(r"[\d.]+", row)[0])])
    linear = case.file[f"{analysis}/linear"]
    return [*linear["frequency"][k, 2:6], linear["pole"][k, :, 0].max()]


def slowest_zero(case, row):
    """With a positive real part."""
    of_pairs = case.file["at_rest/linear/zeros"].values()
    (zeros,) = [of[0] for of in of_pairs
                if " → ".join(", ".join(of.attrs[key]) for key in ("inputs", "outputs")) == row]  # fmt: skip
    right = zeros[zeros[:, 0] > 0.1]
    return right[np.linalg.norm(right, axis=1).argmin()]


def places(case, row):
    group = case.file[f"{row}/placement"]
    of_both = [group[f"{k}/value"][()] for k in ("best", "even")]
    return [*(group["largest_voltage"] if row.startswith("path") else of_both), group.attrs["sets"]]


def joints_as_built(case, row):
    ideal = np.loadtxt(case.folder / "ideal.csv", delimiter=",", skiprows=2)[:, 1 + "OA".index(row)]
    group = case.file[f"inverse/joints/{row}"]
    without = [np.abs(ideal).max(), np.abs(group["moment"][::10] - ideal).max()]
    return [peak(group["moment"]), *without, peak(group["motor_moment"])]


def slew(case, row):
    group = case.file["slew"]
    t, e, deflection = (
        group["time"][()],
        group["bodies/hub/quaternion"][()],
        1e3 * group["points/boom.tip/deflection"][()],
    )
    turn = 2 * np.degrees(np.arctan2(np.linalg.norm(e[:, 1:], axis=1), np.abs(e[:, 0])))
    return [peak({
        "motor torque (N·m)": group["joints/drive/moment"],
        "angular velocity of the hub (rad/s)": np.linalg.norm(group["bodies/hub/angular_velocity"], axis=1),
        "turn of the hub after the slew (degrees)": turn[t >= 4.0],
        "deflection of the tip, y (mm)": deflection[:, 1],
        "deflection of the tip, z (mm)": deflection[:, 2],
        "deflection after the slew, z (mm)": deflection[t >= 4.0, 2],
    }[row])]  # fmt: skip


def deflection_of_tip(case, row):
    with Results(case.file.filename) as results:
        return [results.peak(f"{row}/points/arm.tip/deflection")[0]]


METRICS = metrics("tip_error_rms", "tip_error_max", "vibration", "residual", "peak_moment", "peak_voltage")
# By case and by the head of the first column: how far from them a number may be, relatively, and what is in a row.
TABLES = {
    ("two_link_fcid", "analysis"): (0.02, peaks(
        *(f"{{}}/joints/{joint}/moment" for joint in "OA"), *(f"{{}}/pzt/link{k}/required_voltage" for k in (1, 2))
    )),
    ("two_link_patched", "link"): (0.05, bars_with_patches),  # changes of frequency in percent, of two digits
    ("straight_slew", "run"): (0.01, deflection_of_tip),
    ("two_link_split", "run"): (0.05, split),  # errors that rounding has a share in
    ("two_link_linear", "about"): (1e-3, frequencies),
    ("two_link_linear", "from → to"): (1e-3, slowest_zero),
    ("two_link_placement", "analysis"): (0.01, places),
    ("geared_arm", "joint"): (0.02, joints_as_built),
    ("compliant_arm", "run"): (0.02, metrics("tip_error_rms", "tip_error_max", "vibration")),
    ("two_link_closed_loop", "run"): (0.02, METRICS),
    ("two_link_rest_to_rest", "run"): (0.02, METRICS),
    ("arm_6r", "motor"): (0.01, peaks(
        "straight/joints/{}/moment", "inverse/joints/{}/moment", "inverse/joints/{}/rate"
    )),
    ("slider_crank_3d", "largest"): (1e-3, peaks(
        "inverse/trajectories/slider/force", "inverse/joints/crank/moment",
        *(f"mm inverse/points/rod.mid/deflection[{k}]" for k in (1, 2)), "inverse/bodies/rod/modal_force[-1]",
    )),
    ("slewing_appendage", "largest"): (1e-3, slew),
}  # fmt: skip


@pytest.mark.parametrize(
    "table", [pytest.param(of, marks=[pytest.mark.nightly] * (of[0] in NIGHTLY), id=" ".join(of)) for of in TABLES]
)
def test_numbers_of_the_readme(solved, table):
    case, (tolerance, of_row) = solved(table[0]), TABLES[table]
    check_table(*table, tolerance, lambda row: of_row(case, row), smallest=1e-9)


def test_patches_and_links_without_them(solved, two_link):
    cases = two_link.file, solved("two_link_patched").file
    check_table("two_link_patched", "peak of", 1e-3, lambda row: [peak(file[f"inverse/{row}"]) for file in cases])


@pytest.mark.nightly
def test_gears_that_give_and_rigid_ones(solved):
    """The compliant arm without its springs, nor the loops that need them."""
    built = solved("compliant_arm").file
    edited = solved(
        "compliant_arm", lambda text: re.sub(r"(stiffness|damping) = .*\n", "", text).partition("# PD of")[0]
    )
    rigid, key = edited.file, "frequencies/linear/frequency"
    check_table(
        "compliant_arm", "gears", 1e-3, lambda row: {"with drivetrain": built, "rigid": rigid}[row][key][0, 2:6]
    )
    moments = ((built, "gear_moment"), (built, "moment"), (rigid, "moment"))
    check_table(
        "compliant_arm", "joint", 0.02, lambda row: [peak(of[f"inverse/joints/{row}/{k}"]) for of, k in moments]
    )


def test_quotients_of_the_readme():
    """By how much motors and patches within their limits beat joint moments alone: of another table."""
    of, key = "two_link_rest_to_rest", {"rms": 0, "vibration": 2}
    runs, quotients = readme_table(of, "run"), readme_table(of, "times less")
    for (what, k), (way, run) in product(key.items(), {"PD and patches": "pd_patches", "LQR": "lqr"}.items()):
        found = [runs[f"moments{blow}"][k] / runs[f"{run}{blow}"][k] for blow in ("", "_blow")]
        np.testing.assert_allclose(found, quotients[f"{what}, {way}"], rtol=0.03)
