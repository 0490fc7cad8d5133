"""Free joints at points of links that modes move: their coordinates are those of the section."""

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from scipy.spatial.transform import Rotation

import ffrobot

LENGTH = 0.6
LINK = beam_link(LENGTH, rectangle(0.008, 0.02), 8, nu=0.3, modes={"count": 5, "family": "all"})  # fmt: skip
VELOCITY, SPIN = np.array([0.3, -0.2, 0.5]), np.array([4.0, 1.0, -2.0])
LOADS = [{"point": "link.tip", "z": "3*sin(40*t)", "mx": "0.1"}, {"point": "link.root", "y": "-0.5"}]


def thrown(point, arm, **more):
    """A link that bends and twists, thrown at t = 0, with a free joint at a point, `arm` (m) from the root along x."""
    place = [arm, 0.0, 0.0]
    rates = [*(VELOCITY + np.cross(SPIN, place)).tolist(), *SPIN.tolist()]
    return ffrobot.solve(
        ffrobot.make_scene(
            name="thrown", space="spatial", gravity=[0.0, 0.0, -9.81], body=[{"name": "link", "link": LINK}],
            joint=[{"name": "hand", "type": "free", "between": ["ground", f"link.{point}"]}], load=LOADS,
            initial={"state": "undeformed", "joints": {"hand": [*place, 0.0, 0.0, 0.0]},
                     "joint_rates": {"hand": rates}},
            analysis=[{"name": "flight", "kind": "forward", "end": 0.1, "output_step": 0.005, "tolerance": 1e-10}
                      | more],
        )
    )  # fmt: skip


@pytest.mark.parametrize("integrator", ["dop853", pytest.param("radau", marks=pytest.mark.nightly)])
def test_a_link_flies_the_same_whichever_section_has_the_joint(integrator):
    """Modes of the clamped link move the tip, not the root: one flight in two sets of coordinates."""
    of_root = thrown("root", 0.0)
    of_tip = thrown("tip", LENGTH, integrator=integrator)
    for point in ("root", "tip"):
        name = f"flight/points/link.{point}/position"
        np.testing.assert_allclose(of_tip[name], of_root[name], rtol=0, atol=1e-8)
    for name in ("flight/bodies/link/modal", "flight/points/link.tip/quaternion", "flight/energy/strain"):
        expected = of_root[name]
        np.testing.assert_allclose(of_tip[name], expected, rtol=0, atol=1e-8 * (1 + np.abs(expected).max()))
    assert np.abs(of_root["flight/points/link.tip/deflection"]).max() > 1e-3


@pytest.mark.parametrize("kind", ["free", "spherical"])
@pytest.mark.parametrize("between", ["ground", "base.end"])
def test_angular_velocities_are_given_in_axes_of_the_second_side(kind, between):
    """ω = A times the rates, of A = A₁ exp(vector) R with R of `rpy`; A₁ is that of a base turned by a weld."""
    rigid = {"mass": 1.0, "center": [0.0, 0.0, 0.0], "inertia": [0.1, 0.2, 0.25], "points": {"end": [0.0, 0.0, 0.0]}}
    straight = [] if kind == "spherical" else [0.0, 0.0, 0.0]
    joint = {"name": "hand", "type": kind, "between": [between, "box.end"], "rpy": [0.3, -0.2, 0.5]}
    turned = {"name": "fixed", "type": "weld", "between": ["ground", "base.end"], "rpy": [0.7, 0.4, -1.1]}
    scene = ffrobot.make_scene(
        name="turned", space="spatial", gravity=[0.0, 0.0, 0.0],
        body=[{"name": "base", "rigid": rigid}, {"name": "box", "rigid": rigid}], joint=[turned, joint],
        initial={"joints": {"hand": [*straight, 1.9, 2.1, -0.3]}, "joint_rates": {"hand": [*straight, *SPIN.tolist()]}},
        analysis=[{"name": "spin", "kind": "forward", "end": 0.01, "output_step": 0.01}],
    )  # fmt: skip
    found = ffrobot.solve(scene)
    A = Rotation.from_euler("xyz", joint["rpy"])
    A = Rotation.from_rotvec([1.9, 2.1, -0.3]) * A
    if between != "ground":
        A = Rotation.from_euler("xyz", turned["rpy"]) * A
    quaternion = np.roll(found["spin/bodies/box/quaternion"][0], -1)
    np.testing.assert_allclose(Rotation.from_quat(quaternion).as_matrix(), A.as_matrix(), atol=1e-14)
    np.testing.assert_allclose(found["spin/bodies/box/angular_velocity"][0], A.apply(SPIN), atol=1e-13)
