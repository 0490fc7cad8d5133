"""Limits of joints' coordinates, which the core watches between outputs and within steps; times in closed form."""

import numpy as np
import pytest
from equal_steps import controls
from scipy.interpolate import CubicHermiteSpline
from scipy.special import ellipk, ellipkinc

import ffrobot
from ffrobot.mbs import _core
from ffrobot.mbs.linear.statics import initial_state
from ffrobot.mbs.model.build import build_model
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.mbs.posture.limits import watch_limits, watched
from ffrobot.mbs.posture.start import undeformed_posture
from ffrobot.run.bodies import load_bodies

METHODS = {"dop853": 1e-11, "dopri5": 1e-11, "radau": 1e-11, "generalized_alpha": 1e-7}  # with tolerances
ROD = {"mass": 2.0, "center": [0.0, 0.0, -0.3], "inertia": [0.07, 0.05, 0.02],
       "points": {"top": [0.0, 0.0, 0.0], "end": [0.0, 0.0, -0.5]}}  # fmt: skip
G = 9.81
PACE = np.sqrt(2.0 * G * 0.3 / (0.05 + 2.0 * 0.09))  # 1/s, of small swings about y
START = 1.2  # rad


def system_of(joints, bodies, joints_at, rates=None):
    scene = ffrobot.make_scene(
        name="swing", space="spatial", gravity=[0.0, 0.0, -G], body=[{"name": name, "rigid": ROD} for name in bodies],
        joint=joints, initial={"joints": joints_at, "joint_rates": rates or {}},
        analysis=[{"name": "free", "kind": "forward", "end": 1.0, "output_step": 0.1}],
    )  # fmt: skip
    model = build_model(scene, [body.spatial for body in load_bodies(scene, lambda _: None).values()])
    return MultibodySystem(model), initial_state(model, undeformed_posture(model))


def run(system, start, times, controls, checkpoint=None, is_watched=True):
    core, scene, _ = MultibodySystem(system.model).integrated
    if is_watched:
        watch_limits(scene, system.model.tree)
    return _core.tree_motion(core, scene, list(times), start.q, start.v, controls, lambda _: True, checkpoint)


def seen(system, run):
    """By joint and number, of the scene's coordinates."""
    return {
        (one.joint.name, one.number): one.seen(found)
        for one, found in zip(watched(system.model.tree), run.ranges, strict=True)
    }


def pendulum(limits, backwards=False):
    between = ["ground", "a.top"]
    joint = {"name": "pin", "type": "revolute", "between": between[::-1] if backwards else between,
             "axis": [0.0, 1.0, 0.0], "position_limit": limits}  # fmt: skip
    return system_of([joint], ["a"], {"pin": START})


def time_at(angle):
    """When the pendulum gets there for the first time; elliptic integrals."""
    m = np.sin(START / 2) ** 2
    return (ellipk(m) - ellipkinc(np.arcsin(np.sin(angle / 2) / np.sqrt(m)), m)) / PACE


HALF = 2 * time_at(0.0)  # s, from one side to the other
PERIOD = 2 * HALF


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("backwards", [False, True])
def test_when_a_pendulum_leaves_its_range(method, backwards):
    """With outputs at the ends of the swing's first period alone, where it is back in its range."""
    system, start = pendulum([-1.0, 1.3], backwards)
    found = run(system, start, [0.0, PERIOD], controls(method, METHODS[method]))
    ((least, largest, left_at),) = seen(system, found).values()
    close = 1e-8 if METHODS[method] < 1e-8 else 1e-5
    assert left_at == pytest.approx(time_at(-1.0), abs=close)
    assert least == pytest.approx(-START, abs=close)
    assert largest == pytest.approx(START, abs=close)


@pytest.mark.parametrize("method", ["dop853", "dopri5"])
def test_an_excursion_within_one_step(method):
    """Beyond the limit for a seventieth of the period, while steps take more: no end of a step lies there."""
    height = 1e-3
    system, start = pendulum([height - START, 2.0])
    tolerance = 1e-4 if method == "dop853" else 1.5e-3
    found = run(system, start, [0.0, PERIOD], controls(method, tolerance, keep_steps=True))
    ends = np.array(found.step_ends)
    left, back = time_at(height - START), PERIOD - time_at(height - START)
    assert back - left > 0.013 * PERIOD
    assert not np.any((ends > left) & (ends < back))
    ((least, _, left_at),) = seen(system, found).values()
    assert left_at == pytest.approx(left, abs=tolerance * PERIOD)
    assert least == pytest.approx(-START, abs=tolerance * START)


def test_under_a_sampled_controller():
    """One that does nothing, but has steps end at its samples."""
    system, start = pendulum([-1.0, 1.3])
    core, scene, _ = system.integrated
    watch_limits(scene, system.model.tree)
    found = _core.tree_sampled(
        model=core, scene=scene, times=[0.0, PERIOD], q=start.q, v=start.v, controls=controls(),
        carry_on=lambda _: True, held=_core.ZeroOrderHold(np.ones((1, 1))), first_command=np.zeros(1),
        samples=list(np.arange(0.0, PERIOD, 0.1)), delay=0.02, controller=lambda *_: np.zeros(1),
    )  # fmt: skip
    np.testing.assert_allclose(seen(system, found)["pin", 0], (-START, START, time_at(-1.0)), rtol=0, atol=1e-8)


def test_a_range_that_is_left_at_the_start_and_one_that_is_kept():
    system, start = pendulum([-3.0, 1.0])
    assert seen(system, run(system, start, [0.0, 0.1], controls()))["pin", 0][1:] == (START, 0.0)
    system, start = pendulum([-3.0, START - 1e-13])  # round-off of a start at the limit
    assert seen(system, run(system, start, [0.0, 0.1], controls()))["pin", 0][2] is None
    system, start = pendulum([-1.0, 2.0])
    kept = seen(system, run(system, start, [0.0, 0.99 * time_at(-1.0)], controls()))["pin", 0]
    assert kept[2] is None
    assert -1.0 < kept[0] < kept[1] == START


TWO = [(-0.5, 1.2), (-0.3, 0.6)]  # of the coordinates of a universal joint


def universal(backwards):
    between, axes = ["ground", "a.top"], ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    if backwards:
        between = between[::-1]
    keys = {"name": "cross", "type": "universal", "between": between, "axis": axes[0], "second_axis": axes[1],
            "position_limit": TWO}  # fmt: skip
    hinge = {"name": "pin", "type": "revolute", "between": ["a.end", "b.top"], "axis": [1.0, 0.2, 0.0]}
    return system_of([keys, hinge], ["a", "b"], {"cross": [0.9, 0.5]})


def expected_of(t, x, rate, limits):
    """Least, largest, and when it is first outside, of outputs that are dense."""
    spline = CubicHermiteSpline(t, x, rate)
    turns = spline.derivative().roots(extrapolate=False)
    places = [u for limit in limits for u in spline.solve(limit, extrapolate=False)]
    reached = np.concatenate([x, spline(turns)])
    return reached.min(), reached.max(), min(places)


def beside_orientations():
    """A pendulum on a body that tumbles: steps are made in local coordinates about each other centre."""
    ball = {"name": "ball", "type": "spherical", "between": ["ground", "a.top"]}
    pin = {"name": "pin", "type": "revolute", "between": ["a.end", "b.top"], "axis": [1.0, 0.2, 0.0],
           "position_limit": [-0.3, 0.4]}  # fmt: skip
    return system_of([ball, pin], ["a", "b"], {"pin": 0.2}, {"ball": [1.0, 2.0, 3.0]})


@pytest.mark.parametrize(
    ("made", "name"),
    [(lambda: universal(False), "cross"), (lambda: universal(True), "cross"), (beside_orientations, "pin")],
)
def test_what_is_seen_are_the_extremes_of_dense_outputs(made, name):
    """Of both coordinates of a universal joint, and beside orientations."""
    (system, start), dense = made(), np.linspace(0.0, 1.8, 3601)
    tree = system.model.tree
    q, v = np.split(run(system, start, dense, controls()).states, [tree.n_q], axis=1)
    node = tree.nodes[tree.carried[name]]
    x, rate = (node.joint.turned_around(of) if node.backwards else of for of in (q[:, node.q], v[:, node.v]))
    for method in ("dop853", "dopri5"):
        found = seen(system, run(system, start, [0.0, dense[-1]], controls(method)))
        assert len(found) == len(node.joint.units)
        for number, limits in enumerate(node.joint.position_limits):
            expected = expected_of(dense, x[:, number], rate[:, number], limits)
            np.testing.assert_allclose(found[name, number], expected, rtol=0, atol=1e-8)


@pytest.mark.parametrize("method", METHODS)
def test_nothing_of_a_run_depends_on_it(method):
    """States, steps and evaluations are the same to the last bit; without limits nothing is watched."""
    system, start = universal(False)
    times = np.linspace(0.0, 1.0, 7)
    settings = controls(method, max(METHODS[method], 1e-8))
    plain, found = (run(system, start, times, settings, is_watched=is_watched) for is_watched in (False, True))
    assert plain.ranges == []
    assert all(left_at is not None for *_, left_at in found.ranges)
    for name in ("states", "accelerations", "multipliers", "step_ends", "steps", "rejected", "evaluations"):
        np.testing.assert_array_equal(getattr(found, name), getattr(plain, name))
    np.testing.assert_array_equal(found.last, plain.last)


@pytest.mark.parametrize("method", ["dop853", "dopri5"])
def test_a_run_that_goes_on_has_seen_the_same(method):
    system, start = universal(True)
    times = np.linspace(0.0, 1.5, 4)
    whole, checkpoint = run(system, start, times, controls(method)), _core.TreeCheckpoint()
    parts = []
    while not parts or parts[-1].status != _core.IntegrationStatus.completed:
        parts.append(run(system, start, times, controls(method, max_steps=20), checkpoint))
    assert len(parts) > 2
    assert parts[-1].ranges == whole.ranges
