"""Notes on what is allowed but looks like another unit or a slip; and none on what is right."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from beam_links import beam_link, tube
from tables_3d import ORIGIN, joint, revolute, rigid
from tables_3d import scene as spatial

import ffrobot as program
from ffrobot.fe_models.link_file import read_link
from ffrobot.fe_models.link_source import LinkTable
from ffrobot.fe_models.remarks import remarks_on_link
from ffrobot.scene.plausibility import remarks, remarks_on_memory

CASES = Path(__file__).parents[2] / "cases"
BAR = {"mass": 1.0, "inertia": 0.1, "center": [0.5, 0.0], "points": {"root": [0.0, 0.0], "tip": [1.0, 0.0]}}
LINK = beam_link(0.6, tube(0.02, 0.016), 4, nu=None, name="arm", modes={"count": 1, "family": "in-plane-bending"})


def check(found, expected):
    """One remark with the expected text, or none where that is None."""
    found = list(found)
    assert len(found) == (expected is not None)
    assert expected is None or expected in found[0]


def arm(end=1.0, body=BAR, payload=(), tool=(), joint=(), gravity=-9.81, **path):
    return program.make_scene(
        name="arm",
        gravity=[0.0, gravity],
        body=[{"name": "arm", "rigid": body}],
        payload=payload,
        tool=[{"name": "pen", "point": "arm.tip", **keys} for keys in tool],
        joint=[{"name": "hub", "type": "revolute", "between": ["ground", "arm.root"], **dict(joint)}],
        trajectory=[{"name": "turn", "joint": "hub", **path}],
        analysis=[{"name": "inverse", "kind": "pcid", "end": end, "output_step": 0.1}],
    )


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ({"value": "-45"}, "reaches 45 rad, 7.16 turns"),
        ({"value": "45*(1 - cos(pi*t))"}, "reaches 90 rad"),
        ({"via": [0.0, 90.0], "duration": 1.0}, "reaches 90 rad"),
        ({"via": [0.0, 1.0], "duration": 2.0}, "ends at 2 s, the run at 1 s: the rest of it is not followed"),
        ({"via": [0.0, 1.0], "duration": 2.0, "start": 1.5}, "begins at 1.5 s, when the run is over (1 s)"),
        ({"via": [0.0, 1.0], "duration": 0.2}, "ends at 0.2 s, and rests for the other 0.8 s"),
        ({"via": [0.0, 1.0], "duration": 0.2, "shaper": {"kind": "none"}}, "ends at 0.2 s, and rests"),
        ({"via": [0.0, 1.0], "duration": 0.2, "shaper": {"kind": "zv"}}, None),  # later: the run finds it
        ({"value": "t", "body": {**BAR, "center": [500.0, 0.0]}}, "is 500 m long: units are SI; is this in mm?"),
        ({"value": "t", "body": {**BAR, "mass": 2e6}}, "a mass of 2e+06 kg: units are SI; is it in g?"),
        ({"value": "t", "payload": [{"point": "arm.tip", "mass": 500.0}]}, "500 kg on a robot of 1 kg"),
        ({"value": "t", "payload": [{"point": "arm.tip", "mass": 50.0}]}, None),
        ({"value": "t", "tool": [{"at": [120.0, 0.0]}]}, 'tool "pen" is 120 m long'),
        ({"value": "t", "tool": [{"angle": 45}]}, 'tool "pen" is turned by 45 rad'),
        ({"value": "t", "tool": [{"at": [0.12, 0.0], "angle": "45*deg"}]}, None),
        ({"value": "t", "payload": [{"point": "arm.tip", "mass": 0.1, "center": [70.0, 0]}]}, "center is 70 m long"),
        ({"value": "t", "payload": [{"point": "arm.tip", "mass": 0.1, "inertia": 9e3}]}, "radius of gyration is 300 m"),
        ({"value": "t", "body": {**BAR, "inertia": 1e4}}, "radius of gyration is 100 m"),
        ({"value": "t", "joint": {"position_limit": [-180, 180]}}, "a position_limit of -180 … 180 rad is many turns"),
        ({"value": "t", "joint": {"position_limit": ["-180*deg", "180*deg"]}}, None),
        ({"value": "t", "joint": {"rotor_inertia": 140.0}}, "a rotor_inertia of 140 kg m²"),
        ({"value": "t", "joint": {"at": [300.0, 0.0]}}, 'joint "hub" is 300 m from the origin'),
        ({"value": "t", "joint": {"type": "prismatic", "axis": [1.0, 0.0]}}, None),
        (
            {"value": "300*t**3", "joint": {"type": "prismatic", "axis": [1.0, 0.0]}},
            'trajectory "turn" is 300 m',
        ),
        ({"value": "t", "gravity": -9810.0}, "gravity of 9810 m/s²: units are SI; is it in mm/s²?"),
        ({"value": "45*pi/180*t"}, None),
        ({"value": "-45*deg"}, None),
        ({"value": "45*deg*(1 - cos(pi*t))"}, None),
        ({"value": "150*t"}, None),  # a crank that turns on
        ({"value": "2*pi*(10*t**3 - 15*t**4 + 6*t**5)"}, None),  # once around
        ({"via": [0.0, 1.0], "duration": 1.0}, None),
    ],
)
def test_scenes(path, expected):
    check(remarks(arm(**path)), expected)


@pytest.mark.parametrize(
    ("law", "told"),
    [("35*(2*t)**4 - 84*(2*t)**5 + 70*(2*t)**6 - 20*(2*t)**7", None),  # the remedy that the message names
     ("10*(2*t)**3 - 15*(2*t)**4 + 6*(2*t)**5", "the path's jerk jumps where it ends"),
     ("3*(2*t)**2 - 2*(2*t)**3", "the path's acceleration jumps where it ends")],
)  # fmt: skip
def test_rough_ends_of_a_tracked_path_are_told_before_the_search(law, told):
    text = (CASES / "two_link_tracking" / "scene.toml").read_text(encoding="utf-8")
    keys = tomllib.loads(text.replace("560*t**4 - 2688*t**5 + 4480*t**6 - 2560*t**7", law))
    found = list(remarks(program.make_scene(folder=CASES / "two_link_tracking", **keys)))
    assert [one for one in found if "jumps" in one] == [one for one in found if told and told in one]
    assert bool(told) == any("Smoother ends" in one for one in found)


@pytest.mark.parametrize(("yaw", "turns"), [(3.2, True), (3.1, False), (-3.1, False)])
def test_poses_more_than_half_a_turn_apart(yaw, turns):
    """Of 3.2 rad to the left the shorter way is the one to the right: the section ends where it should, turned back."""
    poses = [[0.0] * 6, [0.1] + [0.0] * 4 + [yaw]]
    path = {"name": "pose", "point": "hand.root", "via": poses, "duration": 1.0}
    run = {"name": "inverse", "kind": "pcid", "end": 1.0, "output_step": 0.5}
    air = joint("air", "free", "ground", "hand.root")
    scene = program.make_scene(**spatial([rigid("hand")], [air], run, gravity=ORIGIN, trajectory=[path]))
    found = [text for text in remarks(scene) if "turns the shorter way" in text]
    assert len(found) == turns
    _, _, _, half = program.solve(scene)["inverse/points/hand.root/quaternion"][1]
    assert np.sign(half) == (-1 if turns else np.sign(yaw))


def test_waypoints_before_and_after_the_run(tmp_path):
    for times, expected in (((-2.0, -1.0), "before the run begins"), ((-1.0, 1.0), "what is before 0 s"), ((0, 1), "")):
        rows = [f"{t},{value}" for t, value in zip(np.linspace(*times, 4), (0, 0.1, 0.2, 0.3), strict=True)]
        (tmp_path / "path.csv").write_text("t,value\n" + "\n".join(rows) + "\n", encoding="utf-8")
        found = list(remarks(arm(waypoints=str(tmp_path / "path.csv"))))
        assert expected in " ".join(found)
        assert bool(found) == bool(expected)


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({}, None),
        ({"material": {"youngs_modulus": 70e3, "density": 2700.0}}, "is it in MPa or GPa?"),
        ({"material": {"youngs_modulus": 210.0, "density": 7850.0}}, "is it in MPa or GPa?"),
        ({"material": {"youngs_modulus": 70e9, "density": 2.7e-9}}, "is it in g/cm³ or t/mm³?"),
        ({"geometry": {**LINK["geometry"], "length": 600.0}}, "arm is 600 m long: units are SI; is this in mm?"),
        ({"material": {"youngs_modulus": 70e9, "density": 2.7}}, "is density in g/cm³?"),
        ({"geometry": {**LINK["geometry"], "section": {"shape": "circle", "diameter": 20.0}}}, "is it in mm?"),
        (
            {"geometry": {**LINK["geometry"], "length": 40.0, "section": {"shape": "circle", "diameter": 2e-5}}},
            "Hz as a cantilever",
        ),
        ({"damping": {"ratio": 2.0}}, "a damping ratio of 2 is above critical damping"),
        ({"damping": {"ratio": 0.02}}, None),
        (
            {
                "geometry": {**LINK["geometry"], "kind": "solid"},
                "mesh": {"order": 1},
                "material": {"youngs_modulus": 70e9, "density": 2700.0, "poissons_ratio": 0.33},
            },
            "cells of order 1 bend too stiffly",
        ),
        ({"material": {"youngs_modulus": 1e6, "density": 1100.0}}, None),  # silicone rubber
        ({"material": {"youngs_modulus": 1050e9, "density": 3515.0}}, None),  # diamond
    ],
)
def test_links(keys, expected, tmp_path):
    check(remarks_on_link(read_link(LinkTable({**LINK, **keys}, tmp_path / "arm.toml")), "arm"), expected)


PATCH = {"body": "arm", "count": 2, "length": 0.05, "thickness": 3e-4, "width": 0.01, "modulus": 63e9, "d31": 110e-12}


@pytest.mark.parametrize(
    ("patch", "interface", "joints", "expected"),
    [
        ({"width": 0.06}, [], 0.0, None),  # around a tube
        ({"thickness": 0.3}, [], 0.0, "patches 0.3 m thick on a link of 0.02 m"),
        ({"modulus": 63.0}, [], 0.0, "a modulus of 63 Pa: units are SI; is it in GPa?"),
        ({"d31": 110.0}, [], 0.0, "a d31 of 110 m/V: units are SI; is it in pm/V?"),
        ({"limit": 200.0}, [], 0.0, "load no. 1: patch 2 gets 300 V, beyond its limit of 200 V"),
        ({"limit": [100.0, 400.0]}, [], 0.0, None),
        ({"amplifier": {"delay": [0.1, 2.0]}}, [], 0.0, "a delay of 2 s, the run ends at 1 s: is it in ms?"),
        ({}, [1.0, 1.0, 2.5], 0.0, 'interface "lump": no body has the moments of inertia 1, 1, 2.5 kg m²'),
        ({}, [1.0, 1.0, 2.0], 0.0, None),
        ({}, [], 90.0, 'joint "hub" begins at 90 rad'),
        ({}, [], np.pi, None),
    ],
)
def test_flexible_scenes_in_3d(patch, interface, joints, expected):
    lump = [{"name": "lump", "position": 0.3, "mass": 0.1, "inertia": interface}] if interface else []
    tables = spatial(
        [{"name": "arm", "link": LINK | {"interface": lump}}],
        [revolute("hub", "ground", "arm.root")],
        {"name": "inverse", "kind": "pcid", "end": 1.0, "output_step": 0.1},
        pzt=[PATCH | patch],
        load=[{"pzt": "arm", "voltage": ["100*sin(t)", "300*t"]}],
        initial={"joints": {"hub": joints}},
        trajectory=[{"name": "turn", "joint": "hub", "value": "t"}],
    )
    check(remarks(program.make_scene(**tables)), expected)


@pytest.mark.parametrize(
    ("second", "told"),
    [
        ({}, True),
        ({"centers": [0.34]}, True),
        ({"centers": [0.40]}, False),
        ({"face": "-y"}, False),
        ({"face": None}, True),
        ({"face": "+z", "bends": "out-of-plane"}, False),
        ({"width": 0.004}, False),
    ],
)
def test_patches_on_each_other(second, told):
    first = PATCH | {"centers": [0.3], "length": 0.1, "width": 0.014, "face": "+y", "name": "first"}
    first = {key: value for key, value in first.items() if key != "count"}
    link = LINK | {"geometry": LINK["geometry"] | {"section": {"shape": "rectangle", "height": 0.02, "width": 0.02}}}
    other = {key: value for key, value in (first | {"name": "second"} | second).items() if value is not None}
    hub, still = joint("hub", "weld", "ground", "arm.root"), {"name": "still", "kind": "static"}
    tables = spatial([{"name": "arm", "link": link}], [hub], still, gravity=ORIGIN, pzt=[first, other])
    found = remarks(program.make_scene(**tables))
    assert any('"first", "second": patches on one place' in line for line in found) is told


def test_outputs_that_do_not_fit_into_memory():
    """A link of four modes in 3D took 0.55 GB for 1e5 outputs, and over 12 GB for 1e7."""
    (remark,) = remarks_on_memory(10_000_001, 1, 16e9, "long")
    assert "10000001 outputs may take 50 GB of memory, of 16 GB" in remark
    assert not list(remarks_on_memory(100_001, 1, 16e9, "short"))


def test_cases_have_no_remarks_on_units():
    found = [line for path in CASES.glob("*/scene*.toml") for line in remarks(program.load_scene(path))]
    assert not [line for line in found if "?" in line]


def test_a_posture_that_nobody_chose_is_told(two_link_copy, ffrobot):
    """Without a guess the scene may start on another elbow: its angles are printed, as results have them."""
    folder = two_link_copy({"scene.toml": {"end = 1.0": "end = 0.004"}})
    assert "no guess in [initial]" not in ffrobot("solve", "scene.toml", cwd=folder).stdout
    text = (folder / "scene.toml").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith(("angles", "initial"))]
    (folder / "scene.toml").write_text("\n".join(lines), encoding="utf-8")
    done = ffrobot("solve", "scene.toml", cwd=folder)
    (line,) = (line for line in done.stdout.splitlines() if "no guess in [initial]" in line)
    with program.Results(folder / "scene.results.h5") as results:
        for joint in ("O", "A"):
            angle = np.degrees(results[f"inverse/joints/{joint}/coordinate"][0])
            assert f"{joint} {round(angle, 6) + 0.0:.4g}°" in line
    assert f'branch = {{ A = "{"down" if angle > 0.0 else "up"}" }}' in line


def test_blends_that_take_longer_than_stops_are_told():
    """Both segments go the same way: while they overlap, speeds add up to twice the limit, and all get slower."""
    motion = {"via": [7.0, -2.0, -7.0], "profile": "trapezoid", "speed": 1.0, "acceleration": 4.0}
    stops, blended = (program.solve(arm(end=30.0, blend=blend, **motion)) for blend in (0.0, 0.1))
    assert not [text for text in stops.verdict["inverse"].warnings if "blend" in text]
    (text,) = [text for text in blended.verdict["inverse"].warnings if "blend" in text]
    ends = [results.attributes("inverse/trajectories/turn")["end"] for results in (blended, stops)]
    assert ends[0] > ends[1]
    assert f"blend = 0.1 takes until t = {ends[0]:.4g} s, stops at all places {ends[1]:.4g} s" in text
