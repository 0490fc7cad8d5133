"""Results files against the reference numbers of a case, and against what every results file holds."""

import csv
import re
from pathlib import Path

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
        name, *cells = (cell.strip(" `") for cell in line.strip("|").split("|"))
        rows[name] = [float(re.sub(r"[^0-9.e+-]", "", cell) or "nan") for cell in cells]
    return rows


def check_table(case, first, tolerance, measured, smallest=0.0):
    """Every number of the README; `measured` has those of a row by its name, what is below `smallest` is nothing."""
    for name, numbers in readme_table(case, first).items():
        np.testing.assert_allclose(measured(name), numbers, rtol=tolerance, atol=smallest, err_msg=name)


def column(group, name):
    """`points/rod.mid/deflection[1]` → that component over time."""
    dataset, index = re.fullmatch(r"([^\[]+)(?:\[(-?\d+)\])?", name).groups()
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


def peak(values):
    return float(np.abs(values[()]).max())


def tip_error(file, analysis, source, tip="link2.tip"):
    """Largest distance of the tip from where the inverse analysis has it, m."""
    way = file[f"{analysis}/points/{tip}/position"][()] - file[f"{source}/points/{tip}/position"][()]
    return float(np.linalg.norm(way, axis=1).max())
