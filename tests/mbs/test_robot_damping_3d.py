"""Damping ratios wanted of an assembled robot (`of = "robot"`) in 3D: those asked for."""

import numpy as np
import pytest
from damped_arms import RATIO, link, vibrations_of

TUBE = {"shape": "tube", "outer": 0.03, "inner": 0.024}
SIDES = ("simply-supported", "cantilever")


def arm_in_3d(conditions, of):
    """Yaw, pitch and, with two links, pitch; tubes that bend in both planes, stretch and twist."""
    modes = {"family": "all", "count": 6}
    points = {"root": [0.0, 0.0, 0.0], "top": [0.0, 0.0, 0.3]}
    column = {"mass": 5.0, "center": [0.0, 0.0, 0.15], "inertia": [0.05, 0.05, 0.02], "points": points}
    names = ("upper", "fore")[: len(conditions)]
    between = (("waist", "column.top", "upper.root"), ("elbow", "upper.tip", "fore.root"))
    return {
        "name": "arm",
        "space": "spatial",
        "gravity": [0.0, 0.0, 0.0],
        "body": [
            {"name": "column", "rigid": column},
            *({"name": n, "link": link(n, c, of, TUBE, **modes)} for n, c in zip(names, conditions, strict=True)),
        ],
        "joint": [
            {"name": "turn", "type": "revolute", "between": ["ground", "column.root"], "axis": [0.0, 0.0, 1.0]},
            *(
                {"name": name, "type": "revolute", "between": sides, "axis": [0.0, -1.0, 0.0]}
                for name, *sides in between[: len(conditions)]
            ),
        ],
        "payload": [
            {"point": f"{names[-1]}.tip", "mass": 1.0, "center": [0.0, 0.05, 0.02], "inertia": [1e-3, 2e-3, 2e-3]}
        ],
        "initial": {"joints": {"turn": 0.3, "waist": 0.7} | ({"elbow": -1.1} if len(conditions) > 1 else {})},
        "analysis": [{"name": "at_rest", "kind": "linear"}],
    }


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
