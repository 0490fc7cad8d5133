"""Forward runs of a four-bar from the angle and the rate of its crank, or of its rocker: the other joints follow."""

import numpy as np
import pytest

import ffrobot

CRANK, COUPLER, ROCKER, GROUND = 0.2, 0.5, 0.4, 0.5
A, RATE = 1.0, 3.0


def four_bar(space, initial):
    """Crank, coupler and rocker in the plane; their joints are at zero where all bars lie along x."""

    def place(x):
        return [x, 0.0] if space == "planar" else [x, 0.0, 0.0]

    def bar(name, length):
        inertia = 1e-3 if space == "planar" else [1e-3] * 3
        points = {"root": place(0.0), "tip": place(length)}
        return {"name": name, "rigid": {"mass": 1.0, "center": place(length / 2), "inertia": inertia, "points": points}}

    def hinge(name, first, second, **keys):
        axis = {} if space == "planar" else {"axis": [0.0, 0.0, 1.0]}
        return {"name": name, "type": "revolute", "between": [first, second], **axis, **keys}

    return ffrobot.make_scene(
        name="four_bar",
        space=space,
        gravity=place(0.0),
        body=[bar("crank", CRANK), bar("coupler", COUPLER), bar("rocker", ROCKER)],
        joint=[
            hinge("A", "ground", "crank.root"),
            hinge("B", "crank.tip", "coupler.root"),
            hinge("C", "coupler.tip", "rocker.tip"),
            hinge("D", "ground", "rocker.root", at=place(GROUND)),
        ],
        initial=initial,
        analysis=[{"name": "run", "kind": "forward", "end": 0.01, "output_step": 0.01}],
    )


def rocker():
    """Its angle, from circles about its root and the crank's tip, and its rate, from equal speed along the coupler."""
    tip, root = CRANK * np.array([np.cos(A), np.sin(A)]), np.array([GROUND, 0.0])
    between = root - tip
    distance = np.linalg.norm(between)
    along = (COUPLER**2 - ROCKER**2 + distance**2) / (2 * distance)
    left = np.array([-between[1], between[0]]) / distance
    end = tip + along * between / distance + np.sqrt(COUPLER**2 - along**2) * left
    coupler, arm = end - tip, end - root
    rate = RATE * (coupler @ [-tip[1], tip[0]]) / (coupler @ [-arm[1], arm[0]])
    return np.arctan2(arm[1], arm[0]), rate


STARTS = {
    "joints": {"joints": {"A": A}, "joint_rates": {"A": RATE}},
    "bodies": {"angles": {"crank": A}, "rates": {"crank": RATE}},
    "rocker": {"joints": {"D": rocker()[0]}, "joint_rates": {"D": rocker()[1]}},
    "all": {"joints": {"A": A, "B": -0.5, "D": 1.4}, "joint_rates": {"A": RATE}},
}


@pytest.mark.parametrize(
    ("space", "start"),
    [(space, start) for space in ("planar", "spatial") for start in STARTS if (space, start) != ("spatial", "bodies")],
)
def test_named_joints_keep_their_values(space, start):
    """The crank alone, or the rocker alone, determines posture and rates; of too many angles none may be far off."""
    with ffrobot.solve(four_bar(space, STARTS[start])) as found:
        near = 0.1 if start == "all" else 1e-9
        if start != "rocker":  # which stands like this at two angles of the crank
            assert found["run/joints/A/coordinate"][0] == pytest.approx(A, abs=near)
            assert found["run/joints/A/rate"][0] == pytest.approx(RATE, abs=1e-9)
        if start != "all":
            assert found["run/joints/D/coordinate"][0] == pytest.approx(rocker()[0], abs=1e-9)
            assert found["run/joints/D/rate"][0] == pytest.approx(rocker()[1], abs=1e-8)
        assert not found.warnings


@pytest.mark.parametrize("initial", [{"joints": {"A": A, "D": 2.4}}, {"joint_rates": {"A": RATE, "D": 5.0}}])
def test_values_that_no_loop_meets_are_told(initial):
    with pytest.warns(ffrobot.FfrobotWarning, match='joints "A".* start away from the values'):
        ffrobot.solve(four_bar("spatial", {"joints": {"A": A}} | initial))
