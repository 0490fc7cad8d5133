"""Residual vibration and settling: closed forms of one axis with a compliant gear, and of a link that bends."""

import csv

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from scenes_in_3d import write
from tables_3d import ORIGIN, revolute, rigid, scene

import ffrobot as program
from ffrobot import InputError, Results
from ffrobot.design.responses import parse_response

INERTIA, K, LENGTH, WAY = 0.3, 500.0, 0.5, 0.7
OMEGA = np.sqrt(K / INERTIA)
AVERAGED = {"trapezoid": np.array([2, 1]) / 3, "s-curve": np.array([4, 2, 1]) / 7}


def axis(duration, *, damping=0.0, step=0.01, settled=1e-4, **path):
    """A body behind a compliant gear whose motor turns by `WAY` rad in `duration` s."""
    joint = revolute(
        "hub", "ground", "b.root", [0.0, 0.0, 1.0], stiffness=K, damping=damping, gear_ratio=9.0, rotor_inertia=1e-4
    )
    return scene(
        [rigid("b", 1.0, [INERTIA] * 3, ORIGIN, tip=[LENGTH, 0.0, 0.0])],
        [joint],
        {"name": "run", "kind": "pcid", "end": 1.5, "settled": settled, "output_step": step, "tolerance": 1e-9},
        gravity=ORIGIN,
        trajectory=[{"name": "turn", "motor": "hub", "via": [0.0, WAY], "duration": duration} | path],
    )


def settled(tables, point="run/settling/b.tip"):
    with program.solve(program.make_scene(**tables)) as results:
        return dict(results.attributes(point))


def amplitude(profile, duration, omega=OMEGA):
    """Of the body: |∫ θ̇ e^{−iωt} dt| of a step averaged over times T_i, a product of sin(ωT/2)/(ωT/2)."""
    return WAY * np.prod(np.abs(np.sinc(omega * duration * AVERAGED[profile] / (2 * np.pi))))


def swing(angle):
    """Peak to peak (m) of the tip of a body that swings by ± `angle`."""
    return 2 * LENGTH * np.sin(angle)


@pytest.mark.parametrize("profile", AVERAGED)
@pytest.mark.parametrize("duration", [0.4, 0.53])
def test_residual_of_a_trapezoid_and_of_an_s_curve(profile, duration):
    about = settled(axis(duration, profile=profile, settled=1e-9))
    assert about["residual"] == pytest.approx(swing(amplitude(profile, duration)), rel=1e-4)
    assert about["frequency"] == pytest.approx(OMEGA / (2 * np.pi), rel=1e-6)
    assert about["path_end"] == pytest.approx(duration, rel=1e-12)
    assert np.isnan(about["time_to"])


@pytest.mark.parametrize("off", [1.0, 0.9, 1.2])
def test_a_zv_shaper_leaves_the_cosine_of_its_delay(off):
    """Two halves of the motion, half a period 1/(2 f) apart: |cos(ω/(4 f))|; nothing where f is right."""
    shaper = {"kind": "zv", "frequency": off * OMEGA / (2 * np.pi)}
    about, bare = settled(axis(0.4, profile="s-curve", shaper=shaper)), amplitude("s-curve", 0.4)
    expected = swing(bare * abs(np.cos(np.pi / (2 * off))))
    assert about["residual"] == pytest.approx(expected, rel=1e-4, abs=1e-8)
    assert about["path_end"] == pytest.approx(0.4 + np.pi / OMEGA / off, rel=1e-9)


def test_a_damped_axis_settles_at_the_time_of_the_closed_form_whatever_the_outputs():
    """ë + 2ζω ė + ω² e = −θ̈, constant by pieces: e is the imaginary part of a sum of exponentials of one pole."""
    duration, damping, tolerance = 0.4, 1.0, 2e-3
    decay = damping / (2 * INERTIA)
    pole = complex(-decay, np.sqrt(OMEGA**2 - decay**2))
    first, second = duration * AVERAGED["trapezoid"]
    pieces = [(0.0, second, 1.0), (first, first + second, -1.0)]

    def twist(t):
        parts = (sign * (np.exp(pole * (t - a)) - np.exp(pole * (t - b))) / pole for a, b, sign in pieces)
        return -WAY / (first * second) * (sum(parts) / pole.imag).imag

    def off(t):
        return 2 * LENGTH * np.abs(np.sin(twist(t) / 2))

    times = np.linspace(duration, 1.5, 2_000_001)
    last = times >= 1.5 - 2 * np.pi / OMEGA
    expected = {
        "at_path_end": off(duration), "at_end": off(1.5),
        "residual": 2 * LENGTH * np.sin(np.ptp(twist(times[last])) / 2),
        "time_to": times[off(times) > tolerance][-1] - duration,
    }  # fmt: skip
    for step in (0.001, 0.25):
        about = settled(axis(duration, damping=damping, step=step, settled=tolerance, profile="trapezoid"))
        for key, value in expected.items():
            assert about[key] == pytest.approx(value, rel=1e-4), (step, key)


def test_residual_and_settling_are_responses(tmp_path, ffrobot):
    """Columns of a sweep by the closed form; a point that does not settle takes as long as the run leaves it."""
    path = write(axis(0.4, profile="trapezoid"), tmp_path / "scene.toml")
    stiffnesses, responses = (500.0, 700.0), ("--collect", "residual b.tip", "--collect", "settling run/b.tip")
    ffrobot.ok("sweep", path, "--vary", "joint.hub.stiffness=500,700", *responses, "-o", tmp_path / "out")
    rows = list(csv.DictReader((tmp_path / "out/table.csv").read_text().splitlines()))
    for row, stiffness in zip(rows, stiffnesses, strict=True):
        expected = swing(amplitude("trapezoid", 0.4, np.sqrt(stiffness / INERTIA)))
        assert float(row["residual b.tip"]) == pytest.approx(expected, rel=1e-4)
        assert row["settling run/b.tip"].lower() in ("", "nan")
    with Results(next((tmp_path / "out").rglob("*.h5"))) as results:
        found = parse_response("settling b.tip").read(results)
        assert found.value == pytest.approx(1.1, rel=1e-12)
        assert "not settled" in found.doubt
        with pytest.raises(InputError, match=r'"run/b\.tip", found "b\.top"'):
            parse_response("residual b.top").read(results)


def soft_arm(path, *analyses, pieces=1, **tables):
    """An arm on a motor, whose path takes keys."""
    link = beam_link(0.6, rectangle(0.004, 0.02), 12, modes={"count": 3, "family": "in-plane-bending"})
    joint = {"name": "hub", "type": "revolute", "between": ["ground", "arm.root"], "gear_ratio": 100.0}
    return {
        "name": "arm", "gravity": [0.0, 0.0], "body": [{"name": "arm", "link": link, "pieces": pieces}],
        "joint": [joint | {"rotor_inertia": 1e-3}], "initial": {"state": "static"},
        "trajectory": [{"name": "swing", "joint": "hub"} | path], "analysis": list(analyses),
    } | tables  # fmt: skip


@pytest.mark.parametrize("pieces", [1, 2])
def test_a_turned_beam_rings_as_the_first_mode_of_a_cantilever_whole_or_in_pieces_or_replayed(pieces):
    """ω = β² √(E I/(ρ A L⁴)); the tip swings by 4 L/β² |∫ θ̇ e^{−iωt} dt|, β = 1.8751: ∫ x φ dx = 2 (L/β)², φ(L) = 2."""
    way, beta = 0.02, 1.8751040687
    inverse = {"name": "pcid", "kind": "pcid", "end": 0.7, "output_step": 0.01, "tolerance": 1e-6}
    replay = {"name": "forward", "kind": "forward", "actuation": "pcid", "apply": "joints", "tolerance": 1e-6}
    path = {"via": [0.0, way], "profile": "s-curve", "duration": 0.25}
    omega = (beta / 0.6) ** 2 * np.sqrt(70e9 / 2700 / 12) * 0.004
    expected = 2 * 4 * 0.6 / beta**2 * amplitude("s-curve", 0.25, omega) * way / WAY
    with program.solve(program.make_scene(**soft_arm(path, inverse, replay, pieces=pieces))) as results:
        for kind in results.analyses:
            about = results.attributes(f"{kind}/settling/arm.tip")
            assert about["frequency"] == pytest.approx(omega / (2 * np.pi), rel=1e-4), kind
            assert about["residual"] == pytest.approx(expected, rel=2e-3), kind
            assert parse_response(f"residual {kind}/arm.tip").read(results).value == about["residual"]
        whole = [results.attributes(f"{kind}/settling/arm.tip")["residual"] for kind in ("pcid", "forward")]
        assert whole[1] == pytest.approx(whole[0], rel=1e-5)


@pytest.mark.parametrize("share", [0.95, 1.05])
def test_nothing_vibrates_under_more_than_the_load_of_euler(share):
    """An upright link that is held straight: π² E I/(4 L²) at its tip is what it would carry without that."""
    straight = {"name": "fcid", "kind": "fcid", "shape": "zero", "end": 3.0, "output_step": 0.1}
    load = np.pi**2 * 70e9 * 0.02 * 0.004**3 / 12 / (4 * 0.6**2)
    keys = {"payload": [{"point": "arm.tip", "mass": share * load / 9.81}], "geometric_stiffening": True}
    tables = soft_arm({"via": ["70*deg", "90*deg"], "duration": 0.4}, straight, gravity=[0.0, -9.81], **keys)
    frequency = settled(tables, "fcid/settling/arm.tip")["frequency"]
    assert np.isnan(frequency) if share > 1 else 0 < frequency < 1
