"""The summary of a solve: one for planar and 3D scenes."""

from io import StringIO

import pytest
from rich.console import Console

from ffrobot.present.summary import print_summary
from ffrobot.results.file import Results
from ffrobot.results.write import results_image
from ffrobot.run.solve import solve_scene
from ffrobot.run.watcher import Watcher
from ffrobot.scene.load import make_scene

ROD = {"mass": 2.0, "inertia": 0.2, "center": [0.35, 0.0], "points": {"root": [0.0, 0.0], "tip": [0.7, 0.0]}}
PLANAR = {
    "name": "rods",
    "gravity": [0.0, 0.0],
    "body": [{"name": name, "rigid": ROD} for name in "ab"],
    "joint": [
        {"name": "O", "type": "revolute", "between": ["ground", "a.root"]},
        {"name": "A", "type": "revolute", "between": ["a.tip", "b.root"]},
    ],
    "trajectory": [{"name": "tip", "point": "b.tip", "x": "0.9 + 0.1*t", "y": "0.5"}],
    "initial": {"joints": {"O": 0.3, "A": 0.9}},
    "analysis": [
        {"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.01, "tolerance": 1e-5},
        {"name": "short", "kind": "pcid", "end": 0.1, "output_step": 0.01, "max_steps": 1, "integrator": "dopri5"},
    ],
}
SPACIOUS = {key: [*value, 0.0] for key, value in ROD.items() if key == "center"} | {
    "mass": 2.0,
    "inertia": [0.01, 0.2, 0.2],
    "points": {name: [*at, 0.0] for name, at in ROD["points"].items()},
}
SPATIAL = PLANAR | {
    "space": "spatial",
    "gravity": [0.0, 0.0, 0.0],
    "body": [{"name": name, "rigid": SPACIOUS} for name in "ab"],
    "joint": [joint | {"axis": [0.0, 0.0, 1.0]} for joint in PLANAR["joint"]],
}


@pytest.mark.parametrize("keys", [PLANAR, SPATIAL], ids=["planar", "3D"])
def test_planar_and_3d_scenes_have_the_same_summary(keys, tmp_path):
    solution = solve_scene(make_scene(**keys), Watcher())
    verdict = Results.from_image(results_image(solution), tmp_path / "x.h5").verdict
    printed = StringIO()
    print_summary(solution, verdict, tmp_path / "x.h5", solution.seconds, Console(file=printed, width=200))
    lines = printed.getvalue().splitlines()
    header = next(line for line in lines if line.startswith("analysis"))
    columns = ("analysis", "kind", "integrator", "end (s)", "steps", "tolerance", "violation", "wall (s)")
    assert " ".join(header.split()) == " ".join(columns)
    table = {line.split()[0]: line.split() for line in lines if line.startswith(("inverse ", "short "))}
    assert table["inverse"][3] == "0.1"
    assert table["short"][4:6] == ["of", "0.1"]
    assert 0.0 < float(table["short"][3]) < 0.1
    assert any(line.startswith("  motor of O: peak ") for line in lines)
    assert "short: ended early (too many steps)" in lines
    titles = {line.split("  ")[0] for line in lines}
    assert {"accuracy", "wall time", "results"} <= titles
    assert ("omitted" in titles) == (keys is PLANAR)
    assert any(line.startswith("wall time") and "links and files" in line for line in lines)
