"""Scene files: what is read, and what is said about each kind of mistake."""

import re

import numpy as np
import pytest

from ffrobot.common.errors import InputError
from ffrobot.scene.load import load_scene

SCENE = """
name = "two_link"
space = "planar"
gravity = [0.0, -9.81]

[[body]]
name = "link1"
link = "link1.toml"

[[body]]
name = "link2"
modal = "link2.h5"

[[body]]
name = "hand"
rigid = { mass = 2, inertia = 0.1, center = [0.1, 0], points = { root = [0.0, 0.0], grip = [0.2, 0.0] } }

[[joint]]
name = "O"
type = "revolute"
between = ["ground", "link1.root"]
at = [0.5, 0]

[[joint]]
name = "A"
type = "revolute"
between = ["link1.tip", "link2.root"]

[[joint]]
name = "W"
type = "weld"
between = ["link2.tip", "hand.root"]

[initial]
angles = { link1 = 0, link2 = 1.0471975511965976 }

[[trajectory]]
name = "tip"
point = "link2.tip"
x = "1.5*cos(pi*t/4)"
y = "sqrt(3)/2*cos(pi*t/4)"

[[pzt]]
body = "link1"
count = 2
length = 0.05
width = 0.025
thickness = 0.75e-3
modulus = 63e9
d31 = 110e-12

[[load]]
pzt = "link1"
voltage = ["10*t", 5]

[[payload]]
point = "hand.grip"
mass = 0.5

[[analysis]]
name = "inverse"
kind = "pcid"
end = 1.0
output_step = 0.001

[[analysis]]
name = "forward"
kind = "forward"
actuation = "inverse"
apply = "joints+pzt"
"""

XY = 'x = "1.5*cos(pi*t/4)"\ny = "sqrt(3)/2*cos(pi*t/4)"'
TIP = 'point = "link2.tip"\n' + XY


@pytest.fixture
def folder(tmp_path):
    for name in ("link1.toml", "link2.h5"):
        (tmp_path / name).touch()
    (tmp_path / "path.csv").write_text("t,x,y\n0,1.5,0.8\n0.5,1.4,0.7\n1,1.3,0.6\n")
    (tmp_path / "value.csv").write_text("t,value\n0,0\n1,1\n")
    return tmp_path


def load(folder, text):
    path = folder / "scene.toml"
    path.write_text(text)
    return load_scene(path)


def test_scene_is_read_key_by_key(folder):
    """Components in 3D: test_planar_spelling.py."""
    scene = load(folder, SCENE)
    assert scene.motors == "section"
    assert [body.name for body in scene.body] == ["link1", "link2", "hand"]
    assert scene.body[0].link == folder / "link1.toml"
    assert scene.body[1].modal == folder / "link2.h5"
    assert scene.joint[0].between == ("ground", "link1.root")
    assert scene.joint[0].motor is None
    assert scene.initial.state == "undeformed"
    assert scene.initial.joints == {"O": 0.0, "A": 1.0471975511965976}
    assert scene.pzt[0].patch_count == 2
    assert scene.payload[0].inertia == (0.0, 0.0, 0.0)
    assert [function(2.0)[:2] for function in scene.load[0].components.values()] == [(20.0, 10.0), (5.0, 0.0)]
    assert scene.trajectory[0].components["x"](0.0)[0] == 1.5
    assert scene.path == folder / "scene.toml"
    assert scene.text == SCENE


def test_forward_takes_over_the_times_of_its_actuation(folder):
    inverse, forward = load(folder, SCENE).analysis
    assert (forward.end, forward.output_step) == (inverse.end, inverse.output_step)
    shorter = load(folder, SCENE.replace('"joints+pzt"', '"joints"\nend = 0.5')).analysis[1]
    assert (shorter.end, shorter.output_step) == (0.5, 0.001)


def test_output_times_are_exact_multiples_that_end_at_the_end(folder):
    times = load(folder, SCENE).analysis[0].times
    assert times.shape == (1001,)
    assert times[-1] == 1.0
    np.testing.assert_array_equal(times[:-1], np.arange(1000) * 0.001)
    static = 'kind = "static"'
    pcid = 'kind = "pcid"\nend = 1.0\noutput_step = 0.001'
    alone = SCENE.replace(pcid, static).split('[[analysis]]\nname = "forward"')[0]
    np.testing.assert_array_equal(load(folder, alone).analysis[0].times, [0.0])


def test_waypoints_replace_expressions(folder):
    text = SCENE.replace(XY, 'waypoints = "path.csv"')
    components = load(folder, text).trajectory[0].components
    assert components["x"](0.5)[0] == pytest.approx(1.4)
    assert list(components) == ["x", "y"]


# What is replaced in the scene, by what, and the start of the line (after "scene.toml: ") that tells about it.
# ruff: noqa: E501 (one line for each mistake)
MISTAKES = [
    ("[0.0, -9.81]", "[0.0, nan]", "gravity[1]: expected a finite number, found ", ""),
    ("[0.0, -9.81]", "[0, 0, -9.81]", "gravity: expected at most 2 entries, found [0, 0, -9.81]", ""),
    ('"planar"', '"plane"', 'space: expected "planar" or "spatial", found "plane"', '"planar"?'),
    ("[initial]", "[[initial]]", "initial: expected a table, found [", ""),
    # bodies
    ('link = "link1.toml"', "", 'body "link1": expected exactly one of the keys "link", "modal", "rigid", found none', ""),
    ("modal =", 'link = "link1.toml"\nmodal =', 'body "link2": expected exactly one of', 'found "link", "modal"'),
    ("mass = 2", "mass = -2", 'body "hand": rigid.mass: expected a number greater than 0, found -2', ""),
    ("inertia = 0.1", "inertia = -0.1", 'body "hand": rigid.inertia: expected a number of at least 0', "-0.1"),
    ("grip =", "grab =", 'payload no. 1: point: expected one of the points "root", "grab" of "hand"', 'found "hand.grip"'),
    ('name = "hand"', 'name = "ha/nd"', 'body "ha/nd": name: expected a name without', 'found "ha/nd"'),
    ('name = "hand"', 'name = "link2"', 'body "link2": expected one body of this name, found 2', ""),
    ('name = "hand"', 'name = "ground"', 'body "ground": name: expected any other name', 'found "ground"'),
    # joints
    ('"weld"', '"wled"', 'joint "W": type: expected "revolute", "prismatic"', 'or "weld", found "wled" (did you mean "weld"?)'),
    ('"weld"', '"screw"', 'joint "W": type: expected "revolute", "prismatic"', 'or "weld", found "screw"'),
    ('"weld"', '"weld"\nmotor = true', 'joint "W": expected no motor', "found motor = true"),
    *(
        ('"weld"', f'"weld"\n{key} = 1.0', f'joint "W": expected the key "{key}" only in revolute', "found it in a weld")
        for key in ("moment_limit", "gear_ratio", "rotor_inertia", "viscous_friction")
    ),
    ('"weld"', '"prismatic"', 'joint "W": expected an axis with a direction', "found none"),
    ('"weld"', '"prismatic"\naxis = [0, 0.0]', 'joint "W": axis: expected a direction', "found [0, 0]"),
    ('"weld"', '"weld"\naxis = [1, 0]', 'joint "W": expected the key "axis" only in prismatic', "found it in a weld"),
    ('"weld"', '"weld"\nat = [1, 0]', 'joint "W": expected the key "at" only in joints to "ground"', "found it between"),
    ('"link1.root"', '"link1"', 'joint "O": between[1]: expected "ground" or a point as "BODY.POINT", found "link1"', ""),
    ('"link1.root"', '"ground"', 'joint "O": expected at most one "ground"', "found two"),
    ('"link2.root"', '"link1.root"', 'joint "A": expected two bodies in between, found "link1" twice', ""),
    ('"link2.root"', '"lnk2.root"', 'joint "A": between[1]: expected one of the bodies "link1", ', '"link2"?'),
    *(
        ("at = [0.5, 0]", f"{keys}\nat = [0.5, 0]", 'joint "O": ', says)
        for keys, says in (
            ("stiffness = 0.0", "greater than 0"),
            ("damping = 1.0", "only with stiffness"),
            ("stiffness = 1.0", "rotor_inertia above 0"),
            ("rotor_inertia = -1.0", "a number of at least 0"),
            ("gear_ratio = 0.0", "greater than 0"),
            ("friction_speed = 0.1", "only with coulomb_friction"),
            ("rotor_inertia = 1e-3\nstiffness = { values = [1.0, 2.0] }", "one value more than torques"),
            ("stiffness = { values = [1.0, 2.0, 3.0], torques = [2.0, 1.0] }", "rising order"),
        )
    ),
    ('"weld"', '"weld"\nstiffness = 1.0', 'joint "W": ', "in a weld"),
    # initial
    ("link2 = 1.04", "link3 = 1.04", 'initial.angles: expected one of the bodies "link1", "link2", "hand"', 'found "link3"'),
    ("link1 = 0,", 'link1 = "t",', 'initial.angles.link1: expected a number or an expression without t', 'found "t"'),
    ("angles = { link1 = 0,", "joints = { Q = 0.1 }\nangles = { link1 = 0,", 'initial.joints: expected a joint ("O"', 'found "Q"'),
    ("angles = { link1 = 0,", "joints = { A = 0.1 }\nangles = { link1 = 0,", "initial.joints.A: expected no guess where initial.angles has", '"link1", "link2"'),
    # trajectories
    ("1.5*cos(", "1.5*csh(", 'trajectory "tip": x: expected an expression in t, found', "at character 5 (did you mean"),
    ("1.5*cos(pi*t/4)", "log(0.25 - t)", 'trajectory "tip": x: expected a finite value', "found none at t = 0.25 s"),
    ("1.5*cos(pi*t/4)", "sqrt(t)", 'trajectory "tip": x: expected a finite velocity', "found none at t = 0 s"),
    ('pzt = "link1"\nvoltage = ["10*t", 5]', 'joint = "O"\nmoment = "1/(t - 0.25)"', "load no. 1: moment: expected a finite value", "at t = 0.25 s"),
    ('point = "link2.tip"', 'point = "link2.tip"\njoint = "O"', 'trajectory "tip": expected exactly one', '"point", "joint"'),
    ('point = "link2.tip"', 'joint = "O"', 'trajectory "tip": expected the keys "value", "waypoints", "via" with "joint"', '"x", "y"'),
    (TIP, 'joint = "W"\nvalue = "t"', 'trajectory "tip": joint: expected a joint that moves', 'found "W", a weld'),
    (TIP, 'joint = "B"\nvalue = "t"', 'trajectory "tip": joint: expected a joint ("O", "A"', '"B"'),
    ('x = "1.5*cos(pi*t/4)"', 'waypoints = "path.csv"', 'trajectory "tip": expected either waypoints, via or expr', '"y", "way'),
    (XY, "waypoints = [[0.5, 0.5], [1.0, 0.5]]", 'trajectory "tip": waypoints: expected the name of a CSV file in quotes, or', "places in via = ["),
    (XY, 'waypoints = "value.csv"', 'trajectory "tip": expected waypoints with the header t,x,y', 'found "t,value"'),
    # patches and loads
    ("count = 2", "centers = []", 'pzt "link1": centers: expected at least one entry, found none', ""),
    ("d31 = 110e-12", "d31 = 0", 'pzt "link1": expected a d31 other than 0, found 0', ""),
    ('pzt = "link1"', 'pzt = "link2"', 'load no. 1: pzt: expected one of the layouts "link1", found "link2"', ""),
    ('["10*t", 5]', '["10*t", "v"]', "load no. 1: voltage[1]: expected an expression in t, found 'v'", "unknown name"),
    ('pzt = "link1"', 'joint = "O"', 'load no. 1: expected the keys "moment" with "joint", found "voltage"', ""),
    ("mass = 0.5", "mass = 0.5\ninertia = [1, 1, 1]", "payload no. 1: inertia: expected a number, found [1, 1, 1]", ""),
    ('voltage = ["10*t", 5]', 'mz = "t"', "load no. 1: mz: expected one of the keys point, joint, pzt, x, y, moment, ", ""),
    ("mass = 0.5", "", "payload no. 1: mass: expected a value, since this key is required, found none", ""),
    # analyses
    ("end = 1.0", "end = 1e9", 'analysis "inverse": expected at most 10000000 outputs, found', ""),
    ("end = 1.0", "", 'analysis "inverse": expected the key "end" in kind = "pcid", found none', ""),
    ("end = 1.0", "end = 1.0\nspectral_radius = 0.5", 'analysis "inverse": expected the key "spectral_radius" only with', ""),
    ("end = 1.0", 'end = 1.0\nintegrator = "generalized-alpha"', 'analysis "forward": actuation: expected an analysis', "reproducible steps"),
    ("end = 1.0", 'end = 1.0\nshape = "zero"', 'analysis "inverse": expected the key "shape" only in kind = "fcid"', "found"),
    ('kind = "pcid"', 'kind = "fcid"', 'analysis "inverse": expected the key "shape" in kind = "fcid"', "found none"),
    ("end = 1.0", "end = 1.0\nfactor = 0.5", 'analysis "inverse": expected the key "factor" only in kind = "motors-only"', ""),
    ('kind = "pcid"', 'kind = "motors-only"\nfactor = 0.5', 'analysis "inverse": expected the key "factor" only with', "tip"),
    ('kind = "pcid"', 'kind = "motors-only"\npre_actuation = -1', 'analysis "inverse": pre_actuation: expected a number', ""),
    ('kind = "pcid"', 'kind = "motors-only"', 'analysis "forward": apply: expected "joints" with', "joints+pzt"),
    ('actuation = "inverse"', 'actuation = "invers"', 'analysis "forward": actuation: expected an earlier', '"inverse"?'),
    ('kind = "pcid"', 'kind = "forward"', 'analysis "forward": actuation: expected an analysis of kind "pcid", "fcid"', "motors-only"),
    ('apply = "joints+pzt"', "", 'analysis "forward": expected the keys "actuation" and "apply" together, found only', ""),
    ('apply = "joints+pzt"', 'apply = "joints"\nend = 2.0', 'analysis "forward": end: expected at most 1', "found 2"),
    ('name = "forward"', 'name = "inverse"', 'analysis "inverse": expected one analysis of this name, found 2', ""),
]  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "start", "says"), MISTAKES, ids=[f"{old} → {new}" for old, new, _, _ in MISTAKES]
)
def test_mistake_is_named(folder, old, new, start, says):
    assert old in SCENE
    with pytest.raises(InputError) as caught:
        load(folder, SCENE.replace(old, new, 1))
    lines = str(caught.value).splitlines()
    prefix = f"{folder / 'scene.toml'}: "
    assert all(line.startswith(prefix) for line in lines)
    assert any(line.startswith(prefix + start) and says in line for line in lines), str(caught.value)


POINTS = '[[actuation_points]]\nbody = "link1"\ntransverse = [0.5]\n\n[[payload]]'
MASSES = '[[pzt]]\ndensity = 7500\nstructural = ["mass"]'


@pytest.mark.parametrize("value", ["true", '"auto"'])
@pytest.mark.parametrize(
    ("old", "new", "says"),
    [("[[payload]]", POINTS, "false with [[actuation_points]]"),
     ("[[pzt]]", MASSES, 'no patches with structural = ["mass"')],
)  # fmt: skip
def test_stiffening_knows_no_loads_between_interfaces(folder, value, old, new, says):
    text = SCENE.replace(old, new, 1)
    load(folder, text)
    with pytest.raises(InputError, match="geometric_stiffening: expected " + re.escape(says)):
        load(folder, f"geometric_stiffening = {value}\n{text}")


VIA = "via = [[1.5, 0.8], [1.2, 0.8], [1.2, 1.0]]"
MOTION_MISTAKES = [
    (f"{VIA}", 'expected either limits ("speed", "acceleration", "jerk") or a "duration" with "via", found neither'),
    (f"{VIA}\nspeed = 1.0\nduration = 1.0", "found both"),
    (f"{VIA}\nspeed = 1.0\nhold = [1.0, 1.0]", 'expected 1 numbers in "hold", found 2'),
    (f"{VIA}\nduration = [1.0]", 'expected 2 numbers in "duration", found 1'),
    (f'{VIA}\nspeed = 1.0\nprofile = "s-curve"', 'expected "acceleration" or "jerk"'),
    (f'{VIA}\nacceleration = 1.0\njerk = 9.0\nprofile = "trapezoid"', 'expected no "jerk"'),
    (f'{VIA}\nduration = 1.0\nprofile = "spline"', 'only with "waypoints"'),
    ("via = [1.0, 2.0]\nduration = 1.0", "expected places [x, y] in via, found [1.0, 2.0]"),
    ("via = [[1.0, 2.0], [1.0, 2.0]]\nduration = 1.0", "expected places in via that differ"),
    ('via = [["t", 2.0], [1.0, 2.0]]\nduration = 1.0', "expression without t"),
    (f'{VIA}\nx = "t"\nduration = 1.0', 'expected either waypoints, via or expressions, found "x", "via"'),
    ('x = "t"\nspeed = 1.0', 'expected "speed" only with "via" or "waypoints"'),
    (f'{VIA}\nspeed = 1e-25\nacceleration = 1e25\nprofile = "s-curve"', "that fit each other in size"),
    (f"{VIA}\nduration = 1.0\nfastest = true\nstretch = 2.0", 'expected one of the keys "fastest" and "stretch"'),
    (f'{VIA}\nduration = 1.0\nshaper = {{ kind = "zv", frequency = 0.0 }}', "shaper.frequency"),
    (f'{VIA}\nduration = 1.0\nshaper = {{ kind = "zv", frequency = 1.0, modes = 2 }}', '"frequency" and "modes"'),
    (f'{VIA}\nduration = 1.0\nshaper = {{ kind = "zv", damping_ratio = [0.1, 0.2] }}', "one value, or 1, found 2"),
]


@pytest.mark.parametrize(("keys", "says"), MOTION_MISTAKES, ids=range(len(MOTION_MISTAKES)))
def test_keys_of_motions_that_do_not_fit(folder, keys, says):
    text = SCENE.replace(XY, keys)
    with pytest.raises(InputError, match=re.escape(says)):
        load(folder, text)
