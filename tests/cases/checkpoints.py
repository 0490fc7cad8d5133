"""Results files against the reference numbers of a case, and against what every results file holds."""

import csv
import hashlib
import json
import re
from pathlib import Path

import h5py
import numpy as np

CASES = Path(__file__).parents[2] / "cases"


def reference(name):
    """The columns of a table of reference numbers below `cases`, as text."""
    lines = [line for line in (CASES / name).read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    return {name: [row[name] for row in rows] for name in rows[0]}


def readme_table(case, first):
    """Rows {name: [numbers]} of the table in a README whose header starts with `first`."""
    text = (CASES / case / "README.md").read_text(encoding="utf-8")
    table = text[text.index(f"| {first} |") :].split("\n\n")[0]
    rows = {}
    for line in table.splitlines()[2:]:
        name, *cells = (cell.strip() for cell in line.strip("|").split("|"))
        rows[name] = [float(re.sub(r"[^0-9.e+-]", "", cell) or "nan") for cell in cells]
    return rows


# Tables of the READMEs, by case and by the head of their first column: how far from them a number may be, relatively.
# The program wrote these numbers itself, in two to five digits: they show that nothing has changed unnoticed
# (regression), not that it is right. What is right is tested against closed forms, by identities and by orders, and in
# test_two_link.py and test_slider_crank.py against independent codes.
TABLES = {
    ("two_link_fcid", "analysis"): 0.02,
    ("two_link_patched", "link"): 0.05,  # changes of frequency in percent, of two digits
    ("two_link_patched", "peak of"): 1e-3,
    ("straight_slew", "run"): 0.01,
    ("two_link_split", "run"): 0.05,  # errors that rounding has a share in
    ("two_link_linear", "about"): 1e-3,
    ("two_link_linear", "from → to"): 1e-3,
    ("two_link_placement", "analysis"): 0.01,
    ("geared_arm", "joint"): 0.02,
    ("compliant_arm", "gears"): 1e-3,
    ("compliant_arm", "joint"): 0.02,
    ("compliant_arm", "run"): 0.02,
    ("two_link_closed_loop", "run"): 0.02,
    ("two_link_rest_to_rest", "run"): 0.02,
    ("two_link_rest_to_rest", "times less"): 0.03,  # quotients of the above
    ("arm_3r", "run"): 1e-3,
    ("arm_6r", "motor"): 0.01,
    ("arm_6r", "run"): 0.02,
    ("arm_6r", "gears"): 0.01,
    ("arm_6r", "behind gears"): 0.02,
    ("slider_crank_3d", "largest"): 1e-3,
    ("slewing_appendage", "largest"): 1e-3,
}


def check_table(case, first, measured, smallest=0.0):
    """Every number of the README as `TABLES` says; what is below `smallest` counts as nothing."""
    expected = readme_table(case, first)
    assert expected.keys() == measured.keys()
    for name, numbers in expected.items():
        np.testing.assert_allclose(measured[name], numbers, rtol=TABLES[case, first], atol=smallest, err_msg=name)


def column(group, name):
    """`points/rod.mid/deflection[1]` → that component over time."""
    dataset, index = re.fullmatch(r"([^\[]+)(?:\[(\d+)\])?", name).groups()
    values = group[dataset][()]
    return values if index is None else values[:, int(index)]


def with_analyses(text, analyses):
    """The text of a scene with other analyses."""
    head = re.split(r"(?m)^\[\[analysis\]\]", text)[0]
    return head + "\n".join("[[analysis]]\n" + "\n".join(keys) + "\n" for keys in analyses)


def half_of_last_digit(number):
    """How well a printed number is known: 5e-5 for "12.3456"."""
    mantissa, _, exponent = number.partition("e")
    return 0.5 * 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def check_column(case, analysis, name, times, printed, relative):
    """Compare a column with printed numbers: to `relative` of its peak, and what the printing rounds away."""
    values = column(case.file[analysis], name)
    error = np.abs(values[case.rows(analysis, times)] - np.array(printed, dtype=float))
    allowed = relative * np.abs(values).max() + np.array([half_of_last_digit(number) for number in printed])
    assert np.all(error <= allowed), f"{name}: errors {error} exceed {allowed}, peak {np.abs(values).max():g}"


def check_layout(case, analyses, output_times, flexible, rigid):
    """Names, shapes and attributes of a results file (docs/reference/files.md).

    `flexible` maps bodies to mode numbers, `rigid` bodies to their points; `output_times` holds for every analysis.
    """
    file = case.file
    assert file.attrs["format"] == "ffrobot-results"
    assert file.attrs["scene"] == (case.folder / "scene.toml").read_text(encoding="utf-8")
    modal_files = json.loads(file.attrs["modal_bodies"])
    assert set(modal_files) == set(flexible)
    for entry in modal_files.values():
        with open(entry["path"], "rb") as stream:
            assert hashlib.sha256(stream.read()).hexdigest() == entry["sha256"]
    assert set(file) == set(analyses)
    for name, kind in analyses.items():
        group = file[name]
        assert group.attrs["kind"] == kind
        assert group.attrs["integrator"] in ("dop853", "dop853 after radau", "radau after dop853")
        assert group.attrs["status"] == "completed"
        assert 0 < group.attrs["steps"] < group.attrs["evaluations"]
        assert 0.0 < group.attrs["wall_seconds"] < 60.0
        np.testing.assert_array_equal(group["time"], output_times)
        check_motion(group, len(output_times), flexible, rigid)


def check_motion(group, count, flexible, rigid):
    modes = dict.fromkeys(rigid, 0) | flexible
    for body, n in modes.items():
        shapes = {"position": (count, 2), "angle": (count,), "modal": (count, n), "modal_velocity": (count, n)}
        for name, shape in shapes.items():
            assert group[f"bodies/{body}/{name}"].shape == shape
    points = [f"{body}.{point}" for body in flexible for point in ("root", "mid", "tip")]
    points += [f"{body}.{point}" for body, names in rigid.items() for point in names]
    for point in points:
        for name in ("position", "deflection"):
            assert group[f"points/{point}/{name}"].shape == (count, 2)
    assert group["constraint_violation"].shape == (count, 3)
    assert list(group["constraint_violation"].attrs["columns"]) == ["position", "velocity", "acceleration"]
    group.visititems(lambda _, item: _check_numbers(item))


def _check_numbers(item):
    if isinstance(item, h5py.Dataset):
        assert item.dtype == np.float64, item.name
        assert np.all(np.isfinite(item)), item.name


def peak(values):
    return float(np.abs(values[()]).max())


def tip_error(file, analysis, source, tip="link2.tip"):
    """Largest distance of the tip from where the inverse analysis has it, m."""
    way = file[f"{analysis}/points/{tip}/position"][()] - file[f"{source}/points/{tip}/position"][()]
    return float(np.linalg.norm(way, axis=1).max())
