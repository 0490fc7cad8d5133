"""Amplifiers of patches: responses in closed form, currents by charges, and limits in tracking, replays and loops."""

from dataclasses import replace

import numpy as np
import pytest
import test_tracking_arms
from beam_links import paper_link
from one_link import one_link
from patches_on_links import layout
from test_tracking_arms import off_path

import ffrobot
from ffrobot.common.errors import SolveError
from ffrobot.run.solve import prepare_scene

pytestmark = pytest.mark.filterwarnings("ignore::ffrobot.FfrobotWarning")

TIME = np.linspace(0.0, 0.01, 1001)
HYSTERESIS = {"weights": (0.8, 0.1, 0.06, 0.04), "thresholds": (0.0, 10.0, 30.0, 55.0)}


def output(wanted, strain=0.0, **keys):
    """What arrives of a voltage over `TIME`, at a patch with 1 nF or so."""
    amplifiers = layout(count=1, amplifier=keys).amplifiers()
    columns = (np.broadcast_to(of, TIME.shape)[:, None] for of in (wanted, strain))
    return amplifiers.output(TIME, *columns)[:, 0], float(amplifiers.capacitance[0, 0])


def test_responses_in_closed_form():
    """Lag and delay of a ramp; rates by slew, and by current over capacitance with the current of the strain."""
    ramp, tau = 2e4 * TIME, 1.0 / (2 * np.pi * 500.0)
    found, C = output(ramp, bandwidth=500.0)
    np.testing.assert_allclose(found, 2e4 * (TIME - tau * -np.expm1(-TIME / tau)), atol=1e-10)
    np.testing.assert_allclose(output(ramp, delay=1e-3)[0], 2e4 * np.maximum(TIME - 1e-3, 0.0), atol=1e-10)
    np.testing.assert_allclose(output(ramp, slew=5e3)[0], 5e3 * TIME, atol=1e-10)
    np.testing.assert_allclose(output(ramp, range=(-50.0, 80.0))[0], np.minimum(ramp, 80.0), atol=1e-10)
    strain = 0.25e4 * C
    np.testing.assert_allclose(output(ramp, strain, current=1e4 * C)[0], 0.75e4 * TIME, atol=1e-10)
    np.testing.assert_allclose(output(-ramp, strain, current=1e4 * C)[0], -1.25e4 * TIME, atol=1e-10)
    of, none = layout(count=1, amplifier={"slew": 5e3}).amplifiers(), np.zeros(1)
    at_end, mean = of.advance(1e-3, none, (none + 2.0, none + 2.0), none)
    assert (at_end, mean) == pytest.approx((2.0, 1.6))  # a ramp for 0.4 of the step


def test_currents_of_patches_that_charge_each_other():
    """Both at the limit: C V̇ + c V̇ = i; the second alone, with the charge of the first's ramp."""
    of = replace(
        layout(count=2, amplifier={"current": 2e-6}).amplifiers(), capacitance=np.array([[4e-9, 1e-9], [1e-9, 4e-9]])
    )
    time = TIME[::20, None]
    for ramps, rates in (((1e4, 1e4), (400.0, 400.0)), ((-100.0, 1e4), (-100.0, 525.0))):
        found = of.output(time[:, 0], time * ramps, 0.0 * time * ramps)
        np.testing.assert_allclose(found, time * rates, atol=1e-10)


def test_capacitance():
    """ε w l/t of each layer and face; on a link that stands still, 1 − k31² of it."""
    of = layout(count=1, face="both", layers=3, permittivity=2e-8)
    free = 2 * 3 * 2e-8 * 0.025 * 0.05 / 0.75e-3
    assert of.capacitance() == pytest.approx(free, rel=1e-14)
    k31 = 110e-12 * (63e9 / 2e-8) ** 0.5
    assert of.capacitance(clamped=True) == pytest.approx(free * (1.0 - k31**2), rel=1e-13)


def test_no_limit_of_current_takes_no_capacitance():
    """Whose sign is wrong of constants that contradict each other, as of a soft ceramic with another's permittivity."""
    amplifiers = layout(count=1, d31=-320e-12, poissons_ratio=0.31, hysteresis=HYSTERESIS).amplifiers()
    assert amplifiers.capacitance[0] < 0.0
    wanted = 100.0 * np.sin(600.0 * TIME)[:, None]
    np.testing.assert_array_equal(amplifiers.output(TIME, wanted, wanted), amplifiers.hysteresis.output(wanted))


scene = test_tracking_arms.scene  # the soft arm of the page


@pytest.fixture
def solved(scene):
    """With an amplifier, its text changed by pairs; `alone`: without replays."""

    def solve(amplifier, *changes, limit="limit = 200.0", **keys):
        amplified = "limit = 200.0 ", f"{limit}\n[pzt.amplifier]\n{amplifier}\n#"
        return ffrobot.solve(scene(amplified, *changes, **keys))

    return solve


def test_currents_of_tracking(solved):
    """Limits hold between outputs of 0.1 ms, the charge by C V + Φ_Vᵀ p; the price of a limit by differences."""
    costs = []
    for current in (0.0147, 0.015, 0.0153):
        fine = "output_step = 0.002", "output_step = 1e-4"
        with solved(f"current = {current}", fine, alone=current != 0.015) as results:
            costs.append(results.attributes("carried/tracking")["cost"])
            if current != 0.015:
                continue
            judged = "carried/feasibility/pzt/arm"
            assert results[f"{judged}/factor"].max() == pytest.approx(1.0, abs=1e-6)
            assert results[f"{judged}/current"].max() <= current * (1.0 + 1e-6)
            V, time = results["carried/pzt/arm/voltage"], results.time("carried")
            C = results.attributes("carried/pzt/arm")["capacitance"] * (1 - 110e-12**2 * 63e9 / (1700 * 8.8541878e-12))
            alone = C * np.abs(np.diff(V, axis=0)).max() / (time[1] - time[0])
            assert 0.7 * current < alone < 1.3 * current  # the strain takes the rest
            price = results["carried/tracking/current_price/arm"].sum()
            assert off_path(results, "replay") < 1e-7
    assert price == pytest.approx((costs[0] - costs[2]) / 6e-4, rel=1e-3)


def test_least_current_and_what_is_less(solved):
    """No motion needs less than the least current."""
    objective = 'kind = "tracking"', 'kind = "tracking"\nobjective = "least-current"'
    with solved("current = 0.02", objective, alone=True) as results:
        least = results["carried/feasibility/pzt/arm/current"].max()
    assert 0.004 < least < 0.01
    with solved(f"current = {1.05 * least}", alone=True) as results:
        assert results.attributes("carried/tracking")["objective"] == "effort"
    with solved(f"current = {0.9 * least}", alone=True) as results:
        assert results.attributes("carried/tracking")["least_share"] > 1.0  # with higher voltages
    with pytest.raises(SolveError, match="within the largest current and slew rate of the amplifiers"):
        solved("current = 1e-7")


def test_unequal_ranges_and_slew(solved):
    """Of each patch its own; the least voltage is a share of both limits. Voltages are linear between breaks."""
    ranges, slew = [[-300.0, 250.0], [-200.0, 200.0], [-250.0, 300.0], [-90.0, 200.0]], 3e4
    with solved(f"range = {ranges}\nslew = {slew}", limit="", alone=True) as results:
        V, time = results["carried/pzt/arm/voltage"], results["carried/time"]
        rates = np.abs(np.diff(V, axis=0)) / np.diff(time)[:, None]
        assert rates.max() == pytest.approx(slew, rel=1e-6)
        lowest, highest = np.array(ranges).T
        assert (lowest * (1.0 + 1e-9) <= V).all()
        assert (highest * (1.0 + 1e-9) >= V).all()
        assert results.verdict["carried"].feasible
        np.testing.assert_array_equal(results.attributes("carried/pzt/arm")["range"], np.transpose(ranges))


OPEN_LOOP = (
    'kind = "forward"\nactuation = "carried"\napply = "joints"\n',
    'kind = "closed-loop"\nsample_time = 1e-4\ndelay = 0.0\nfeed_forward = "joints+pzt"\nactuation = "carried"\n',
)


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"amplifier": {"range": (50.0, 200.0)}}, "range: expected a negative and a positive voltage"),
        ({"amplifier": {"range": (200.0, -50.0)}}, r"found \[200, -50\]"),
        ({"amplifier": {"slew": (1e3, 1e3)}}, "slew: expected 10 values, one for each patch, found 2"),
        ({"amplifier": {"range": (-50.0, 200.0)}, "limit": 100.0}, 'one of the keys "limit" and "amplifier.range"'),
        ({"amplifier": {"current": 0.0}}, "greater than 0"),
        ({"permittivity": 0.0}, "greater than 0"),
        ({"permittivity": 7e-10}, r"above 7\.623e-10 F/m"),
        ({"hysteresis": HYSTERESIS | {"thresholds": (0.0, 1.0)}}, "expected 4 thresholds, as weights, found 2"),
        ({"hysteresis": HYSTERESIS | {"thresholds": (0.0, 30.0, 10.0, 55.0)}}, "expected ascending voltages from 0 on"),
        ({"hysteresis": HYSTERESIS | {"thresholds": (1.0, 10.0, 30.0, 55.0)}}, "expected ascending voltages from 0 on"),
        ({"hysteresis": HYSTERESIS | {"weights": (0.8, 0.1, 0.0, 0.1)}}, "greater than 0"),  # without an inverse
    ],
)
def test_amplifiers_and_hysteresis_that_do_not_fit(keys, text):
    with pytest.raises(ValueError, match=text):
        layout(**keys)


def test_inverse_of_hysteresis_and_loop_area():
    """H⁻¹ H = H H⁻¹ = 1 from rest; a cycle of amplitude A loses Σ 4 w r (A − r); a play operator written otherwise."""
    of = layout(count=1, hysteresis=HYSTERESIS).amplifiers().hysteresis
    rng = np.random.default_rng(59)
    V = np.cumsum(rng.normal(0.0, 8.0, 4000))[:, None]
    for first, second in ((of, of.inverse), (of.inverse, of)):
        np.testing.assert_allclose(second.output(first.output(V)), V, atol=1e-12 * np.abs(V).max())
    A = 100.0
    cycle = A * np.concatenate([np.linspace(0, 1, 101), np.linspace(1, -1, 401), np.linspace(-1, 1, 401)])[:, None]
    turn = np.s_[100:]
    found = of.output(cycle)
    lost = np.sum((found[turn][1:] + found[turn][:-1]) / 2 * np.diff(cycle[turn], axis=0))
    wanted = sum(4 * w * r * (A - r) for w, r in zip(*HYSTERESIS.values(), strict=True))
    assert -lost == pytest.approx(wanted, rel=1e-12)
    expected = np.zeros_like(V)
    for w, r in zip(*HYSTERESIS.values(), strict=True):
        z = 0.0
        for k, now in enumerate(V[:, 0]):
            if abs(now - z) > r:
                z = now - np.sign(now - z) * r
            expected[k] += w * z
    np.testing.assert_allclose(of.output(V), expected, atol=1e-11)


def test_fast_voltages_of_a_long_run():
    """Of 400 Hz over 20 s, and 100 V at a time, a play operator of 40 V is 40 V behind from the first peak on."""
    patch = layout(count=1, hysteresis={"weights": (0.5, 0.5), "thresholds": (0.0, 40.0)})
    keys = {"pzt": [patch.model_dump(exclude_unset=True)], "load": [{"pzt": "link", "voltage": ["100*sin(800*pi*t)"]}]}
    scene = one_link("link", paper_link(), {"name": "long", "kind": "forward", "end": 20.0, "output_step": 1.0}, **keys)
    (drive,) = prepare_scene(scene).model.modal_loads
    t = 19.5 + np.linspace(0.0, 0.01, 1001)
    V, is_rising = 100.0 * np.sin(800 * np.pi * t), np.cos(800 * np.pi * t) > 0.0
    last = np.where(is_rising, np.maximum(-60.0, V - 40.0), np.minimum(60.0, V + 40.0))
    missed = np.abs(drive.size.sample(t)[0] - 0.5 * (V + last))
    assert missed.max() < 0.4  # V, where it turns or begins to follow
    assert np.median(missed) < 1e-3


def test_a_delay_of_amplifiers_is_one_of_the_loop():
    """Without motors it does not matter where commands wait for a part of a sample."""
    damper = {"kind": "modal-velocity", "bodies": ["link"], "modes": 2, "damping_ratio": 0.1, "sensor": "ideal"}
    blow = {"point": "link.tip", "y": "where(t < 0.005, 1, 0)"}
    of_loop = {"name": "loop", "kind": "closed-loop", "actuation": "still", "sample_time": 1e-3, "start": "scene"}
    of_loop |= {"controller": [damper], "disturbance": [blow]}
    still = {"name": "still", "kind": "pcid", "end": 0.05, "output_step": 0.005}
    found = []
    for late, of_amplifier in ((1.7e-3, 0.0), (0.0, 1.7e-3)):
        patches = layout(amplifier={"delay": of_amplifier}).model_dump(exclude_unset=True)
        results = ffrobot.solve(one_link("link", paper_link(), still, of_loop | {"delay": late}, pzt=[patches]))
        found.append(results["loop/control/commands"])
    assert np.ptp(found[0]) > 1.0
    np.testing.assert_allclose(found[1], found[0], atol=1e-9 * np.ptp(found[0]))


def test_hysteresis_leaves_a_path_and_its_inverse_comes_back(solved):
    """Tracking plans without it; replays and a loop without controllers, sampled fast, act through it.

    The inverse asks for more than the limits here and there: both are without.
    """
    text = "delay = 0.0\n[pzt.hysteresis]\nweights = [0.8, 0.1, 0.1]\nthresholds = [0.0, 5.0, 15.0]\n"
    off = {}
    for name, amplifier in (("without", "delay = 0.0"), ("with", text), ("inverse", f"{text}compensate = true\n")):
        with solved(amplifier, (OPEN_LOOP[0], f"{OPEN_LOOP[1]}unlimited = true\n")) as results:
            off[name] = np.array([off_path(results, of) for of in ("replay", "without_patches")])
    assert (off["with"] > 1e-5).all()
    assert off["with"][1] == pytest.approx(off["with"][0], rel=0.01)
    np.testing.assert_allclose(off["inverse"], off["without"], atol=0.01 * off["with"][0])
