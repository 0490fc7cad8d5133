"""Forward runs of a four-bar from the angle and the rate of its crank, or of its rocker: the other joints follow.

Starts in which a joint of a loop, or a tool, would be turned over are none.
"""

import numpy as np
import pytest
from four_bar import SIDES, closed, in_3d, planar
from tables_3d import X, Y, Z, joint, revolute, rigid, scene

import ffrobot

A, RATE, STEP = 1.0, 3.0, 1e-5
D, D_RATE = closed(A)["D"], RATE * (closed(A + STEP)["D"] - closed(A - STEP)["D"]) / (2 * STEP)
RUN = {"name": "run", "kind": "forward", "end": 0.01, "output_step": 0.01}
GEAR = {"gear_ratio": 50.0, "rotor_inertia": 1e-5, "stiffness": 100.0, "motor": True}
SPACES = {"planar": planar, "spatial": in_3d}
STARTS = {
    "joints": {"joints": {"A": A}, "joint_rates": {"A": RATE}},
    "bodies": {"angles": {"crank": A}, "rates": {"crank": RATE}},
    "rocker": {"joints": {"D": D}, "joint_rates": {"D": D_RATE}},
    "all": {"joints": {"A": A, "B": -0.5, "D": 1.4}, "joint_rates": {"A": RATE}},
    "one rate": {"joints": closed(A), "joint_rates": {"D": D_RATE}},
}


def started(space, initial):
    rough = {name: {} if name == "D" else {"viscous_friction": 1e-9} for name in SIDES}
    tables = SPACES[space](rough, [RUN], trajectory=[])
    return ffrobot.solve(ffrobot.make_scene(**tables | {"initial": initial}))


@pytest.mark.parametrize(
    ("space", "start"),
    [(space, start) for space in SPACES for start in STARTS if (space, start) != ("spatial", "bodies")],
)
def test_named_joints_keep_their_values(space, start):
    """The crank alone, or the rocker alone, determines posture and rates; of too many angles none may be far off."""
    with started(space, STARTS[start]) as found:
        near = 0.1 if start == "all" else 1e-9
        if start != "rocker":  # which stands like this at two angles of the crank
            assert found["run/joints/A/coordinate"][0] == pytest.approx(A, abs=near)
            assert found["run/joints/A/rate"][0] == pytest.approx(RATE, abs=1e-9)
        if start != "all":
            assert found["run/joints/D/coordinate"][0] == pytest.approx(D, abs=1e-9)
            assert found["run/joints/D/rate"][0] == pytest.approx(D_RATE, abs=1e-8)
        assert not found.warnings


@pytest.mark.parametrize(
    "initial",
    [
        {"joints": {"A": A, "D": 2.4}},
        {"joint_rates": {"A": RATE, "D": 5.0}},
        {"joints": closed(A) | {"D": 2.4}},
    ],
)
def test_values_that_no_loop_meets_are_told(initial):
    """Wherever the loop is cut."""
    with pytest.warns(ffrobot.FfrobotWarning, match='joints .*"[AD]".* start away from the values'):
        started("spatial", {"joints": {"A": A}} | initial)


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("initial", [{"joints": {"A": A}, "joint_rates": {"A": RATE}}, {"joints": {"B": -0.5}}])
def test_gears_in_loops_start_as_asked(initial, space):
    """Behind a motor on a path: twisted where [initial] has values, else as the motor is; the others close the loop."""
    run, path = RUN | {"kind": "pcid"}, {"name": "crank", "motor": "A", "value": "0.9 + 0.5*t"}
    tables = SPACES[space]({name: GEAR if name == "A" else {} for name in SIDES}, [run], trajectory=[path])
    with ffrobot.solve(ffrobot.make_scene(**tables | {"initial": initial})) as found:
        start, rate = (A, RATE) if "A" in initial["joints"] else (0.9, 0.5)
        assert found["run/joints/A/coordinate"][0] == pytest.approx(start, abs=1e-9)
        assert found["run/joints/A/rate"][0] == pytest.approx(rate, abs=1e-9)
        assert found["run/joints/D/coordinate"][0] == pytest.approx(closed(start)["D"], abs=1e-9)
        assert found["run/joints/A/motor_coordinate"][0] == pytest.approx(0.9, abs=1e-12)
        assert not found.warnings


def test_gears_in_loops_that_cannot_start_as_asked_are_told():
    run, path = RUN | {"kind": "pcid"}, {"name": "rocker", "motor": "D", "value": f"{D!r}"}
    tables = in_3d({name: GEAR if name == "D" else {"motor": False} for name in SIDES}, [run], trajectory=[path])
    with pytest.warns(ffrobot.FfrobotWarning, match='joints "D" start away from the values'):
        ffrobot.solve(ffrobot.make_scene(**tables | {"initial": {"joints": {"A": A, "D": D + 1.5}}}))


@pytest.mark.parametrize("last", "CD")
def test_loops_that_close_with_a_joint_turned_over_are_refused(last):
    """Axes A and D hold coupler and rocker upright; C asks for one of them upside down, wherever the loop is cut."""
    names = [*(name for name in SIDES if name != last), last]
    tables = in_3d({name: {"rpy": [np.pi, 0.0, 0.0]} if name == "C" else {} for name in names}, [RUN], trajectory=[])
    with pytest.raises(ffrobot.InputError, match=f'"{last}" is turned over'):
        ffrobot.solve(ffrobot.make_scene(**tables))


@pytest.mark.parametrize(("pitch", "is_near"), [(0.3, True), (0.3 + np.pi, False)])
def test_tools_point_along_their_direction(pitch, is_near):
    """Not against it, though an axis against it is parallel to it as well."""
    bodies = [rigid(f"b{k}", 1.0, [0.01] * 3, tip=X) for k in range(2)]
    joints = [revolute("yaw", "ground", "b0.root", Z), revolute("pitch", "b0.tip", "b1.root", Y)]
    path = {"name": "tool", "point": "b1.tip", "tool_axis": X, "direction": ["1", "0.5", "-0.3 - t"]}
    run = {"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.1}
    tables = scene(bodies, joints, run, trajectory=[path], initial={"joints": {"yaw": 0.4, "pitch": pitch}})
    if is_near:
        with ffrobot.solve(ffrobot.make_scene(**tables)) as found:
            yaw, pitch = (found[f"inverse/joints/{name}/coordinate"] for name in ("yaw", "pitch"))
            np.testing.assert_allclose(yaw, np.arctan2(0.5, 1.0), atol=1e-9)
            np.testing.assert_allclose(pitch, np.arctan2([0.3, 0.4], np.hypot(1.0, 0.5)), atol=1e-9)
    else:
        with pytest.raises(ffrobot.InputError, match=r'"tool" is turned over.*from .initial. joints'):
            ffrobot.solve(ffrobot.make_scene(**tables))


@pytest.mark.parametrize("named", ["S", "T"])
def test_of_two_spherical_joints_that_without_a_value_is_cut(named):
    """The other one says how the coupler stands about its own axis."""
    bodies = [rigid(name, tip=X) for name in "abc"]
    joints = [revolute("A", "ground", "a.root"), revolute("D", "ground", "c.root", at=X)]
    joints += [joint("S", "spherical", "a.tip", "b.root"), joint("T", "spherical", "b.tip", "c.tip")]
    made = ffrobot.make_scene(**scene(bodies, joints, RUN, initial={"joints": {named: [0.1, 0.0, 0.0]}}))
    assert made.joint[made.topology.carriers["b"].joint].name == named


TURN = 2 * np.pi
AXIS = {"axis": [0, 0, 1]}
CUT = {
    "revolute": (AXIS, 3 * TURN, [3 * TURN + 0.4]),
    "cylindrical": (AXIS, [-2 * TURN, 0.0], [-2 * TURN + 0.4, 0.0]),
    "planar": (AXIS, [0.0, 0.0, TURN], [0.0, 0.0, TURN + 0.4]),
    "universal": ({**AXIS, "second_axis": [1, 0, 0]}, [TURN, -TURN], [TURN + 0.4, -TURN]),
    "prismatic": ({"axis": [0, 0, 1], "rpy": [0.0, 0.0, 0.4]}, 0.1, [0.0]),
    "spherical": ({}, [0.1, 0.2, 0.3], None),
    "weld": ({"rpy": [0.0, 0.0, 0.4]}, None, None),
}


@pytest.mark.parametrize("kind", CUT)
def test_a_loop_is_cut_at_a_joint_with_a_guess(kind):
    """A bar turned by 0.4 rad on a pin of the ground, with a second joint beside the pin that closes a loop."""
    keys, guess, expected = CUT[kind]
    joints = [
        revolute("pin", "ground", "bar.root", motor=False),
        {"name": "other", "type": kind, "between": ["ground", "bar.root"], **keys},
    ]
    rest = {"name": "rest", "kind": "forward", "end": 0.02, "output_step": 0.01}
    start = {"joints": {"pin": 0.4} | ({} if guess is None else {"other": guess})}
    made = ffrobot.make_scene(**scene([rigid("bar")], joints, rest, initial=start))
    results = ffrobot.solve(made)
    assert '"other" start away' in str(results.warnings) or guess in (None, 0.1)
    assert results.has("rest/joints/other/coordinate") == (expected is not None)
    if expected is not None:
        found = results["rest/joints/other/coordinate"].reshape(3, -1)
        np.testing.assert_allclose(found, [expected] * 3, atol=1e-12)
