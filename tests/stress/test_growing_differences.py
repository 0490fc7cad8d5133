"""Open loop, small differences grow: as fast as the linearised equations say, and no faster."""

import numpy as np
import pytest
from links import arm
from mechanisms import ModalLoad, forward, make_model, oracle_of, pcid, revolute
from oracle_runs import evaluated, run
from patch_sets import FULL
from robots import free_run
from rods import rod
from table import at_most

from ffrobot.mbs._core import TimeFunction

GROUP = "Growth of differences, open loop"


def fastest_growth(robot, q):
    """The largest real part of the eigenvalues (1/s) of the oracle's motion about rest at q (n_q,) of the tree.

    By central differences on the coordinates of an open chain: angles of its joints, and modes.
    """
    h, n = 1e-5, len(q)
    tree = robot.model.tree
    seen = evaluated(robot, 0.0, q, 0 * q)
    oracle, modes = oracle_of(seen.assembly), np.setdiff1d(np.arange(len(seen.q[0])), seen.assembly.frame_coordinates)
    joints = [(tree.nodes[tree.carried[name]].v.start, row) for name, row in robot.motors.items()]
    of_modes = np.concatenate([np.arange(node.p_v.start, node.p_v.stop) for node in tree.nodes])

    def acceleration(q):
        state = evaluated(robot, 0.0, q, 0 * q)
        a = oracle.solve(0.0, state.q[0], state.v[0])[0]
        found = np.zeros(n)
        found[of_modes] = a[modes]
        for at, row in joints:
            way = oracle.row(row, state.q[0], state.v[0])
            found[at] = way.gradient @ a + way.bias
        return found

    A = np.array([(acceleration(q + h * e) - acceleration(q - h * e)) / (2 * h) for e in np.eye(n)]).T
    return np.sqrt(np.linalg.eigvals(A).astype(complex)).real.max()


def upright(rates):
    return arm(trajectory=[], initial={"angles": {"link1": np.pi / 2, "link2": np.pi / 2}, "rates": rates})


def test_arm_that_stands_on_its_head(record):
    """From 1e-9 rad/s on, e-folds are those of the linearised arm until the arm has fallen."""
    outcome = free_run(upright({"link1": 1e-9}), end=4.0, tolerance=1e-10)
    turn = np.abs(outcome.q[:, 2] - np.pi / 2)
    early = (outcome.time > 1.5) & (turn < 1e-3)
    rate = np.polyfit(outcome.time[early], np.log(turn[early]), 1)[0]
    expected = fastest_growth(outcome.robot, outcome.outcome.q[0])
    assert rate == pytest.approx(expected, rel=2e-3)
    record(
        GROUP,
        "a flexible arm upright, pushed by 1e-9 rad/s",
        "grows at {rate} 1/s, linearised {expected} 1/s",
        rate=rate,
        expected=expected,
    )


def difference(push, end, make, **keys):
    """Angle of the first body between a run and one that starts `push` rad/s faster."""
    one, other = (free_run(make(p), end=end, **keys) for p in (0.0, push))
    return one.time, np.abs(other.q[:, 2] - one.q[:, 2])


def double_pendulum(push):
    initial = {"angles": {"a": 1.5, "b": 2.5}, "rates": {"a": push}}
    joints = [revolute("O", "ground", "a.root"), revolute("A", "a.tip", "b.root")]
    return make_model([rod("a", 1, 1), rod("b", 1, 1)], joint=joints, initial=initial)


def test_chaos_is_that_of_the_equations(record):
    """A double pendulum: differences of 1e-9 and 1e-7 grow alike, a hundred times apart, as tangent motions do."""
    keys = {"end": 8.0, "make": double_pendulum, "tolerance": 1e-10}
    time, small = difference(1e-9, **keys)
    _, large = difference(1e-7, **keys)
    linear = (time > 0.5) & (large < 1e-3) & (small > 1e-10)
    assert np.median(large[linear] / small[linear]) == pytest.approx(100, rel=0.02)
    growth = np.polyfit(time[linear], np.log(large[linear]), 1)[0]
    assert growth > 0.5
    record(
        GROUP,
        "a double pendulum of rods for 8 s",
        "differences of 1e-9 and 1e-7 grow at {growth} 1/s alike",
        growth=growth,
    )


def steered(inverse, k):
    """The arm under the moments and modal forces that were found for output k, and held."""
    robot = inverse.robot
    modal = [
        ModalLoad(body.name, inverse.F_p[k, inverse.modal_columns(body.name)], TimeFunction.constant(1.0))
        for body in robot.bodies
    ]
    loads = [
        {"joint": joint, "moment": repr(float(tau))} for joint, tau in zip(robot.motors, inverse.tau[k], strict=True)
    ]
    tables = {key: value for key, value in robot.tables.items() if key != "body"}
    return make_model(robot.bodies, modal, **(tables | {"trajectory": [], "load": loads}))


def test_replayed_actuation(record):
    """Nothing holds an arm on its way but moments found before: it falls off it as an arm does that nothing steers."""
    path = {"name": "tip", "point": "link2.tip", "x": "1.2+0.2*cos(t)", "y": "0.9+0.2*sin(t)"}
    model = arm(trajectory=[path], initial={"angles": {"link1": -0.2, "link2": 1.4}})
    inverse = run(model, pcid(end=20.0, output_step=0.1, tolerance=1e-6))
    analysis = forward(end=20.0, output_step=0.1, tolerance=1e-6, actuation="inverse", apply="joints+pzt")
    replay = run(model, analysis, inverse, FULL)
    assert replay.status == "diverged"
    assert "is bent by" in replay.statistics.cause
    time, departure = replay.time, np.abs(replay.q - inverse.q[: len(replay.q)])[:, 2]
    early = (time > 1.0) & (departure > 1e-10) & (departure < 1e-2)
    rate = np.polyfit(time[early], np.log(departure[early]), 1)[0]
    expected = np.mean([fastest_growth(steered(inverse, k), inverse.outcome.q[k]) for k in np.flatnonzero(early)])
    assert rate == pytest.approx(expected, rel=0.3)
    record(
        GROUP,
        "PCID round a circle, forward simulation under its torques and voltages at a tolerance of 1e-6",
        "departs by at most {second} rad after 1 s, grows at {rate} 1/s, linearised {expected} 1/s, ends at t = {t}",
        'diverged; “"link2" is bent by … of its length …”',
        second=at_most(1e-10, departure[10]),  # rounding, grown for a second
        rate=rate,
        expected=expected,
        t=replay.statistics.time_reached,
    )
