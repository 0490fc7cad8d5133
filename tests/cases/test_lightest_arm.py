"""The lightest arm: tubes that `ffrobot optimise` finds, by the condition of an optimum, and as solids from STEP."""

import re

import numpy as np
import pytest

import ffrobot

DENSITY, OUTER = 2700.0, 0.04
LENGTHS = {"upper_arm": 0.5, "forearm": 0.4}
CHOSEN = {"upper_arm": 0.0329, "forearm": 0.0372}  # m, holes as make_parts.py draws them
IN_SPACE = {"upper_arm": 0.0312, "forearm": 0.0368}  # of space.toml
MOTOR = 8.0  # N·m, RMS, of the shoulder
TIP = {"scene": 4e-4, "space": 6e-4}  # m, RMS


def tube_mass(name, inner):
    return DENSITY * LENGTHS[name] * np.pi / 4 * (OUTER**2 - inner**2)


def with_holes(folder, holes):
    """Holes of the tubes in the link files of a copy of the case."""
    for name, inner in holes.items():
        link = folder / f"{name}.toml"
        text = re.sub(r"inner = [\d.]+", f"inner = {inner!r}", link.read_text(encoding="utf-8"))
        link.write_text(text, encoding="utf-8")


def tip_error(scene):
    """RMS of the closed loop, m, and of the shoulder's moment, N·m."""
    with ffrobot.solve(scene) as results:
        assert results.attributes("held/control")["verdict"] == "stable"
        error, moment = results["held/tip_error"], results["held/joints/shoulder/moment"]
    return np.sqrt(np.mean(error**2)), np.sqrt(np.mean(moment**2))


@pytest.fixture
def arm(case_copy):
    return case_copy("lightest_arm").parent


@pytest.mark.nightly
def test_the_chosen_tubes_are_at_the_optimum(arm):
    """What is found keeps the limit to 1e-6, and trades walls alike: a tip error that bending alone makes is
    a/I₁ + b/I₂ with moments of area I, b/I₂ found by a run with another forearm; dm/dI over dε/dI is the same for both.
    """
    vary = [f"links.{name}.geometry.section.inner=0.02:0.0385" for name in LENGTHS]
    found = ffrobot.optimise(
        arm / "scene.toml", vary, minimise="mass",
        subject_to=[f"rms held.tip_error <= {TIP['scene']}", f"rms held.joints.shoulder.moment <= {MOTOR}"],
    )  # fmt: skip
    assert found.converged
    assert found.feasible
    assert found.limits[0] == pytest.approx(TIP["scene"], rel=2e-6)
    assert found.limits[1] < MOTOR
    holes = dict(zip(LENGTHS, found.values, strict=True))
    assert found.value == pytest.approx(sum(tube_mass(*one) for one in holes.items()), rel=1e-9)
    for name, inner in holes.items():
        assert 0.0 <= inner - CHOSEN[name] < 1e-4  # rounded down to 0.1 mm
    slopes = {}
    for name, inner in holes.items():
        with_holes(arm, holes | {name: inner * 1.002})
        wide, _ = tip_error(arm / "scene.toml")
        with_holes(arm, holes | {name: inner * 0.998})
        narrow, _ = tip_error(arm / "scene.toml")
        slopes[name] = (wide - narrow) / (tube_mass(name, inner * 0.998) - tube_mass(name, inner * 1.002))
    # Central differences of 0.2 % of the hole are off by 1e-3; at the optimum one kg buys the same in both tubes.
    assert slopes["upper_arm"] == pytest.approx(slopes["forearm"], rel=0.01)


@pytest.mark.parametrize("scene", TIP)
def test_chosen_tubes_keep_the_limits(arm, scene):
    with_holes(arm, CHOSEN if scene == "scene" else IN_SPACE)
    error, moment = tip_error(arm / f"{scene}.toml")
    # 0.1 mm of each hole is worth 1.3 % of the tip error.
    assert 0.985 * TIP[scene] < error < TIP[scene]
    assert moment < MOTOR
