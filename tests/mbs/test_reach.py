"""What a path out of reach and guesses that do not work are told in 3D."""

import tomllib

import numpy as np
import pytest
from tables_3d import ORIGIN, Y, revolute, rigid, scene

import ffrobot
from ffrobot.common.errors import InputError

BODIES = [rigid("hub", **{"in": ORIGIN}),
          *(rigid(name, 2.0, (0.01, 0.2, 0.2), [0.35, 0.0, 0.0], tip=[0.7, 0.0, 0.0]) for name in "ab")]  # fmt: skip
JOINTS = [revolute("yaw", "ground", "hub.in", at=[0.1, 0.2, 0.3]),
          revolute("lift", "hub.in", "a.root", Y), revolute("elbow", "a.tip", "b.root", Y)]  # fmt: skip
DEAD_CENTER = {"x": "0.7", "y": "0.2", "z": "0.3"}  # of a straight arm in line with it, 0.632 m from the hub
BENT = {"yaw": 0.3, "lift": -0.4, "elbow": 1.2}


def arm(path, guess):
    """Two rods of 0.7 m on a turning hub at (0.1, 0.2, 0.3) whose tip follows `path`."""
    analysis = [{"name": name, "kind": "pcid", "end": 0.1, "output_step": 0.01} for name in ("inverse", "again")]
    tip = {"name": "tip", "point": "b.tip"} | path
    return ffrobot.make_scene(
        **scene(BODIES, JOINTS, *analysis, gravity=ORIGIN, trajectory=[tip], initial={"joints": guess})
    )


@pytest.mark.parametrize(
    ("path", "distance", "unit"),
    [
        ({"x": "750", "y": "250", "z": "30"}, np.sqrt(749.9**2 + 249.8**2 + 29.7**2), True),
        ({"x": "1.4", "y": "1.2", "z": "0"}, np.sqrt(1.3**2 + 1.0**2 + 0.3**2), False),
        ({"x": "-1.6"}, 1.7, False),
    ],
)
def test_a_target_out_of_reach_is_told_with_distance_and_reach(path, distance, unit):
    with pytest.raises(InputError) as caught:
        ffrobot.solve(arm(path, BENT))
    text, along = str(caught.value), " along x" if len(path) == 1 else ""
    assert 'trajectory "tip": expected a target within reach, found one' in text
    said = f'{distance:.4g} m{along} from joint "yaw" on the ground at t = 0 s, from which the links reach 1.4 m'
    assert said in text
    assert ("are these m?" in text) == unit


def test_a_path_that_leaves_the_reach_says_where():
    """1.3 + 2 t from the hub along x passes 1.4 m at t = 0.05 s, where the arm is stretched: nothing is integrated."""
    path = {"x": "1.4 + 2*t", "y": "0.2", "z": "0.3"}
    guess = {"lift": -np.arccos(1.3 / 1.4), "elbow": 2 * np.arccos(1.3 / 1.4)}
    with pytest.raises(InputError, match=r'found one that is 1\.4 m from joint "yaw" on the ground') as end:
        ffrobot.solve(arm(path, guess))
    time = float(str(end.value).split("t = ")[1].split(" s")[0])
    assert time == pytest.approx(0.05, abs=2e-4)


def test_guesses_that_work_are_named():
    """A straight arm in line with its target is at a dead center; from what the message says it is reached."""
    with pytest.raises(InputError, match=r"from \[initial\] joints = \{ yaw = .* \} it works") as caught:
        ffrobot.solve(arm(DEAD_CENTER, {"elbow": 0.0}))
    text = str(caught.value)
    guess = tomllib.loads(text[text.index("joints = {") : text.index("}") + 1])["joints"]
    with ffrobot.solve(arm(DEAD_CENTER, guess)) as results:
        np.testing.assert_allclose(results["inverse/points/b.tip/position"][0], [0.7, 0.2, 0.3], atol=1e-9)


def test_without_a_guess_a_singular_zero_is_left():
    """The same arm without any guess; the note after the run says where it starts. The tip is 0.632 m from the hub."""
    bend = 2 * np.arccos(0.3 / 0.7)
    for branch, sign in ({}, None), ({"elbow": "up"}, 1.0), ({"elbow": "down"}, -1.0):
        free = arm(DEAD_CENTER, {})
        free = free.model_copy(update={"initial": free.initial.model_copy(update={"branch": branch})})
        with ffrobot.solve(free) as results:
            np.testing.assert_allclose(results["inverse/points/b.tip/position"][0], [0.7, 0.2, 0.3], atol=1e-9)
            elbow = results["inverse/joints/elbow/coordinate"][0]
        assert abs(elbow) == pytest.approx(bend, rel=1e-6)
        assert sign is None or sign * elbow > 0


def test_guesses_beyond_a_turn_are_warned_of_once():
    path = {"x": "0.9 + 0.1*t", "y": "0.5", "z": "0.4"}
    with ffrobot.solve(arm(path, BENT)) as results:
        assert not any("more than a turn" in text for text in results.warnings.get("inverse", []))
    turns = BENT | {"yaw": 0.3 + 4 * np.pi}
    with ffrobot.solve(arm(path, turns)) as results:
        told = [text for text in results.warnings.get("inverse", []) if "more than a turn" in text]
        assert told == ['initial: yaw = 12.8664 rad is more than a turn (degrees are written "12.8664*deg")']
        assert not any("more than a turn" in text for text in results.warnings.get("again", []))
