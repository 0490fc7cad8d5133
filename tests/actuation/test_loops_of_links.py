"""Sampled control of links that bend, by patches: closed forms of their damping, what sensors read."""

import numpy as np
import pytest
from beam_links import paper_link
from loop_scenes import loop
from one_link import one_link

from ffrobot.mbs.quantities.motion import node_of
from ffrobot.run.solve import solve_scene

HIT = [{"point": "link.tip", "y": "where(t < 0.002, 20*sin(pi*t/0.002), 0)"}]
DAMPER = {"kind": "modal-velocity", "bodies": ["link"], "damping_ratio": 0.05}
PATCHES = {
    "body": "link", "count": 10, "length": 0.05, "width": 0.025, "thickness": 0.75e-3, "modulus": 63e9,
    "d31": 110e-12, "structural": False,
}  # fmt: skip


def held_link(link, *analyses, **keys):
    """A cantilever whose root a rotor holds like a wall, sagging; its tip is hit for 2 ms."""
    inverse = {"name": "inverse", "kind": "fcid", "shape": "static", "end": keys.pop("end", 0.4), "output_step": 5e-4}
    loops = [analysis | {"disturbance": HIT, "tolerance": 1e-6} for analysis in analyses]
    keys = {"joint": {"rotor_inertia": 1e4}, "target": "0", "pzt": [PATCHES | keys.pop("pzt", {})]} | keys
    return one_link("link", link, inverse, *loops, gravity=[0.0, -9.81], **keys)


def decay(solution, name):
    """Damping ratio and amplitude of the lowest mode after the hit, from the envelope of its vibration."""
    outcome, node = solution.outcomes[name], node_of(solution.analyses[name].run, "link")
    p = outcome.q[:, node.p_q.start] - solution.outcomes["inverse"].q[:, node.p_q.start]
    omega = np.sqrt(node.body.stiffness[0])
    envelope = np.hypot(p, outcome.v[:, node.p_v.start] / omega)
    ring = (outcome.time > 0.01) & (envelope > 0.02 * envelope.max())
    return -np.polyfit(outcome.time[ring], np.log(envelope[ring]), 1)[0] / omega


def test_patches_add_the_damping_that_is_asked_for():
    """By their own voltages."""
    loops = loop(sample_time=1e-4, controller=[DAMPER]), loop("free", sample_time=1e-4)
    solution = solve_scene(held_link(paper_link(count=3), *loops, end=0.2))
    assert abs(decay(solution, "free")) < 1e-4
    assert decay(solution, "loop") == pytest.approx(0.05, rel=0.05)


def test_patches_damp_as_many_modes_as_they_read():
    loops = [loop(f"of_{modes}", controller=[DAMPER | {"modes": modes}]) for modes in (2, 3)]
    patches = {"count": 2, "allocation": "least-squares"}
    solution = solve_scene(held_link(paper_link(count=3), *loops, end=0.02, pzt=patches))
    few, more = (solution.outcomes[f"of_{modes}"].details.commands for modes in (2, 3))
    assert np.abs(few).max() > 0.0
    np.testing.assert_array_equal(few, more)


@pytest.mark.parametrize(
    ("space", "inverse"),
    [("planar", {"kind": "pcid"}), ("planar", {"kind": "fcid", "shape": "zero"}),
     ("spatial", {"kind": "fcid", "shape": "static"})],
)  # fmt: skip
def test_a_beam_that_is_welded_needs_no_trajectory(space, inverse):
    """Its tip is hit, and patches damp it as is asked for: nothing moves but the link."""
    damped = loop(sample_time=1e-4, controller=[DAMPER | {"sensor": "ideal"}], disturbance=HIT)
    inverse = inverse | {"name": "inverse", "end": 0.15, "output_step": 5e-4}
    keys = {"space": space, "gravity": [0.0] * (2 if space == "planar" else 3), "pzt": [PATCHES]}
    solution = solve_scene(one_link("link", paper_link(count=3), inverse, damped, **keys))
    assert decay(solution, "loop") == pytest.approx(0.05, rel=0.05)


def test_voltages_alone_hold_a_welded_beam_straight():
    """Against its weight, which would bend its tip by 5 mm within this time."""
    straight = {"name": "inverse", "kind": "fcid", "shape": "zero", "end": 0.05, "output_step": 0.01}
    replay = {"name": "replay", "kind": "forward", "actuation": "inverse", "apply": "joints+pzt"}
    keys = {"gravity": [0.0, -9.81], "pzt": [PATCHES]}
    run = solve_scene(one_link("link", paper_link(count=3), straight, replay, **keys)).outcomes["replay"]
    assert np.abs(run.q).max() < 1e-12


def test_all_integrators_go_from_sample_to_sample_alike():
    """Loads jump at every sample: methods that look back must not look across."""
    control = DAMPER | {"sensor": "ideal"}
    names = ["dop853", "dopri5", "radau", "generalized-alpha"]
    loops = [loop(name, integrator=name, sample_time=2e-3, controller=[control]) for name in names]
    solution = solve_scene(held_link(paper_link(count=3), *loops, end=0.04))
    first = solution.outcomes["dop853"].q
    sag = solution.outcomes["inverse"].q
    for name in names[1:]:
        assert solution.outcomes[name].status == "completed"
        assert np.abs(solution.outcomes[name].q - first).max() < 1e-3 * np.abs(first - sag).max(), name


def test_estimates_of_patches_leave_out_their_own_voltage():
    """Voltages of up to 3 kV hold a turning link straight: patches read their own strain, an estimate has none."""
    observer = {"kind": "kalman", "process": {"force/link.tip/y": 1.0}}
    sensors = [{"point": "link.tip", "noise": 1e-9}, {"pzt": "link", "noise": 1e-3}]
    damped = loop(
        controller=[DAMPER | {"sensor": "pzt", "damping_ratio": 1e-6}],
        observer=observer,
        sensor=sensors,
        sample_time=1e-4,
    )
    held = {"name": "inverse", "kind": "fcid", "shape": "zero", "end": 0.02, "output_step": 5e-4}
    keys = {"joint": {}, "target": "0.01*(1 - cos(40*t))**2", "pzt": [PATCHES]}
    scene = one_link("link", paper_link(count=3), held, damped | {"feed_forward": "joints+pzt"}, **keys)
    record = solve_scene(scene).outcomes["loop"].details
    read = np.abs(record.readings[:, 2:]).max()
    column = record.estimate.names.index("pzt/link/1")
    assert read > 1.0
    assert np.abs(record.estimate.values[:, column]).max() < 1e-3 * read


@pytest.mark.parametrize(("sensor", "unread"), [("pzt", ["LQR: no sensor reads modal/link/2"]), ("ideal", [])])
def test_lqr_names_what_no_sensor_reads(sensor, unread):
    """One patch tells one mode of two."""
    control = {"kind": "lqr", "modes": 2, "sensor": sensor}
    patch = {"count": 1, "allocation": "least-squares"}
    scene = held_link(paper_link(count=3), loop(sample_time=1e-3, controller=[control]), end=5e-3, pzt=patch)
    lines = solve_scene(scene).outcomes["loop"].details.warnings
    assert [line.partition(",")[0] for line in lines if "no sensor reads" in line] == unread
