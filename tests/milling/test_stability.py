"""Stability of milling: closed forms, two methods against each other, and collocation."""

from itertools import pairwise

import numpy as np
import pytest
import tomli_w

from ffrobot.common.errors import InputError
from ffrobot.mbs.linear.joint_conditions import FreeCoordinates
from ffrobot.milling.process import Milling, Tip, growth, limit_depth, read_milling, stability_limits, stable_depths

# Mode and coefficients of T. Insperger and G. Stépán, Int. J. Numer. Meth. Engng 61, 2004: 922 Hz, ζ = 0.011
OMEGA, ZETA, MASS, K_T, K_N = 2 * np.pi * 922.0, 0.011, 0.03993, 6e8, 2e8
ONE = Tip(np.array([[OMEGA**2]]), np.array([[2 * ZETA * OMEGA]]), np.array([[MASS**-0.5]]))
TWO = Tip(np.eye(2) * OMEGA**2, np.eye(2) * 2 * ZETA * OMEGA, np.eye(2) * MASS**-0.5)


def milling(entry):
    return Milling(teeth=2, tangential=K_T, radial=K_N, entry=entry, exit=np.pi)


HALF_DOWN = milling(np.pi / 2)


def revolutions(speed):
    return np.asarray(speed) * 2 * np.pi / 60


@pytest.mark.parametrize(("zeta", "rel"), [(ZETA, 1e-4), (0.3, 2e-3), (1.0 + 1e-9, 2e-3), (4.0, 2e-3)])
def test_turning_has_the_closed_form(zeta, rel):
    """a = −1/(2 K_s min Re G) = 2 k ζ (1 + ζ)/K_s for any ζ (S. A. Tobias, Machine-Tool Vibration, 1965)."""
    omega, G = Tip(ONE.K, np.array([[2 * zeta * OMEGA]]), ONE.J).response()
    limits = stability_limits(np.array([[-K_T]]), omega, G)
    assert limits.least == pytest.approx(-1.0 / (2 * K_T * G.real.min()), rel=1e-12)
    assert limits.least == pytest.approx(2 * MASS * OMEGA**2 * zeta * (1 + zeta) / K_T, rel=rel)


def test_lobes_of_turning_have_the_closed_form():
    """At ω, exp(−iωτ) = −G*/G, so that ωτ = 2 arg G + π + 2πk: a speed for each lobe k, with the depth at ω."""
    omega, G = ONE.response()
    limits = stability_limits(np.array([[-K_T]]), omega, G)
    at = np.flatnonzero(np.isfinite(limits.depth[:, 0]))[[50, 100, 150]]
    g = G[at, 0, 0]
    phase = (3 * np.pi + 2 * np.arctan2(g.imag, g.real)) % (2 * np.pi)
    np.testing.assert_allclose(limits.phase[at, 0], phase, rtol=1e-9)
    for k in (0, 1, 2):
        speed = omega[at] / (k + phase / (2 * np.pi))
        assert np.all(limits.lobes(1, speed) <= limits.depth[at, 0] * (1 + 1e-9))
    lowest = np.array([limits.lobes(1, omega[at] / (phase / (2 * np.pi)))])
    np.testing.assert_allclose(lowest[0], limits.depth[at, 0], rtol=1e-6)


@pytest.mark.parametrize("zeta", [1e-4, 1e-2])
def test_lobes_between_and_far_beyond_modes(zeta):
    """The first lobe has the least depth at speeds above ω₀; many waves in a turn leave the depth at any speed."""
    G = 1.0 / (MASS * OMEGA**2 * (1.0 - (x := np.array([1.01, 1.1, 1.7, 5.0])) ** 2 + 2j * zeta * x))
    limits = stability_limits(np.array([[-K_T]]), *Tip(ONE.K, ONE.D * zeta / ZETA, ONE.J).response())
    phase = (3 * np.pi + 2 * np.angle(G)) % (2 * np.pi)
    np.testing.assert_allclose(limits.lobes(1, 2 * np.pi * OMEGA * x / phase), -1 / (2 * K_T * G.real), rtol=1e-3)
    np.testing.assert_allclose(limits.lobes(1, np.array([0.02, 0.005]) * zeta * OMEGA), limits.least, rtol=2e-3)


def test_averaged_forces_are_those_of_many_angles():
    angles = (np.arange(20_000) + 0.5) / 20_000 * 2 * np.pi
    cuts = (angles >= HALF_DOWN.entry) & (angles <= HALF_DOWN.exit)
    s, c = np.sin(angles[cuts]), np.cos(angles[cuts])
    forces = np.array([-K_T * c - K_N * s, K_T * s - K_N * c])
    expected = 2 * np.einsum("if,jf->ij", forces, np.array([s, c])) / len(angles)
    np.testing.assert_allclose(HALF_DOWN.average, expected, rtol=1e-6)


def test_lobes_of_the_published_mode_by_both_methods():
    """Averaged forces miss what intermittent ones do: depths differ by 2 to 12 % for half immersion and slots."""
    speeds = revolutions([6000.0, 9000.0, 12000.0, 15000.0, 18000.0])
    omega, G = TWO.response()
    for cutter, off in ((HALF_DOWN, 0.12), (milling(0.0), 0.12)):
        lobes = stability_limits(cutter.average, omega, G).lobes(2, speeds)
        exact = [limit_depth(TWO, cutter, speed, (1e-5, 2e-2)) for speed in speeds]
        np.testing.assert_allclose(lobes, exact, rtol=off)
        assert limit_depth(TWO, cutter, speeds[0], (1e-6 * exact[0], 1e-3 * exact[0])) == np.inf


def collocated(tip, cutter, depth, speed, count):
    """Growth in a tooth period by Chebyshev polynomials through `count` + 1 places of each piece between cuts.

    x' = A x + B x(t − τ) with x of the period before at the same places (L. N. Trefethen, Spectral Methods in MATLAB,
    2000, ch. 6); the error falls exponentially.
    """
    K, D, J = tip
    n, m, pitch = count + 1, len(K), 2 * np.pi / cutter.teeth
    marks = sorted({0.0, pitch, cutter.entry % pitch, cutter.exit % pitch})
    marks = [a for a, b in zip(marks, [*marks[1:], np.inf], strict=True) if b - a > 1e-9]
    x, sizes = -np.cos(np.pi * np.arange(n) / count), (-1.0) ** np.arange(n) * np.r_[2, np.ones(count - 1), 2]
    slopes = np.outer(sizes, 1 / sizes) / (x[:, None] - x + np.eye(n))
    slopes -= np.diag(slopes.sum(axis=1))
    state = 2 * m
    left, right = np.zeros((2, state * n * (len(marks) - 1), state * n * (len(marks) - 1)))
    for piece, (first, last) in enumerate(pairwise(marks)):
        for i in range(n):
            at, here = state * (piece * n + i), slice(state * (piece * n + i), state * (piece * n + i + 1))
            if i == 0:  # continues the piece before, the first one the period before
                left[here, here] = np.eye(state)
                (right if piece == 0 else left)[here, at - state : at or None] = np.eye(state) * (1 - 2 * (piece > 0))
                continue
            C = np.zeros((2, 2))
            for turn in pitch * np.arange(cutter.teeth):
                angle = first + (last - first) * (x[i] + 1) / 2 + turn
                s, c, middle = np.sin(angle), np.cos(angle), (first + last) / 2 + turn
                if cutter.entry < middle < cutter.exit:
                    radial = np.array([s, c])
                    C -= np.outer(cutter.tangential * np.array([c, -s]) + cutter.radial * radial, radial)
            row = np.kron(slopes[i] * 2 / (last - first) * speed, np.eye(state))
            left[here, state * piece * n : state * (piece + 1) * n] = row
            left[here, here] -= np.block([[np.zeros((m, m)), np.eye(m)], [depth * J.T @ C @ J - K, -D]])
            right[here, at : at + state] = np.kron([[0, 0], [-1, 0]], depth * J.T @ C @ J)
    return np.abs(np.linalg.eigvals(np.linalg.solve(left, right))).max()


# The published single degree of freedom along the feed, in a slot and at a tenth of the diameter, down milling
FEED = Tip(ONE.K, ONE.D, np.array([[MASS**-0.5], [0.0]]))
TENTH = milling(np.arccos(2 * 0.1 - 1))


@pytest.mark.parametrize("cutter", [milling(0.0), TENTH])
@pytest.mark.parametrize("speed", [9000.0, 5000.0, 2000.0])
def test_lobes_of_the_published_case_are_those_of_collocation(cutter, speed):
    """A depth 0.5 % less is stable, and 0.5 % more has chatter; at 2000 rev/min a tooth period has 14 waves."""
    turned = revolutions(speed)
    depth = limit_depth(FEED, cutter, turned, (1e-5, 2e-2))
    assert (
        collocated(FEED, cutter, 0.995 * depth, turned, 60) < 1.0 < collocated(FEED, cutter, 1.005 * depth, turned, 60)
    )


def test_semi_discretization_says_where_a_tooth_period_has_too_many_waves():
    with pytest.raises(InputError, match=r"modes within 200 rad of a tooth period, found 347.6 rad at 500"):
        growth(FEED, TENTH, 1e-3, revolutions(500.0))


def test_without_damping_a_speed_may_have_no_stable_depth():
    assert limit_depth(FEED._replace(D=0 * FEED.D), TENTH, revolutions(4500.0), (1e-6, 1e-2)) == 0.0


@pytest.mark.parametrize(("depth", "grows"), [(0.5e-3, False), (2e-3, True)])
def test_two_modes_that_the_forces_couple(depth, grows):
    tip = Tip(np.diag([1.0, 1.3]) * OMEGA**2, TWO.D, TWO.J)
    found = growth(tip, HALF_DOWN, depth, revolutions(9000.0))
    assert (found > 1.0) is grows
    assert found == pytest.approx(collocated(tip, HALF_DOWN, depth, revolutions(9000.0), 40), rel=2e-3)


PROCESS = {"teeth": 2, "tangential": K_T, "radial": K_N, "entry": "90*deg", "exit": "180*deg", "highest": 2000.0}


def process(folder, **keys):
    (folder / "cutter.toml").write_text(tomli_w.dumps(PROCESS | keys))
    return read_milling(folder / "cutter.toml")


def test_depth_of_a_pose_does_not_depend_on_axes(tmp_path):
    """A robot with equal stiffness in the plane of the cut has one depth for all feeds; turned axes change nothing."""
    free = FreeCoordinates(np.eye(3), np.diag([1.0, 1.0, 9.0]) * OMEGA**2, np.eye(3) * 2 * ZETA * OMEGA)
    J, own = np.eye(3) * MASS**-0.5, np.eye(3)
    expected = stability_limits(HALF_DOWN.average, *TWO.response()).least
    found = stable_depths(process(tmp_path, speeds=[9000.0]), free, J, own)
    by_steps = process(tmp_path, speeds="9000:9000:1", method="semi-discretization")
    exact = stable_depths(by_steps, free, J, own)["milling_lobes"][0]
    assert exact == pytest.approx(limit_depth(TWO, HALF_DOWN, revolutions(9000.0), (1e-4, 1e-2)), 2e-3)
    assert found["milling_depth"] == pytest.approx(expected, rel=1e-9)
    assert found["milling_best_depth"] == pytest.approx(expected, rel=1e-9)
    assert found["milling_lobes"][0] >= expected
    turn = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # z to x
    turned = stable_depths(process(tmp_path, axis=[1.0, 0.0, 0.0]), free, turn @ J, own)
    assert turned["milling_depth"] == pytest.approx(expected, rel=1e-9)
    of_tool = stable_depths(process(tmp_path), free, turn @ J, turn.T)  # its z is the global x
    assert of_tool["milling_depth"] == pytest.approx(expected, rel=1e-9)


def test_a_feed_is_in_global_axes(tmp_path):
    """Soft along global x: a feed there has a depth of its own, however the tool is turned about its axis."""
    free = FreeCoordinates(np.eye(3), np.diag([1.0, 9.0, 9.0]) * OMEGA**2, np.eye(3) * 2 * ZETA * OMEGA)
    quarter = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    along, across = (
        stable_depths(process(tmp_path, feed=one), free, np.eye(3) * MASS**-0.5, np.eye(3))["milling_depth"]
        for one in ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    )
    assert abs(along / across - 1.0) > 0.1
    turned = stable_depths(process(tmp_path, feed=[1.0, 0.0, 0.0]), free, np.eye(3) * MASS**-0.5, quarter)
    assert turned["milling_depth"] == pytest.approx(along)
    with pytest.raises(InputError, match="a direction across the axis of the tool"):
        stable_depths(process(tmp_path, feed=[0.0, 0.0, 1.0]), free, np.eye(3), np.eye(3))


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"exit": "45*deg"}, r"cutter\.toml: expected 0 ≤ entry < exit ≤ π"),
        ({"teeth": 0}, "teeth"),
        ({"axis": [0.0, 0.0, 0.0]}, "axis: expected a direction"),
        ({"speeds": "fast"}, 'expected a list, or "FIRST:LAST:COUNT" of at most 1000, found "fast"'),
        ({"speeds": "100:200:0"}, 'found "100:200:0"'),
        ({"speeds": "100:200:9999999999999"}, 'found "100:200:9999999999999"'),
        ({"tangential": -1.0}, "tangential"),
    ],
)
def test_bad_processes_are_refused(tmp_path, keys, expected):
    with pytest.raises(InputError, match=expected):
        process(tmp_path, **keys)
