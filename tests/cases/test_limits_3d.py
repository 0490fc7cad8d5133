"""Limits of positions, told of whole runs in 3D: of what joints do between outputs, too."""

import numpy as np
import pytest

import ffrobot

BOX = {"mass": 1.0, "center": [0.0, 0.0, 0.0], "inertia": [0.02, 0.03, 0.04], "points": {"in": [0.0, 0.0, 0.0]}}


def told(joint, analysis, **others):
    scene = ffrobot.make_scene(
        name="box", space="spatial", body=[{"name": "box", "rigid": BOX}], joint=[{"name": "j"} | joint],
        analysis=[{"name": "a", "tolerance": 1e-9} | analysis], **{"gravity": [0.0, 0.0, 0.0]} | others,
    )  # fmt: skip
    with ffrobot.solve(scene) as results:
        return [text.partition("leaves its ")[2] for text in results.warnings.get("a", ()) if "leaves its" in text]


@pytest.mark.parametrize("kind", [{"kind": "pcid"}, {"kind": "fcid", "shape": "zero"}], ids=["pcid", "fcid"])
@pytest.mark.parametrize("backwards", [False, True])
def test_an_excursion_between_two_outputs(backwards, kind):
    """A pulse of the path whose flanks alone are outputs; the coordinate of the joint is that of the scene."""
    between = ["box.in", "ground"] if backwards else ["ground", "box.in"]
    joint = {"type": "revolute", "between": between, "axis": [0.0, 1.0, 0.0], "position_limit": [0.0, 0.65]}
    path = {"name": "turn", "joint": "j", "value": "0.5 + 0.3*exp(-((t - 0.25)/0.05)**2)"}
    analysis = kind | {"end": 0.5, "output_step": 0.1}
    (text,) = told(joint, analysis, trajectory=[path], initial={"joints": {"j": 0.5}})
    begin, _, rest = text.partition(" s; ")
    assert rest == "it goes from 0.5 to 0.8 rad"
    left_at = float(begin.removeprefix("position_limit [0, 0.65] rad at t = "))
    within = 1e-6 if kind["kind"] == "pcid" else 0.5 / 2000  # integration finds the instant, others the time looked at
    assert left_at == pytest.approx(0.25 - 0.05 * np.sqrt(np.log(2.0)), abs=within)
    kept = joint | {"position_limit": [0.499, 0.801]}
    assert not told(kept, analysis, trajectory=[path], initial={"joints": {"j": 0.5}})


def test_an_equilibrium_beyond_a_limit():
    joint = {"type": "prismatic", "between": ["ground", "box.in"], "axis": [1.0, 0.0, 0.0]}
    joint |= {"position_limit": [0.0, 1.0]}
    path = {"name": "way", "joint": "j", "value": "1.5"}
    (text,) = told(joint, {"kind": "static"}, trajectory=[path])
    assert text == "position_limit [0, 1] m at t = 0 s; it goes from 1.5 to 1.5 m"


FALL = {"kind": "forward", "end": 0.6, "output_step": 0.1}


def test_one_side_is_left():
    joint = {"type": "prismatic", "between": ["ground", "box.in"], "axis": [1.0, 0.0, 0.0]}
    limited = joint | {"position_limit": [-0.1, 9.0]}
    (text,) = told(limited, FALL, gravity=[-1.0, 0.0, 0.0])
    assert text == f"position_limit [-0.1, 9] m at t = {np.sqrt(0.2):.6g} s; it goes from -0.18 to 0 m"
    assert not told(limited, FALL, gravity=[1.0, 0.0, 0.0])


@pytest.mark.parametrize(("backwards", "left_at"), [(False, np.sqrt(0.2)), (True, 0.5)])
def test_planar_joints_that_lead_backwards_are_looked_at_in_outputs(backwards, left_at):
    """Their ways turn with the body: no entries of the state."""
    between, far = (["box.in", "ground"], [-0.3, 0.1]) if backwards else (["ground", "box.in"], [-0.1, 0.3])
    limits = [far, [-1.0, 1.0], [-1.0, 1.0]]
    joint = {"type": "planar", "between": between, "axis": [0.0, 0.0, 1.0], "position_limit": limits}
    (text,) = told(joint, FALL, gravity=[-1.0, 0.0, 0.0])
    assert f"m at t = {left_at:.6g} s; it goes from" in text
