"""Maps over the workspace: closed forms, single runs of the same poses, branches, limits, resuming."""

import re
from io import StringIO

import h5py
import numpy as np
import pytest
import tomli_w
from beam_links import beam_link, rectangle
from rich.console import Console
from tables_3d import ORIGIN, Y, Z, joint, pin, planar, revolute, rigid, scene

from ffrobot import solve
from ffrobot.batch.batch import batch_of
from ffrobot.common.errors import InputError, SolveError
from ffrobot.map import pose_map
from ffrobot.map.map_file import print_map, quantities, write_map
from ffrobot.map.pose_map import make_map, plan_map
from ffrobot.mbs.linear.joint_conditions import free_coordinates
from ffrobot.mbs.linear.poses import PoseEvaluator
from ffrobot.milling.process import read_milling
from ffrobot.pictures.studies.pose_map import draw_map
from ffrobot.run.solve import prepare_scene
from ffrobot.run.watcher import Watcher

ARM = """name = "arm"
space = "planar"
gravity = [0.0, -9.81]
body = [{ name = "upper", link = "upper.toml" }, { name = "fore", link = "fore.toml" }]
initial = { joints = { shoulder = 0.3, elbow = 0.8 } }
analysis = [{ name = "rest", kind = "static" }]
[[joint]]
name = "shoulder"
type = "revolute"
between = ["ground", "upper.root"]
gear_ratio = 100.0
rotor_inertia = 6e-5
stiffness = 3000.0
moment_limit = 20.0
[[joint]]
name = "elbow"
type = "revolute"
between = ["upper.tip", "fore.root"]
position_limit = [-2.5, 2.5]
moment_limit = 10.0
"""


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    folder = tmp_path_factory.mktemp("arm")
    for name, length in (("upper", 0.6), ("fore", 0.4)):
        modes = {"count": 4, "family": "in-plane-bending"}
        link = beam_link(length, rectangle(0.02, 0.03), 10, nu=0.3, name=name, modes=modes)
        (folder / f"{name}.toml").write_text(tomli_w.dumps(link))
    (folder / "scene.toml").write_text(ARM)
    return folder / "scene.toml"


REST = {"name": "rest", "kind": "static"}


def mapped(scene, folder, *over, **keys):
    with batch_of(1) as batch:
        return make_map(plan_map(scene, over, folder, **keys), batch, Watcher())


def written(folder, tables, name="scene"):
    path = folder / f"{name}.toml"
    path.write_text(tomli_w.dumps(tables))
    return path


def two_dimensional(name, mass, inertia, length):
    points = {"root": [0.0, 0.0], "tip": [length, 0.0]}
    return {"name": name, "rigid": {"mass": mass, "inertia": inertia, "center": [length / 2, 0.0], "points": points}}


def test_a_pose_is_what_static_finds_there(arm, tmp_path):
    """The same pose as the start of a scene with its joints kept by motors."""
    found = mapped(arm, tmp_path / "map", "shoulder=0.3", "elbow=-1.0,0.8")
    pose = 1
    keep = '[[trajectory]]\nname = "a"\nmotor = "shoulder"\nvalue = "0.3"\n'
    keep += '[[trajectory]]\nname = "b"\njoint = "elbow"\nvalue = "0.8"\n'
    single = arm.with_name("single.toml")
    single.write_text(ARM + keep)
    with solve(single) as results:
        for condition in ("locked", "compliant"):
            for name, ours in (("frequency", "frequency"), ("compliance/fore.tip", "compliance")):
                expected = results[f"rest/joints_{condition}/{name}"][0]
                values = found.values[f"joints_{condition}/{ours}"][pose]
                np.testing.assert_allclose(values, expected[: len(values)], rtol=1e-7, atol=1e-12)
        tip = results["rest/points/fore.tip/position"][0]
        moment = results["rest/joints/shoulder/gear_moment"][0]
    np.testing.assert_allclose(found.values["place"][pose] + found.values["sag"][pose], tip, atol=1e-9)
    torque = found.values["torque"][pose][found.motors.index("shoulder")]
    np.testing.assert_allclose(torque, moment, rtol=1e-7)


def test_places_keep_the_branch_of_the_start_and_say_what_is_out_of_reach(arm, tmp_path):
    found = mapped(arm, tmp_path / "map", "x=0.11:1.31:13", "y=-0.6:0.6:9")
    x, y = (
        values.ravel() for values in np.meshgrid(np.linspace(0.11, 1.31, 13), np.linspace(-0.6, 0.6, 9), indexing="ij")
    )
    distance = np.hypot(x, y)
    reachable = (distance < 1.0 - 1e-9) & (distance > 0.2 + 1e-9)
    cosine = (distance**2 - 0.6**2 - 0.4**2) / (2 * 0.6 * 0.4)
    elbow = np.arccos(np.clip(cosine, -1, 1))
    within = reachable & (elbow <= 2.5)
    np.testing.assert_array_equal(found.status == 0, within)
    np.testing.assert_array_equal(found.status == 1, ~reachable)
    np.testing.assert_allclose(found.values["place"][within], np.column_stack([x, y])[within], atol=1e-9)
    np.testing.assert_allclose(found.values["manipulability"][within], 0.24 * np.sin(elbow[within]), rtol=1e-6)
    assert np.isnan(found.values["manipulability"][~within]).all()


def test_response_at_zero_frequency_is_the_compliance(arm, tmp_path):
    found = mapped(arm, tmp_path / "map", "elbow=0.5,1.0", frequencies=np.array([0.0, 5.0]))
    for condition in ("locked", "compliant"):
        diagonal = np.array([np.diag(C)[:2] for C in found.values[f"joints_{condition}/compliance"]])
        np.testing.assert_allclose(found.values[f"joints_{condition}/response"][:, 0], diagonal, rtol=1e-9)
        peak = found.values[f"joints_{condition}/response"].max(axis=(1, 2))
        np.testing.assert_allclose(quantities(found)[f"response_{condition}"].values, 1e3 * peak)


def test_files_and_pictures(arm, tmp_path):
    found = mapped(arm, tmp_path / "map", "shoulder=-1:1:4", "elbow=0.2:1.4:3")
    path = write_map(found)
    with h5py.File(path) as file:
        assert file["joints_locked/frequency"].shape == (4, 3, 3)
        assert file["joints_locked/compliance"].shape == (4, 3, 3, 3)
        np.testing.assert_array_equal(file["axes/elbow"], np.linspace(0.2, 1.4, 3))
        assert file["status"].attrs["meaning"][0] == "found"
    lines = (tmp_path / "map" / "table.csv").read_text().splitlines()
    assert len(lines) == 13
    assert lines[0].startswith("shoulder,elbow,status,")
    files = draw_map(found)
    assert {file.stem for file in files} == set(quantities(found))
    assert all(file.stat().st_size > 5000 for file in files)


def test_round_off_is_no_result(arm, tmp_path):
    """A rigid robot has no stiffness, torques at a vertical arm are 0, and what no pose changes has no worst pose."""
    rigid = "{ mass = 1.0, inertia = 0.1, center = [0.1, 0.0], points = { root = [0.0, 0.0], tip = [0.3, 0.0] } }"
    scene = arm.with_name("rigid.toml")
    text = ARM.replace("stiffness = 3000.0", "").replace('link = "upper.toml"', f"rigid = {rigid}")
    scene.write_text(text)  # the forearm is flexible, and the point is where it begins
    console = StringIO()
    for point in ("upper.tip", "fore.tip"):
        found = mapped(scene, tmp_path / point, "shoulder=0:90*deg:10", "elbow=0", point=point)
        print_map(found, Console(file=console, width=120))
        tested = quantities(found)
        if point == "upper.tip":
            assert tested["stiffness_locked"].everywhere == "rigid"
            assert {path.stem for path in draw_map(found)} == {"torque"}
        assert tested["torque"].values[-1] == 0.0
        assert tested["frequency_locked"].everywhere
    assert not re.search(r"e[+-]\d\d", console.getvalue())


def test_poses_judged_before_stay_where_inverse_kinematics_rounds_otherwise(arm, tmp_path, monkeypatch):
    """It does from process to process: postures come from the folder, and what was judged of them is not lost."""
    over = ("x=0.5:0.9:12", "y=-0.3:0.3:12")
    whole = mapped(arm, tmp_path / "map", *over)
    first, *others = sorted((tmp_path / "map" / "parts").glob("*.npz"))
    assert others
    first.unlink()
    before = {file.name: file.stat().st_mtime_ns for file in others}
    exact = pose_map.grid_postures

    def rounded(*inputs, **keys):
        found = exact(*inputs, **keys)
        return found._replace(q=np.nextafter(found.q, np.inf))

    monkeypatch.setattr(pose_map, "grid_postures", rounded)
    again = mapped(arm, tmp_path / "map", *over)
    after = {file.name: file.stat().st_mtime_ns for file in (tmp_path / "map" / "parts").glob("*.npz")}
    assert before.items() <= after.items()
    assert after.keys() == {first.name, *before}
    np.testing.assert_array_equal(again.q, whole.q)


@pytest.mark.parametrize(
    ("over", "message"),
    [
        (("elbo=0:1:3",), r'NAME=FIRST:LAST:COUNT of a joint .* found "elbo=0:1:3".*did you mean "elbow"'),
        (("elbow=0:1",), "expected NAME=FIRST:LAST:COUNT or NAME=VALUE,VALUE"),
        (("elbow=0:1:3", "x=0:1:3"), "expected joints alone or directions of a point alone"),
        (("elbow=0:1:3", "elbow=0:1:3"), "expected each joint or direction once"),
        (("z=0:1:3",), "expected NAME=FIRST:LAST:COUNT of a joint"),
        (("elbow=0", "turn=0:1:2"), "expected NAME=FIRST:LAST:COUNT of a joint"),
        (("x=0:1:1000", "y=0:1:1000"), "expected at most 100000 poses, found 1000000"),
    ],
)
def test_wrong_grids(arm, tmp_path, over, message):
    with pytest.raises(InputError, match=message):
        plan_map(arm, over, tmp_path / "map")


def test_a_wrong_point_and_a_folder_of_something_else(arm, tmp_path):
    with pytest.raises(InputError, match=r'--point: expected one of .*"fore.tip".* found "fore.tp"'):
        mapped(arm, tmp_path / "map", "elbow=0:1:3", point="fore.tp")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "letter.txt").write_text("mine")
    with pytest.raises(InputError, match="expected a new or empty folder"):
        mapped(arm, tmp_path / "other", "elbow=0:1:3")


def test_the_tool_of_a_robot_without_path_is_on_its_last_body(tmp_path):
    """Where a payload is, its "tip", or its last point, whatever its name."""
    flange = {"flange": [0.2, 0.0, 0.0]}
    payload = [{"point": "hand.flange", "mass": 1.0}]
    for points, payloads, expected in (
        (flange, [], "flange"), ({"tip": ORIGIN} | flange, [], "tip"), ({"tip": ORIGIN} | flange, payload, "flange")
    ):  # fmt: skip
        hand = scene([rigid("hand", **points)], [revolute("wrist", "ground", "hand.root")], REST, payload=payloads)
        assert plan_map(written(tmp_path, hand), ("wrist=0:1:2",), tmp_path / "map").point == f"hand.{expected}"


def test_poses_that_no_motor_keeps_are_refused(arm, tmp_path):
    """Weight would take them elsewhere."""
    limp = arm.with_name("limp.toml")
    limp.write_text(
        ARM.replace('type = "revolute"', 'type = "revolute"\nmotor = false').replace("stiffness = 3000.0", "")
    )
    with pytest.raises(InputError, match="expected motors that keep the poses of a map, found none"):
        mapped(limp, tmp_path / "map", "shoulder=0.3")


@pytest.mark.parametrize(
    "over", [("x=-1.23:1.23:13", "y=-1.23:1.23:13"), ("x=-0.95:0.95:9", "y=0"), ("x=0.3:1:8", "y=0")]
)
def test_a_straight_arm_reaches_what_its_links_reach(tmp_path, over):
    """Places from 0.2 to 1 m, from a start that is straight, or that no neighbor leads from across the hole."""
    bodies = [two_dimensional("a", 2.0, 0.05, 0.6), two_dimensional("b", 1.0, 0.02, 0.4)]
    limit = {"position_limit": [-3.2, 0.1]}
    joints = [pin("s", "ground", "a.root"), pin("e", "a.tip", "b.root", **limit)]
    found = mapped(written(tmp_path, planar(bodies, joints, REST)), tmp_path / "map", *over)
    x, y = np.meshgrid(*(axis.values for axis in found.plan.axes), indexing="ij")
    distance = np.hypot(x, y).ravel()
    assert (found.status == np.where((distance > 0.2 - 1e-9) & (distance < 1.0 + 1e-9), 0, 1)).all()
    np.testing.assert_allclose(np.linalg.norm(found.values["place"], axis=1)[found.status == 0],
                               distance[found.status == 0], atol=1e-9)  # fmt: skip


def test_names_with_blanks_and_limits_of_each_coordinate(tmp_path):
    """Weights times levers about y, none about z, against the limit of each; a range of each coordinate."""
    bodies = [rigid("a", 2.0, [0.01, 0.05, 0.05], [0.3, 0.0, 0.0], e=[0.6, 0.0, 0.0]),
              rigid("b", 1.0, [0.01, 0.02, 0.02], [0.2, 0.0, 0.0], e=[0.4, 0.0, 0.0])]  # fmt: skip
    both = {"axis": Z, "second_axis": Y, "motor": True, "moment_limit": [100.0, 5.0]}
    elbow = revolute("elbow 1", "a.e", "b.root", Y, moment_limit=3.0)
    start, paths = {"joints": {"s": [0.0, 0.5]}}, []
    for highest in (1.0, 0.4):
        ranges = {"position_limit": [[-1.0, 1.0], [-1.0, highest]]}
        joints = [joint("s", "universal", "ground", "a.root", **both, **ranges), elbow]
        paths.append(written(tmp_path, scene(bodies, joints, REST, initial=start), f"to_{highest:g}"))
    with pytest.raises(SolveError, match="within reach and the limits of the joints"):
        mapped(paths[1], tmp_path / "none", "elbow 1=0:1:3")
    found = mapped(paths[0], tmp_path / "map", "elbow 1=0:1:3")
    assert found.motors == ("s 1", "s 2", "elbow 1")
    third = 9.81 * 0.2 * np.cos(0.5 + np.linspace(0, 1, 3))
    second = 9.81 * (2.0 * 0.3 + 0.6) * np.cos(0.5) + third
    np.testing.assert_allclose(found.values["torque"].T, [0 * third, -second, -third], atol=1e-9)
    np.testing.assert_allclose(found.values["torque_share"].T, [0 * third, second / 5.0, third / 3.0], atol=1e-9)


def five_bar(order, third=False):
    """Two cranks of 0.3 m on the ground, 0.4 m apart, with compliant gears, and rods of 0.5 m that meet above."""
    bodies = [two_dimensional(name, 1.0, 0.02, L) for name, L in (("a", 0.3), ("b", 0.5), ("c", 0.3), ("d", 0.5))]
    geared = {"motor": True, "stiffness": 500.0, "rotor_inertia": 1e-3}
    joints = [pin("A", "ground", "a.root", **geared), pin("C", "ground", "c.root", at=[0.4, 0.0], **geared)]
    joints += [pin("B", "a.tip", "b.root", motor=third), pin("D", "c.tip", "d.root"), pin("E", "b.tip", "d.tip")]
    start = {"joints": {"A": 2.0, "C": 1.2, "B": -1.1, "D": 1.1, "E": 1.4}}
    return planar(bodies, [joints[k] for k in order], REST, initial=start)


@pytest.mark.parametrize("order", [(0, 1, 2, 3, 4), (4, 3, 2, 1, 0)])
def test_manipulability_of_a_loop_behind_gears(tmp_path, order):
    """Rods keep their lengths: u·v = u·v of the crank's end along each rod u, whatever joint comes first."""
    found = mapped(written(tmp_path, five_bar(order)), tmp_path / "map", "A=2.0", "C=1.2", point="b.tip")
    ends = np.array([[0.3 * np.cos(2.0), 0.3 * np.sin(2.0)], [0.4 + 0.3 * np.cos(1.2), 0.3 * np.sin(1.2)]])
    u = found.values["place"][0] - ends
    speeds = [u[k] @ [-ends[k, 1], ends[k, 0] - 0.4 * k] for k in (0, 1)]
    assert found.values["manipulability"][0] == pytest.approx(abs(np.prod(speeds) / np.linalg.det(u)), rel=1e-9)
    with pytest.raises(InputError, match=r"no more motors than degrees of freedom, found"):
        mapped(written(tmp_path, five_bar(order, third=True)), tmp_path / "none", "A=2.0", "C=1.2", point="b.tip")


def test_stable_depth_of_cut_is_that_of_the_response(arm, tmp_path):
    """1/(2 max Re ν) of C̄ G, with G solved for line by line, of the worst of twelve feeds; a joint named "turn"."""
    scene = arm.with_name("damped.toml")
    damped = ARM.replace("stiffness = 3000.0", "stiffness = 3000.0\ndamping = 3.0")
    scene.write_text(damped.replace("elbow", "turn"))
    keys = {"teeth": 2, "tangential": 6e8, "radial": 2e8, "entry": 0.0, "exit": 2.0, "highest": 40.0}
    (tmp_path / "cutter.toml").write_text(tomli_w.dumps(keys))
    milling = read_milling(tmp_path / "cutter.toml")
    found = mapped(scene, tmp_path / "map", "shoulder=0.2:0.4:2", "turn=0.8", milling=milling)
    model = prepare_scene(scene).model
    linear, _ = PoseEvaluator(model, found.q[1], "fore.tip").linear_equations(found.q[1])
    N, K, D = free_coordinates(linear, "compliant")
    lowest = np.sqrt(np.linalg.eigvalsh(K)[0])
    w = np.linspace(0.8 * lowest, 1.5 * lowest, 20_001)[:, None, None]
    J = linear.points["fore.tip"][:2] @ N
    modes = np.linalg.eigh(K)[1][:, :1]  # below 40 Hz
    J, K, D = J @ modes, modes.T @ K @ modes, modes.T @ D @ modes
    G = J @ np.linalg.solve(K + 1j * w * D - w**2, np.broadcast_to(J.T, (len(w), *J.T.shape)))
    feeds = milling.feeds(np.eye(3))[:, :, :2]
    depth = min(0.5 / np.linalg.eigvals(milling.average @ E @ G @ E.T).real.max() for E in feeds)
    assert found.values["joints_compliant/milling_depth"][1] == pytest.approx(depth, rel=1e-3)
    assert "milling_compliant" in quantities(found)


GEAR = {"stiffness": 5e3, "rotor_inertia": 1e-3}


def box(kind, *between, center=ORIGIN, **gear):
    """Of 2 kg on the ground by one joint."""
    inner, outer = between or ("ground", "box.root")
    lift = joint("lift", kind, inner, outer, axis=Z if kind == "prismatic" else Y, **GEAR | gear)
    return scene([rigid("box", 2.0, center=center)], [lift], REST, gravity=[0.0, 0.0, -10.0])


@pytest.mark.parametrize("between", [("ground", "box.root"), ("box.root", "ground")])
def test_a_slide_behind_a_spring_needs_a_force(tmp_path, between):
    """m g in N, m g/k below the motor; a process whose cutter no mode below its highest frequency moves."""
    path = written(tmp_path, box("prismatic", *between))
    keys = {"teeth": 2, "tangential": 6e8, "radial": 2e8, "entry": 0.0, "exit": 2.0, "highest": 1.0}
    (tmp_path / "cutter.toml").write_text(tomli_w.dumps(keys))
    found = mapped(path, tmp_path / "map", "lift=0.1:0.2:2", milling=read_milling(tmp_path / "cutter.toml"))
    np.testing.assert_allclose(np.abs(found.values["torque"]), 20.0)
    np.testing.assert_allclose(found.values["sag"][:, 2], -20.0 / 5e3)
    titles = {name: (one.title, one.everywhere) for name, one in quantities(found).items()}
    assert titles["torque"] == ("largest static force (N)", "20")
    assert titles["milling_compliant"] == ("stable depth of cut, compliant gears (mm)", "unlimited")


def test_a_map_of_poses_that_all_fall_says_so(tmp_path):
    """An upright pendulum of weight m g l = 10 N·m/rad falls on a spring of 9, and stands on one of 11."""
    falls, stands = (
        written(tmp_path, box("revolute", center=[0.0, 0.0, 0.5], stiffness=k), f"spring_{k:g}") for k in (9.0, 11.0)
    )
    with pytest.raises(SolveError, match="no pose of the grid has a stable equilibrium"):
        mapped(falls, tmp_path / "none", "lift=0.0")
    found = mapped(stands, tmp_path / "map", "lift=0.0")
    hertz = np.sqrt((11.0 - 10.0) / (0.1 + 2.0 * 0.5**2)) / (2 * np.pi)
    assert found.values["joints_compliant/frequency"][0, 0] == pytest.approx(hertz)


def test_force_that_a_slide_without_motor_leaves(tmp_path):
    with pytest.raises(SolveError, match=r'20 N are left at joint "lift"'):
        solve(written(tmp_path, box("prismatic")))
