"""Forward runs of a four-bar from the angle and the rate of its crank, or of its rocker: the other joints follow."""

import pytest
from four_bar import SIDES, closed, in_3d, planar

import ffrobot

A, RATE, STEP = 1.0, 3.0, 1e-5
D, D_RATE = closed(A)["D"], RATE * (closed(A + STEP)["D"] - closed(A - STEP)["D"]) / (2 * STEP)
RUN = {"name": "run", "kind": "forward", "end": 0.01, "output_step": 0.01}
SPACES = {"planar": planar, "spatial": in_3d}
STARTS = {
    "joints": {"joints": {"A": A}, "joint_rates": {"A": RATE}},
    "bodies": {"angles": {"crank": A}, "rates": {"crank": RATE}},
    "rocker": {"joints": {"D": D}, "joint_rates": {"D": D_RATE}},
    "all": {"joints": {"A": A, "B": -0.5, "D": 1.4}, "joint_rates": {"A": RATE}},
}


def started(space, initial):
    tables = SPACES[space]({name: {} for name in SIDES}, [RUN], trajectory=[])
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


@pytest.mark.parametrize("initial", [{"joints": {"A": A, "D": 2.4}}, {"joint_rates": {"A": RATE, "D": 5.0}}])
def test_values_that_no_loop_meets_are_told(initial):
    with pytest.warns(ffrobot.FfrobotWarning, match='joints "A".* start away from the values'):
        started("spatial", {"joints": {"A": A}} | initial)
