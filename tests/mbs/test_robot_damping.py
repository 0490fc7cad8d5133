"""Damping ratios of an assembled robot: of its links' modes, and those that `of = "robot"` asks for."""

import numpy as np
import pytest
from beam_links import beam_link, tube
from tables_3d import ORIGIN, joint, revolute, rigid, scene

import ffrobot
from ffrobot.common.errors import InputError
from ffrobot.run.solve import prepare_scene

RATIO = 0.01
AT_REST = {"name": "at_rest", "kind": "linear"}


def link(name, condition, of):
    """A steel tube of 1 m."""
    return beam_link(
        1.0, tube(0.03, 0.024), 20, E=2.068e11, nu=0.3, rho=7850.0, condition=condition, name=name,
        modes={"family": "all", "count": 6}, damping={"ratio": RATIO, "of": of},
    )  # fmt: skip


def vibrations_of(tables):
    """Frequencies (Hz) and damping ratios of the linear model of a scene, without rigid motion."""
    with ffrobot.solve(ffrobot.make_scene(**tables)) as results:
        frequency, ratio = (results[f"at_rest/linear/{key}"][0] for key in ("frequency", "damping_ratio"))
    return frequency[frequency > 0.0], ratio[frequency > 0.0]


def test_a_clamped_link_vibrates_in_its_modes():
    """With the ratio that they have."""
    arm = [{"name": "arm", "link": link("arm", "cantilever", "link")}]
    tables = scene(arm, [joint("clamp", "weld", "ground", "arm.root")], AT_REST, gravity=ORIGIN)
    np.testing.assert_allclose(vibrations_of(tables)[1], RATIO, rtol=1e-9)


SIDES = ("simply-supported", "cantilever")


def arm_in_3d(conditions, of):
    """Yaw, pitch and, with two links, pitch; tubes that bend in both planes, stretch and twist."""
    links = [
        {"name": name, "link": link(name, condition, of)}
        for name, condition in zip(("upper", "fore"), conditions, strict=False)
    ]
    column = rigid("column", 5.0, (0.05, 0.05, 0.02), [0.0, 0.0, 0.15], top=[0.0, 0.0, 0.3])
    hinges = [revolute("waist", "column.top", "upper.root", [0, -1, 0]),
              revolute("elbow", "upper.tip", "fore.root", [0, -1, 0])][: len(links)]  # fmt: skip
    load = {"point": f"{links[-1]['name']}.tip", "center": [0.0, 0.05, 0.02]}
    return scene(
        [column, *links], [revolute("turn", "ground", "column.root"), *hinges], AT_REST, gravity=ORIGIN,
        payload=[load | {"mass": 1.0, "inertia": [1e-3, 2e-3, 2e-3]}],
        initial={"joints": {"turn": 0.3, "waist": 0.7} | ({"elbow": -1.1} if len(links) > 1 else {})},
    )  # fmt: skip


def test_a_robot_has_one_ratio():
    tables = arm_in_3d(SIDES, "robot")
    tables["body"][1]["link"]["damping"]["ratio"] = [0.1] * 6
    with pytest.raises(InputError, match='damping: expected one ratio, with of = "robot"'):
        prepare_scene(ffrobot.make_scene(**tables))


@pytest.mark.parametrize("condition", SIDES)
def test_one_flexible_link_has_the_ratio_in_all_its_vibrations(condition):
    """Bent, twisted and stretched at once by a payload beside its axis, on joints and bodies that move with it."""
    _, ratio = vibrations_of(arm_in_3d([condition], "robot"))
    _, of_link = vibrations_of(arm_in_3d([condition], "link"))
    np.testing.assert_allclose(ratio, RATIO, rtol=1e-6)
    assert np.abs(of_link[:6] / RATIO - 1).max() > 0.3


def test_a_slender_link_on_a_stout_one():
    """The square of the highest frequency is 2e10 times that of the lowest: slow vibrations are damped all the same."""
    arm = arm_in_3d(SIDES[1:] * 2, "robot")
    for body, length, diameter in zip(arm["body"][1:], (0.1, 1.0), (0.05, 0.004), strict=True):
        section = {"shape": "circle", "diameter": diameter}
        body["link"]["geometry"] = body["link"]["geometry"] | {"length": length, "section": section}
    frequency, ratio = vibrations_of(arm)
    assert (frequency[-1] / frequency[0]) ** 2 > 1e10
    np.testing.assert_allclose(ratio[:6], RATIO, rtol=1e-3)


def test_ratios_of_two_links_do_not_depend_on_their_frames():
    """Damping between links is left out: of two vibrations that twist the same link one gets more, the other less."""
    (_, first), (_, second) = (vibrations_of(arm_in_3d(sides, "robot")) for sides in (SIDES, SIDES[1:] * 2))
    np.testing.assert_allclose(second[:8], first[:8], rtol=5e-3)
    assert 0.6 * RATIO < first[:8].min() < first[:8].max() < 2.0 * RATIO
    _, of_links = vibrations_of(arm_in_3d(SIDES, "link"))
    assert of_links[:8].min() < 0.3 * RATIO
