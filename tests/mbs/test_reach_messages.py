"""What a path out of reach, guesses in degrees, and paths that leave the robot free are told."""

import tomllib

import numpy as np
import pytest

from ffrobot.common.errors import InputError
from ffrobot.run.solve import solve
from ffrobot.scene.load import make_scene

ROD = {"mass": 2.0, "inertia": 0.2, "center": [0.35, 0.0], "points": {"root": [0.0, 0.0], "tip": [0.7, 0.0]}}
JOINTS = [
    {"name": "O", "type": "revolute", "between": ["ground", "a.root"], "at": [0.1, 0.2]},
    {"name": "A", "type": "revolute", "between": ["a.tip", "b.root"]},
]


def arm(path, angles, joints=JOINTS):
    """Two rods of 0.7 m on the ground at (0.1, 0.2) whose tip follows `path`."""
    analysis = [{"name": name, "kind": "pcid", "end": 0.1, "output_step": 0.01} for name in ("inverse", "again")]
    return make_scene(
        name="rods", gravity=[0.0, 0.0], body=[{"name": name, "rigid": ROD} for name in "ab"], joint=joints,
        trajectory=[{"name": "tip", "point": "b.tip"} | path], initial={"angles": angles}, analysis=analysis,
    )  # fmt: skip


BENT = {"a": 0.3, "b": 1.2}


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ({"x": "750", "y": "250"}, f'it is {np.hypot(749.9, 249.8):.4g} m from joint "O" on the ground, from which the'
                                   ' links reach 1.4 m: are these m? (mm are written "750*mm")'),
        ({"x": "1.4", "y": "1.2"}, f'it is {np.hypot(1.3, 1.0):.4g} m from joint "O" on the ground, from which the'
                                   " links reach 1.4 m"),
        ({"x": "-1.6"}, 'it is 1.7 m along x from joint "O" on the ground, from which the links reach 1.4 m'),
    ],
)  # fmt: skip
def test_a_target_out_of_reach_is_told_with_distance_and_reach(path, said):
    with pytest.raises(InputError) as caught:
        solve(arm(path, BENT))
    assert said in str(caught.value)
    assert ("are these m?" in str(caught.value)) == ("are these m?" in said)


def test_a_reach_that_a_slide_leaves_open_is_not_told():
    slide = {"name": "O", "type": "prismatic", "between": ["ground", "a.root"], "axis": [0.0, 1.0]}
    with pytest.raises(InputError, match="within reach") as caught:
        solve(arm({"x": "3", "y": "0"}, BENT, [slide, JOINTS[1]]))
    assert "links reach" not in str(caught.value)


def test_guesses_that_work_are_named():
    """A straight arm in line with its target is at a dead centre; from what the message says it is reached."""
    with pytest.raises(InputError, match=r"from \[initial\] angles = \{ a = .* \}, for one, it goes") as caught:
        solve(arm({"x": "0.7", "y": "0.2"}, {}))
    text = str(caught.value)
    angles = tomllib.loads(text[text.index("angles = {") : text.index("}") + 1])["angles"]
    tip = solve(arm({"x": "0.7", "y": "0.2"}, angles)).outcomes["inverse"]
    theta = tip.q[0, [2, 5]]
    np.testing.assert_allclose(0.7 * np.cos(theta).sum() + 0.1, 0.7, atol=1e-9)
    np.testing.assert_allclose(0.7 * np.sin(theta).sum() + 0.2, 0.2, atol=1e-9)
    with pytest.raises(InputError, match="within reach") as caught:
        solve(arm({"x": "5", "y": "0"}, BENT))
    assert "it goes" not in str(caught.value)


def test_guesses_beyond_a_turn_are_warned_of_once():
    """60 and −20 for degrees: another branch is found, or none."""
    degrees = {"a": 60.0, "b": -20.0}
    solution = solve(arm({"x": "0.9 + 0.1*t", "y": "0.5"}, degrees))
    texts = solution.analyses["inverse"].warnings
    assert 'initial.angles: a = 60 rad is more than a turn (degrees are written "60*deg")' in texts
    assert 'initial.angles: b = -20 rad is more than a turn (degrees are written "-20*deg")' in texts
    assert not any("initial.angles" in text for text in solution.analyses["again"].warnings)
    right = solve(arm({"x": "0.9 + 0.1*t", "y": "0.5"}, BENT))
    assert not any("initial.angles" in text for text in right.analyses["inverse"].warnings)
    with pytest.raises(InputError, match=r"within reach.* a = 60 rad is more than a turn"):
        solve(arm({"x": "5", "y": "0"}, degrees))


@pytest.mark.parametrize(("path", "held"), [({"y": "0.5 + 0.1*t"}, 1), ({"x": "0.9 + 0.1*t", "y": "0.5"}, 2)])
def test_degrees_of_freedom_that_no_trajectory_holds_are_warned_of(path, held):
    texts = solve(arm(path, BENT)).analyses["inverse"].warnings
    said = [text for text in texts if "degrees of freedom" in text]
    assert len(said) == 2 - held
    assert all(text.startswith("trajectories prescribe 1 of 2 degrees of freedom") for text in said)
