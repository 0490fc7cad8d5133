"""Motors and patches on the paths of different robots: solids, loops, layouts, stiffer links; loads on their tips."""

import math
import re

import numpy as np
import pytest
from beam_links import link_keys, rectangle
from tables_3d import pin as revolute
from tables_3d import planar, rigid
from tables_3d import scene as spatial

import ffrobot
from ffrobot.mbs.inversion.servo import make_servo
from ffrobot.mbs.tracking.geared import with_gears
from ffrobot.run.solve import prepare_scene, solve_scene
from ffrobot.run.watcher import Watcher

pytestmark = pytest.mark.filterwarnings("ignore::ffrobot.FfrobotWarning")

ZETA = 0.005
BOTH_PLANES = {"family": ["in-plane-bending", "out-of-plane-bending"], "count": 4}
PART = {"structural": True, "density": 7600.0}


def septic(T):
    return f"(35*(t/{T})**4 - 84*(t/{T})**5 + 70*(t/{T})**6 - 20*(t/{T})**7)"


def strip(length, height, width, *, solid=False, **modes):
    kind, mesh = ("solid", {"size": 0.02}) if solid else ("beam", {"elements": 12})
    modes = {"family": "in-plane-bending", "count": 2, "attachment_modes": False} | modes
    return link_keys(kind, length, rectangle(height, width), mesh, name="strip", modes=modes, damping={"ratio": ZETA})


def patches(body, width, length=0.08, **keys):
    where = {} if "centers" in keys else {"count": 4}
    return {
        "body": body, "face": "both", "length": length, "width": width, "thickness": 0.25e-3, "modulus": 63e9,
        "d31": 110e-12, "structural": False, "limit": 300.0,
    } | where | keys  # fmt: skip


def scene(T, gravity, trajectory, body, joint, **tables):
    """The path, which is carried and replayed."""
    carried = {"name": "carried", "kind": "tracking", "end": T, "output_step": T / 20, "tolerance": 1e-5}
    replay = {"name": "replay", "kind": "forward", "actuation": "carried", "apply": "joints+pzt", "tolerance": 1e-8}
    made, paths = planar if len(gravity) == 2 else spatial, [{"name": "tip", **trajectory}]
    return made(body, joint, carried, replay, gravity=gravity, trajectory=paths, **tables)


def in_plane(*layouts, solid=False, **tables):
    """The strip of the page."""
    return scene(
        0.6, [0.0, 0.0], {"point": "arm.tip", "y": f"sin(pi/4*{septic(0.6)} - pi/8)"},
        body=[{"name": "arm", "link": strip(1.0, 0.004, 0.02, solid=solid)}],
        joint=[revolute("hub", "ground", "arm.root", motor=True)], initial={"angles": {"arm": -np.pi / 8}},
        pzt=list(layouts) or [patches("arm", 0.02)], **tables,
    )  # fmt: skip


def in_3d(*, patch=None, **tables):
    """A rod on a waist and a shoulder, under gravity, with layouts in two planes."""
    return scene(
        0.35, [0.0, 0.0, -9.81],
        {"point": "arm.tip", "y": f"0.45*{septic(0.35)}", "z": f"0.28 + 0.25*{septic(0.35)}"},
        body=[
            rigid("column", 2.0, [0.01, 0.01, 0.005], [0.0, 0.0, 0.1], top=[0.0, 0.0, 0.2]),
            {"name": "arm", "link": strip(0.8, 0.006, 0.006, **BOTH_PLANES)},
        ],
        joint=[
            revolute("waist", "ground", "column.root", axis=[0.0, 0.0, 1.0]),
            revolute("shoulder", "column.top", "arm.root", axis=[0.0, -1.0, 0.0]),
        ],
        initial={"state": "static", "joints": {"waist": 0.0, "shoulder": 0.1}},
        pzt=[patches("arm", 0.006, name=way, bends=way, **(patch or {})) for way in ("in-plane", "out-of-plane")],
        **tables,
    )  # fmt: skip


def five_bar():
    """Two soft bars on motors, two rigid ones that meet at the tip: a loop in the plane."""
    base, reach, T = 0.3, 0.4, 0.25

    def angles(x, y, sign):
        turn, bent = math.atan2(y, x), math.acos(math.hypot(x, y) / 2 / reach)
        return turn + sign * bent, turn - sign * bent

    at = [*angles(base / 2, 0.55, 1), *angles(-base / 2, 0.55, -1)]
    soft = strip(reach, 0.003, 0.015, count=1)
    points = {"root": [0.0, 0.0], "tip": [reach, 0.0]}
    bar = {"mass": 0.05, "inertia": 0.05 * reach**2 / 12, "center": [reach / 2, 0.0], "points": points}
    sides = ("near", "far")
    return scene(
        T, [0.0, 0.0], {"point": "near_rod.tip", "x": f"0.15 + 0.1*{septic(T)}", "y": f"0.55 - 0.05*{septic(T)}"},
        body=[{"name": k, "link": soft} for k in sides] + [{"name": f"{k}_rod", "rigid": bar} for k in sides],
        joint=[
            revolute("A", "ground", "near.root", motor=True), revolute("B", "near.tip", "near_rod.root"),
            revolute("D", "ground", "far.root", at=[base, 0.0], motor=True), revolute("E", "far.tip", "far_rod.root"),
            revolute("P", "near_rod.tip", "far_rod.tip"),
        ],
        initial={"angles": dict(zip(("near", "near_rod", "far", "far_rod"), at, strict=True))},
        pzt=[patches(k, 0.015, 0.06) for k in sides],
    )  # fmt: skip


def geared(tables, f, **inertias):
    """With gears of f Hz, rotors behind a ratio of 100 and 2 % of damping in joints with so much inertia, kg·m²."""
    for one in tables["joint"]:
        if (inertia := inertias.get(one["name"])) is not None:
            K = inertia * (2 * np.pi * f) ** 2
            one |= {"rotor_inertia": inertia / 1e4, "gear_ratio": 100.0, "stiffness": K}
            one |= {"damping": 0.04 * K / (2 * np.pi * f)}
    return tables


TWO = [patches("arm", 0.02, name=name, centers=at, face=face, **more) for name, at, face, more in (
    ("near", [0.1, 0.3], "both", {}), ("far", [0.6, 0.9], "+y", PART),
)]  # fmt: skip
ROBOTS = {
    "two layouts, one part of its link": lambda: in_plane(*TWO),
    "geometric stiffening": lambda: in_plane(geometric_stiffening=True),
    "solid": lambda: in_plane(solid=True),
    "loop": five_bar,
    "3D, stiffening": lambda: in_3d(patch={"structural": ["stiffness"]}, geometric_stiffening=True),
    "gear": lambda: geared(in_plane(), 20, hub=0.05),
    "3D, gears": lambda: geared(in_3d(), 30, waist=0.05, shoulder=0.05),
}


@pytest.mark.parametrize("robot", ROBOTS)
def test_replay_follows_the_path(robot):
    """Torques and voltages in the nonlinear equations: 1e-8 of the way; torques alone are a hundred times farther."""
    model = ffrobot.make_scene(**ROBOTS[robot]())
    with ffrobot.solve(model) as results:
        wanted, found = (
            results[f"{name}/points/{model.trajectory[0].point}/position"] for name in ("carried", "replay")
        )
        off, way = np.abs(found - wanted).max(), np.linalg.norm(np.diff(wanted, axis=0), axis=1).sum()
        about = results.attributes("carried/tracking")
    assert about["objective"] == "effort"
    assert off < 1e-8 * way
    assert about["without_patches"] > 100 * off


def behind_a_gear(objective, moment_limit):
    """The strip behind its gear, whose path jumps in the fourth derivative where it begins and ends."""
    tables = geared(in_plane(patches("arm", 0.02, limit=200.0)), 20, hub=0.05)
    tables["joint"][0]["moment_limit"] = moment_limit
    tables["analysis"] = [tables["analysis"][0] | {"objective": objective, "tolerance": 1e-4}]
    return tables


@pytest.mark.parametrize(("objective", "moment_limit"), [("least-voltage", 4.0), ("effort", 2.4)])
def test_torques_behind_gears_are_within_limits(objective, moment_limit):
    """Between Gauss points, too: 5.1 and 2.8 N·m where they are constraints there alone."""
    with ffrobot.solve(ffrobot.make_scene(**behind_a_gear(objective, moment_limit))) as results:
        peak, verdict = results.attributes("carried/joints/hub/moment")["peak"], results.verdict["carried"]
        about, most = results.attributes("carried/tracking"), np.abs(results["carried/pzt/arm/required_voltage"]).max()
    assert most <= (about["least_voltage"] if objective == "least-voltage" else 200.0)
    assert 0.8 * moment_limit < peak <= moment_limit
    assert about["objective"] == objective
    assert verdict.answer.startswith("motors and patches can do it, within the limits")
    assert not any("moment_limit" in text for text in verdict.warnings)


def test_a_torque_beyond_its_limit_is_said():
    """The least torque is that at Gauss points: how far it is exceeded, and when, as the motor's record has it."""
    with ffrobot.solve(ffrobot.make_scene(**behind_a_gear("least-torque", 1.5))) as results:
        of_motor, verdict = results.attributes("carried/joints/hub/moment"), results.verdict["carried"]
    (warning,) = (text for text in verdict.warnings if "moment_limit" in text)
    share, at = re.match(r"the motor of hub reaches (\S+) % of its moment_limit at t = (\S+) s", warning).groups()
    assert 1.0 < of_motor["peak"] / 1.5 == pytest.approx(float(share) / 100, rel=1e-3)
    assert of_motor["peak_time"] == pytest.approx(float(at), abs=1e-5)
    assert verdict.answer.startswith("limits exceeded: motor hub")


def posed(tables):
    solution = prepare_scene(ffrobot.make_scene(**tables), Watcher())
    return with_gears(make_servo(solution.model, solution.scene.analysis[0].end, lambda: True))


def moved_motors(*motors):
    """The five-bar with motors behind gears at these joints."""
    tables = five_bar()
    for one in tables["joint"]:
        one["motor"] = one["name"] in motors
    return geared(tables, 40, **dict.fromkeys(motors, 0.02))


def test_rotors_that_their_own_motors_turn():
    """Links feel these gears: the tip would be 0.5 mm off. B's rotor on a bar that A turns is none of them."""
    assert posed(moved_motors("A", "B")).gears.joints == ("A", "B")
    with pytest.raises(ffrobot.InputError, match=r'joint "B" on its first body.* another joint of the loop'):
        posed(moved_motors("B", "D"))
    tables = geared(in_plane(), 20, hub=0.05)
    tables["joint"][0]["between"].reverse()
    with pytest.raises(ffrobot.InputError, match=r'joint "hub".* Exchange its sides in `between`'):
        posed(tables)


def test_finer_links_behind_gears_are_refused_before_the_run():
    tables, kept = geared(in_plane(), 20, hub=0.05), []
    tables["analysis"][0] |= {"check": "finer"}
    with pytest.raises(ffrobot.InputError, match="check: expected "):
        solve_scene(ffrobot.make_scene(**tables), Watcher(), kept.append)
    assert not kept


def test_load_on_the_tip():
    """By virtual work: torque and reaction at rest; from rest to rest, work of motors, patches and the load."""
    F = np.array([0.2, -0.3])
    tables = in_plane(load=[{"point": "arm.tip", "x": str(F[0]), "y": str(F[1])}])
    tables["analysis"][0] |= {"output_step": 0.001, "tolerance": 1e-6}
    tables["initial"]["state"] = "static"
    with ffrobot.solve(ffrobot.make_scene(**tables)) as results:
        about, time = results.attributes("carried/tracking"), results.time("carried/pzt/arm/voltage")
        tip, p, rate, torque, reaction = (results[f"carried/{name}"] for name in (
            "points/arm.tip/position", "bodies/arm/modal", "bodies/arm/modal_velocity", "joints/hub/moment",
            "joints/hub/reaction",
        ))  # fmt: skip
        omega = 2 * np.pi * np.array(results.modal_body("arm").frequency[:2])
    for k in (0, -1):
        assert torque[k] == pytest.approx(tip[k, 1] * F[0] - tip[k, 0] * F[1], rel=1e-5)
        np.testing.assert_allclose(reaction[k], -F, atol=1e-6)
    loss = (2 * ZETA * omega * rate**2).sum(axis=1)
    dissipated = float(np.diff(time) @ (loss[1:] + loss[:-1]) / 2)
    stored = 0.5 * float(((omega * p[-1]) ** 2 - (omega * p[0]) ** 2).sum())
    work = about["motor_work"] + about["patch_work"]
    assert work == pytest.approx(dissipated + stored - F @ (tip[-1] - tip[0]), rel=1e-6)
    assert dissipated > 1e-3 * work
    assert stored > 1e-3 * work


@pytest.mark.parametrize("lasts", [0.02, 1e-4])
def test_brief_load_on_the_tip(lasts):
    """Intervals begin and end where it does: a simulation under the same torques and voltages stays on the path."""
    force = f"where(t < 0.3011, 0, where(t < {0.3011 + lasts}, {2e-4 / lasts}, 0))"
    tables = in_plane(load=[{"point": "arm.tip", "y": force}])
    with ffrobot.solve(ffrobot.make_scene(**tables)) as results:
        off = results["replay/points/arm.tip/position"] - results["carried/points/arm.tip/position"]
    assert np.abs(off).max() < 1e-6
