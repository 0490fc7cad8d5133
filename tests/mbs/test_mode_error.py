"""Estimated errors: of modes, against links with many more; which loads are told to buckle a link."""

from dataclasses import replace

import numpy as np
import pytest
from beam_links import beam_link, rectangle, tube
from steel_arms import two_links

import ffrobot as library
from ffrobot.mbs.quantities.attachment_error import Start, mode_error, start_errors
from ffrobot.mbs.quantities.supply import motor_moments
from ffrobot.mbs.quantities.validity import ModalLoads, lasting, stiffness_change
from ffrobot.run.solve import solve_scene
from ffrobot.run.watcher import Watcher


def solved(scene, name="inverse"):
    return solve_scene(scene, Watcher()).analyses[name]


@pytest.mark.parametrize(
    ("payload", "rise", "state"), [(1.5, 1.0, "static"), (0.4, 0.6, "static"), (1.5, 1.0, "undeformed")]
)
def test_estimate_is_about_the_error_of_moments(payload, rise, state):
    """Within 0.2 and 5 times, for errors of 1e-6 at rest and of 5e-4 where links start unbent under their weight."""
    keys = {
        "payload": [{"point": "b.tip", "mass": payload}],
        "initial": {"state": state, "angles": {"a": 0.2, "b": -0.3}},
    }
    coarse, fine = (solved(two_links(modes, True, rise=rise, **keys), "swing") for modes in (4, 10))
    moments = [np.column_stack([motor_moments(of.run)[joint] for joint in "OA"]) for of in (coarse, fine)]
    errors = np.abs(moments[0] - moments[1]).max(axis=0) / np.abs(moments[1]).max(axis=0)
    assert 0.2 * errors.max() < coarse.mode_error < 5 * errors.max()
    assert (coarse.mode_error < 1e-5) == (state == "static")


def test_modes_that_ring_count_by_what_they_do():
    """Of a mode at ω, far above ω_k, p̈ = −ω² p says nothing of what modes between them leave out: p does."""
    run = solved(two_links(2, True), "swing").run
    node = run.model.tree.nodes[-1]
    body, t = node.body, np.linspace(0.0, 1.0, 2001)
    p, q, a = np.zeros((len(t), body.n_modes)), np.zeros((len(t), run.q.shape[1])), np.zeros((len(t), run.a.shape[1]))
    p[:, 0], p[:, -1] = 1.0, 1e-3 * np.cos(np.sqrt(body.stiffness[-1]) * t)
    q[:, node.p_q], a[:, node.p_v] = p, -body.stiffness * p
    share = 1e-3 * np.sqrt(body.stiffness[-1] / body.stiffness[0])
    assert mode_error(replace(run, q=q, a=a)) == pytest.approx(share / np.sqrt(1 + share**2), rel=1e-3)


def swung(angle, modes=1, damping=0.0, attachment_modes=False):
    """A cantilever whose root follows `angle`, without gravity."""
    link = beam_link(
        0.8, rectangle(0.012, 0.03), 40, E=2.1e11, nu=None, rho=7850.0, damping={"ratio": damping},
        modes={"count": modes, "family": "in-plane-bending", "attachment_modes": attachment_modes}
    )  # fmt: skip
    return library.make_scene(
        name="swung", space="planar", gravity=[0.0, 0.0], body=[{"name": "link", "link": link}],
        joint=[{"name": "O", "type": "revolute", "between": ["ground", "link.root"]}],
        initial={"state": "undeformed"}, trajectory=[{"name": "swing", "joint": "O", "value": angle}],
        analysis=[{"name": "inverse", "kind": "pcid", "end": 0.2, "output_step": 2e-4, "tolerance": 1e-9}],
    )  # fmt: skip


def test_half_of_what_bends_a_link_rings_where_its_acceleration_jumps():
    """A step bends it by p = p_s (1 − cos ω t) at first, 2 p_s at most, p_s from where it stands at the start."""
    assert solved(swung("0.5*t**2")).start_jolt == pytest.approx(0.5, rel=1e-3)
    assert solved(swung("40*t**5")).start_jolt < 1e-6


@pytest.mark.parametrize("angle", ["2*t**2", "where(t < 0.1, 0*t, 2*(t - 0.1)**2)"])
@pytest.mark.parametrize(("modes", "damping"), [(1, 0.005), (3, 0.0)])
def test_estimate_where_the_acceleration_jumps(angle, modes, damping):
    """Missing modes ring, and those that are there ring out of step: against eight modes, with and without damping."""
    coarse, fine = (solved(swung(angle, count, damping, attachment_modes=True)) for count in (modes, 8))
    torques = [motor_moments(of.run)["O"] for of in (coarse, fine)]
    error = np.abs(torques[0] - torques[1]).max() / np.abs(torques[1]).max()
    assert error > 1e-5
    assert 0.2 * error < coarse.mode_error < (10 if modes == 1 else 5) * error


def test_vibrations_get_out_of_step():
    """Of two oscillators without and with damping, by the exact phase of one whose second mode is slower."""
    K, late, T = np.array([100.0, 4e4]), np.array([0.0, 1e-5]), 0.7
    M, C_q, a = np.eye(2), np.zeros((0, 2)), np.array([0.0, 3.0])
    start = Start(M, C_q, a, K, np.zeros((2, 2)), late, largest=1.0, duration=T)
    slower = np.sqrt(K[1] / (1 + K[1] * late[1])) - np.sqrt(K[1])
    amplitude = 3.0 / np.sqrt(K[1])
    assert start_errors(start) == pytest.approx((amplitude, 2 * amplitude))  # opposite
    assert start_errors(start._replace(duration=1e-3))[1] == pytest.approx(amplitude * abs(slower) * 1e-3, rel=0.4)
    damped = start._replace(damping=np.diag([0.0, 2 * 500.0]))
    t = np.linspace(0.0, T, 20001)
    most = (np.exp(-500.0 * t) * t).max() * abs(slower)
    assert start_errors(damped)[1] == pytest.approx(amplitude * most, rel=0.4)


def test_bending_that_no_motor_feels_is_told_by_reactions():
    """An arm about the vertical that rings under its weight: against 12 modes, of which its motor feels a hundredth."""

    def upright(modes):
        families = ["in-plane-bending", "out-of-plane-bending"]
        link = beam_link(
            0.65, tube(0.018, 0.014), 20, E=2.1e11, nu=0.3, rho=7850.0,
            modes={"count": modes, "family": families, "attachment_modes": True}
        )  # fmt: skip
        joint = {"name": "O", "type": "revolute", "between": ["ground", "link.root"], "axis": [0.0, 0.0, 1.0]}
        path = "0.004*(10*(t/0.05)**3 - 15*(t/0.05)**4 + 6*(t/0.05)**5)"
        return library.make_scene(
            name="upright", space="spatial", gravity=[0.0, 0.0, -9.81], body=[{"name": "link", "link": link}],
            joint=[joint], payload=[{"point": "link.tip", "mass": 0.25}], initial={"state": "undeformed"},
            trajectory=[{"name": "swing", "joint": "O", "value": path}],
            analysis=[{"name": "inverse", "kind": "pcid", "end": 0.05, "output_step": 2e-4, "tolerance": 1e-8}],
        )  # fmt: skip

    coarse, fine = (solved(upright(modes)) for modes in (4, 12))
    found = [(of.reactions["O"].moment, motor_moments(of.run)["O"]) for of in (coarse, fine)]
    reaction, torque = (np.abs(a - b).max() / np.abs(b).max() for a, b in zip(*found, strict=True))
    assert 0.2 * reaction < coarse.mode_error < 5 * reaction
    assert torque < 0.01 * reaction


@pytest.mark.parametrize(("duration", "buckles"), [(1e-6, False), (0.05, False), (0.8, True), (20.0, True)])
def test_loads_shorter_than_a_vibration_buckle_no_link(duration, buckles):
    """1.5 times the load of Euler: a pulse buckles if its mean over the period, here 1 s, reaches that load."""
    time = np.unique(
        np.concatenate([np.linspace(0.0, 20.0, 2001), 5.0 + duration * np.array([0.0, 1e-9, 1 - 1e-9, 1])])
    )
    stiffness = np.array([(2 * np.pi) ** 2, (20 * np.pi) ** 2])
    pulse = 1.5 * stiffness[0] * ((time > 5.0) & (time < 5.0 + duration))
    loads = ModalLoads(pulse[:, None], -np.eye(2)[None], stiffness)
    assert stiffness_change(loads)[1] == pytest.approx(1.5)
    found = stiffness_change(lasting(loads, time))[1]
    assert found == pytest.approx(1.5 * min(duration, 1.0), rel=0.02, abs=1e-5)
    assert (found >= 1.0) == buckles
