"""The case of a streamed motion: numbers of its README."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ffrobot import smooth_motion

CASE = Path(__file__).parents[2] / "cases/ur5_streamed"


@pytest.mark.nightly
def test_numbers_of_the_readme(tmp_path):
    shutil.copytree(CASE, tmp_path, dirs_exist_ok=True)
    subprocess.run([sys.executable, "make_motions.py"], cwd=tmp_path, check=True)
    plan, logged = (smooth_motion(tmp_path / "arm.toml", tmp_path / name) for name in ("plan.csv", "logged.csv"))
    text = (CASE / "README.md").read_text(encoding="utf-8")
    table = re.findall(r"\| ([a-z ]+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|", text)
    printed = {name: list(map(float, numbers)) for name, *numbers in table}
    settling = plan.before.ride.settling
    rows = {"as it is": [settling.path_end, settling.path_end + settling.time_to, 1e3 * plan.before.residual]}
    for one in plan.candidates:
        rows[re.match(r"\w+", one.name)[0]] = [one.times[-1], one.settled, 1e3 * one.residual]
    assert rows.keys() == printed.keys()
    for name, row in rows.items():
        assert row[:2] == pytest.approx(printed[name][:2], rel=5e-3), name
        assert row[2] == pytest.approx(printed[name][2], rel=0.02, abs=1e-5), name  # mm: the tolerance of integration
    assert 1e3 * logged.before.residual == pytest.approx(6.0, rel=0.02)
    assert [fault.kind for fault in logged.before.faults] == ["jitter", *["limit"] * 3]
    assert 1e3 * logged.before.even.settling.residual == pytest.approx(printed["as it is"][2], rel=0.02)
    assert logged.best.residual < 1e-4
