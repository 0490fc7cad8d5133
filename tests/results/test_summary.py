"""The summary of a solve: one for planar and 3D scenes, of at most fifteen lines."""

import re
from io import StringIO
from itertools import takewhile
from pathlib import Path

import pytest
from reference_scenes import NIGHTLY
from rich.console import Console
from tables_3d import pin, planar

from ffrobot.present.details import print_details
from ffrobot.present.lines import folded
from ffrobot.present.summary import LINES, fitted, summary_lines
from ffrobot.results.file import Results
from ffrobot.results.judging import end_of
from ffrobot.results.write import results_image
from ffrobot.run.solve import solve_scene
from ffrobot.run.watcher import Watcher
from ffrobot.scene.load import make_scene

ROD = {"mass": 2.0, "inertia": 0.2, "center": [0.35, 0.0], "points": {"root": [0.0, 0.0], "tip": [0.7, 0.0]}}
PLANAR = planar(
    [{"name": name, "rigid": ROD} for name in "ab"],
    [pin("O", "ground", "a.root"), pin("A", "a.tip", "b.root")],
    {"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.01, "tolerance": 1e-5},
    {"name": "short", "kind": "pcid", "end": 0.1, "output_step": 0.01, "max_steps": 1, "integrator": "dopri5"},
    gravity=(0.0, 0.0),
    trajectory=[{"name": "tip", "point": "b.tip", "x": "0.9 + 0.1*t", "y": "0.5"}],
    initial={"joints": {"O": 0.3, "A": 0.9}},
)
IN_3D = {"inertia": [0.01, 0.2, 0.2], "center": [0.35, 0.0, 0.0]}
SPACIOUS = ROD | IN_3D | {"points": {name: [*at, 0.0] for name, at in ROD["points"].items()}}
SPATIAL = PLANAR | {
    "space": "spatial",
    "gravity": [0.0, 0.0, 0.0],
    "body": [{"name": name, "rigid": SPACIOUS} for name in "ab"],
    "joint": [joint | {"axis": [0.0, 0.0, 1.0]} for joint in PLANAR["joint"]],
}


def test_a_replay_ends_with_its_actuation():
    static, inverse, replay = {"name": "rest"}, {"name": "inverse", "end": 0.4}, {"name": "replay"}
    scene = {"analysis": [static, inverse, replay | {"actuation": "inverse"}]}
    assert [end_of(scene, name) for name in ("rest", "inverse", "replay")] == [0.0, 0.4, 0.4]


def verdict_of(scene):
    return Results.from_image(results_image(solve_scene(scene)), Path("x.h5")).verdict


def verdict(scene):
    return verdict_of(scene).analyses[0]


@pytest.mark.parametrize("keys", [PLANAR, SPATIAL], ids=["planar", "3D"])
def test_planar_and_3d_scenes_have_the_same_details(keys, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", width := "40")  # narrower than the table, whose words are whole nevertheless
    solution = solve_scene(make_scene(**keys), Watcher())
    results, printed = Results.from_image(results_image(solution), tmp_path / "x.h5"), StringIO()
    print_details(solution, results, Console(file=printed, width=int(width)))
    lines = printed.getvalue().splitlines()
    header = next(line for line in lines if line.startswith("analysis"))
    assert " ".join(header.split()) == "analysis kind integrator end (s) steps evaluations tolerance violation wall (s)"
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


TEXTS = ("warning ", "to try ", "remark ", "note ", "accuracy ")
CASES = sorted(path.parent.name for path in (Path(__file__).parents[2] / "cases").glob("*/scene.toml"))


@pytest.mark.parametrize("case", [case for case in CASES if case not in NIGHTLY])
def test_every_case_has_a_summary_of_one_screen(case, solved):
    """With the verdicts of all analyses, of all motors, and warnings, or the number of those that had no room."""
    with Results(solved(case).folder / "scene.results.h5") as results:
        verdict = results.verdict
    for width in (120, 80):
        lines = summary_lines(verdict, ["a note"], 30 * "accuracy ", "scene.results.h5", width)
        assert len(lines) <= LINES == 15
        assert max(map(len, lines)) <= width
        cut = [line for line in lines if line.endswith("…")]
        assert not [line for line in cut if line.startswith((*TEXTS, " "))]  # advice and warnings are whole, or counted
        assert width < 120 or not any(line.startswith(f"{one.name} ") for line in cut for one in verdict.analyses)
    shown = sum(line.startswith(one.name) for one in verdict.analyses for line in lines[1 : 1 + len(verdict.analyses)])
    left_out = sum(int(line.split()[0]) for line in lines if line.endswith("more: --verbose"))
    judged = [one for one in verdict.analyses if one.feasible is not None]
    assert shown + left_out >= len(verdict.analyses)
    for motor in {name for one in judged for name in one.motors}:
        assert any(line.startswith(f"{motor} ") for line in lines)
    if any(one.warnings for one in verdict.analyses):
        assert any(line.startswith("warning") for line in lines)


@pytest.mark.parametrize("room", [1, 2, 3, 5, 9])
def test_texts_are_whole_or_counted(room):
    """The first warning and the first advice go before other warnings; a text alone that has no room says so."""
    label = [f"warning    {'many words ' * 12}no. {k}" for k in range(3)]
    texts = [*label, "to try     a remedy", "note       a fact"]
    assert fitted(short := ["vibration  of a point", *texts[3:]], 3 + room, 60) == short
    lines = fitted(texts, room, 60)
    assert 0 < len(lines) <= room
    assert max(map(len, lines)) <= 60
    printed = " ".join(" ".join(lines).split())
    whole = [text for text in texts if " ".join(text.split()) in printed]
    left = re.search(r"\(\+(\d) more: --verbose\)$", printed)
    assert lines[0].startswith("warning")
    assert "(in full: --verbose)" in printed or len(whole) + int(left[1] if left else 0) == len(texts)
    assert room < 3 or texts[3] in whole
    assert room < 5 or texts[0] in whole


def test_lines_that_differ_in_a_name_are_one():
    lines = [text for name in "ab" for text in (f'trajectory "{name}" ends at 1 s', f"{name}: zv shaper for 5 Hz")]
    others = ['analysis "x": trajectory "c" ends at 2 s', "gravity of 1000 m/s²: is it in mm/s²?"]
    together = ['trajectory "a", "b" ends at 1 s', "a, b: zv shaper for 5 Hz"]
    assert list(folded([*lines, *others])) == [*together, *others]


def many(count, motors):
    """A robot with so many joints, whose path is given for each, so many times."""
    joint = {"type": "revolute", "axis": [0.0, 0.0, 1.0], "moment_limit": 50.0}
    names = [f"b{k}" for k in range(motors)]
    return make_scene(
        name="many", space="spatial", gravity=[0.0, -9.81, 0.0],
        body=[{"name": name, "rigid": SPACIOUS} for name in names],
        joint=[joint | {"name": f"j{k}", "between": [f"{names[k - 1]}.tip" if k else "ground", f"{name}.root"]}
               for k, name in enumerate(names)],
        trajectory=[{"name": f"p{k}", "joint": f"j{k}", "value": "0.1*t"} for k in range(motors)],
        analysis=[{"name": f"a{k}", "kind": "pcid", "end": 0.02, "output_step": 0.01} for k in range(count)],
    )  # fmt: skip


@pytest.mark.parametrize(("count", "motors"), [(1, 3), (2, 3), (1, 12), (9, 12), (30, 1)])
def test_rows_are_left_out_and_counted(count, motors):
    """Peaks of motors of each analysis where there is room, else of the analysis that asks most; over limits."""
    verdict = verdict_of(many(count, motors))
    lines = summary_lines(verdict, (), "known", "x.h5", 120)
    assert len(lines) <= LINES
    rows = [line.split() for line in lines]
    begin = next(k for k, row in enumerate(rows) if row[0] == "motor")
    of_motors = list(takewhile(lambda row: re.fullmatch(r"j\d+", row[0]), rows[begin + 1 :]))
    if count * motors <= 6:
        assert len(of_motors) == count * motors
    for name, peak, _of, limit, *_, share, sign, analysis in of_motors:
        motor = verdict[analysis].motors[name]
        assert float(peak) == pytest.approx(motor.moment, rel=1e-3)
        assert float(limit) == motor.moment_limit
        assert float(share) == pytest.approx({"%": 100, "×": 1}[sign] * motor.moment / 50.0, rel=0.01)


def weak(limit, load=0.0, path="0", **analysis):
    """A horizontal rod whose motor carries weight and a load at the tip."""
    about = {"name": "rest", "kind": "static"} | analysis
    keys = {
        "trajectory": [{"name": "path", "joint": "O", "value": path}],
        "load": [{"point": "a.tip", "y": str(-load)}],
    }
    body, joint = {"name": "a", "rigid": ROD}, pin("O", "ground", "a.root", moment_limit=limit)
    return make_scene(**planar([body], [joint], about, gravity=(0.0, -10.0), **keys))


def test_robots_at_rest_are_told_no_slower_path():
    """A weight of 20 N at 0.35 m and 10 N at 0.7 m: 14 N·m. Each remedy that the advice names makes it feasible."""
    at_rest = verdict(weak(10.0, 10.0))
    assert at_rest.advice == ("less load, or another motor or gear for O",)
    assert not at_rest.feasible
    assert verdict(weak(15.0, 10.0)).feasible
    assert verdict(weak(10.0, 1.0)).feasible
    run = {"kind": "pcid", "end": 0.1, "output_step": 0.01}
    assert verdict(weak(10.0, 10.0, **run)).advice == at_rest.advice
    (text,) = verdict(weak(15.0, 10.0, path="10*t**2", **run)).advice
    assert text.startswith("a slower path")
    assert verdict(weak(15.0, 10.0, path="0.1*t**2", **run)).feasible


def test_torques_at_rest_along_the_path_decide_whether_a_slower_path_helps():
    """The same rod, lifted from hanging to horizontal, where it takes m g L/2 + F L = 14 N·m at rest."""

    def lifted(limit, load, duration):
        rise = f"-pi/2*(1 - (10*(t/{duration})**3 - 15*(t/{duration})**4 + 6*(t/{duration})**5))"
        return verdict(weak(limit, load, rise, kind="pcid", end=duration, output_step=duration / 100))

    heavy = lifted(13.9, 10.0, 0.5)
    assert heavy.motors["O"].static_moment == pytest.approx(14.0, rel=1e-9)
    assert heavy.advice[-1].startswith("less load, or another motor or gear for O, whose torques at rest")
    assert not any("slower" in text for text in heavy.advice)
    assert not lifted(13.9, 10.0, 20.0).feasible
    assert lifted(13.9, 9.8, 20.0).feasible
    fast = lifted(14.1, 10.0, 0.5)
    assert fast.motors["O"].static_moment == pytest.approx(14.0, rel=1e-9)
    assert fast.advice[-1].startswith("a slower path")
    assert lifted(14.1, 10.0, 20.0).feasible
