"""What is required against what there is, by hand; and remedies that do what they promise."""

import numpy as np
import pytest
from beam_links import beam_link, paper_link, tube
from one_link import one_link
from patches_on_links import CERAMIC

import ffrobot
from ffrobot.actuation.motors import path_jump
from ffrobot.actuation.patches.link_patches import link_patches, with_count
from ffrobot.mbs.quantities.motion import deflection
from ffrobot.mbs.quantities.supply import actuator_forces
from ffrobot.results.tables import voltage_cells
from ffrobot.run.solve import solve_scene

LIMIT = 200.0
RUN = {"end": 0.5, "output_step": 0.01}
STRAIGHT = {"kind": "fcid", "shape": "zero"} | RUN
MOTOR = {"moment_limit": 10.0, "speed_limit": 0.2, "power_limit": 1e3}


def arm(analysis=STRAIGHT, target="0.1*sin(2*t)", limit=LIMIT, load=(), motor=MOTOR, **of_patches):
    """One horizontal link of the paper, its motor moved as `target` says."""
    patches = CERAMIC | {"count": 10, "structural": False, "limit": limit, "depoling_field": 5e5} | of_patches
    keys = {"gravity": [0.0, -9.81], "target": target, "pzt": [{"body": "link"} | patches], "load": list(load)}
    return solve_scene(one_link("link", paper_link(), {"name": "motion"} | analysis, joint=motor, **keys))


def judged_of(solution):
    return solution.analyses["motion"].actuation.feasibility


def test_patches_peak_by_peak():
    solution = arm(limit=3000.0)
    judged = judged_of(solution).patches["link"]
    outcome = solution.outcomes["motion"]
    body = solution.bodies["link"].modal
    # What holds it straight: with a = θ̈ x + g cos θ, the modal forces S̄ g cos θ + h θ̈ against the weight and inertia.
    t = outcome.time
    theta, acceleration = 0.1 * np.sin(2 * t), -0.4 * np.sin(2 * t)
    F_p = np.outer(9.81 * np.cos(theta), body.S_bar[1]) + np.outer(acceleration, body.I_bar[0, 1])
    # Shabana 2022, eq. 14: M = E_p d31 w_p (t_b + t_p)/2 per volt works on the rotations at a patch's ends.
    moment = 63e9 * 110e-12 * 0.025 * (0.015 + 0.75e-3) / 2
    centers = (np.arange(10) + 0.5) / 10
    ends = [np.array([body.interpolate(x).rotation[2] for x in centers + side * 0.025]) for side in (-1, 1)]
    Phi_V = moment * (ends[1] - ends[0]).T
    volts = np.linalg.solve(Phi_V, F_p.T).T
    required = np.abs(volts).max(axis=0)
    np.testing.assert_allclose(judged.required_moment, required * moment, rtol=1e-7)
    np.testing.assert_allclose(judged.available_moment, 3000.0 * moment, rtol=1e-12)
    np.testing.assert_allclose(judged.factor, required / 3000.0, rtol=1e-7)
    np.testing.assert_allclose(judged.field, required / 0.75e-3, rtol=1e-7)
    assert judged.limited_field.max() == pytest.approx(3000.0 / 0.75e-3)
    for k, since in enumerate(judged.saturation_time):
        beyond = t[np.abs(volts[:, k]) > 3000.0]
        assert beyond[0] == since if beyond.size else np.isnan(since)
    assert 0 < np.count_nonzero(np.isnan(judged.saturation_time)) < 10
    peaks = np.abs(F_p).max(axis=0)
    np.testing.assert_allclose(judged.mode_required, peaks, rtol=1e-9, atol=1e-9 * peaks.max())
    np.testing.assert_allclose(judged.mode_available, np.abs(Phi_V).sum(axis=1) * 3000.0, rtol=1e-9)
    assert np.all(judged.strain == 0.0)  # held straight


def test_voltages_of_loads_count_in_the_verdict():
    """As many patches as modes: what loads supply need not be found, and the sum stays."""
    load = {"pzt": "link", "voltage": ["150*sin(9*t)"] * 10}
    alone, beside = (judged_of(arm(load=of)).patches["link"] for of in ((), [load]))
    for name in ("required_moment", "factor", "slew", "current"):
        np.testing.assert_allclose(getattr(beside, name), getattr(alone, name), rtol=1e-6)


def test_strain_under_a_static_load_is_that_of_the_beam():
    """ε = (t_b/2 + t_p) M(x)/EI with M of the weight, averaged along the patch (Euler–Bernoulli)."""
    solution = arm(STRAIGHT | {"shape": "static"}, "0")
    x = np.linspace(0.025, 0.075, 201)  # the first patch
    M = 7850.0 * 0.025 * 0.015 * 9.81 * (1 - x) ** 2 / 2
    expected = (0.0075 + 0.75e-3) * M.mean() / (2.068427e11 * 0.025 * 0.015**3 / 12)
    assert judged_of(solution).patches["link"].strain[0] == pytest.approx(expected, rel=0.05)  # of ten modes


def modal_forces(solution):
    """(T, n) that patches have to supply."""
    return actuator_forces(solution.analyses["motion"].run).modal["link"]


@pytest.mark.parametrize("word", ["limit", "layers", "thickness"])
def test_remedies_do(word):
    """With the limit, layers or thickness named, and nothing else changed, the worst patch just suffices."""
    solution = arm()
    layout, F_p = solution.patches["link"].arrays["link"].layout, modal_forces(solution)
    remedies = judged_of(solution).patches["link"].remedies
    assert judged_of(solution).patches["link"].factor.max() > 2.0

    def factor(**keys):
        changed, body = layout.model_copy(update=keys), solution.bodies["link"]
        other = link_patches([changed], body.modal, body.carrying)
        return np.abs(other.voltages(F_p)["link"].required / other.amplifiers.range[1]).max()

    match word:
        case "limit":
            assert factor(limit=remedies.limit) == pytest.approx(1.0, rel=1e-9)
            unequal = judged_of(arm(limit=[1e6] * 9 + [LIMIT])).patches["link"]  # the last is worst, and needs least
            assert unequal.remedies.limit == pytest.approx(remedies.limit, rel=1e-9)
        case "layers":
            assert factor(layers=remedies.layers) <= 1.0 < factor(layers=remedies.layers - 1)
        case "thickness":
            same_field = LIMIT * remedies.thickness / 0.75e-3
            assert factor(thickness=remedies.thickness, limit=same_field) == pytest.approx(1.0, rel=1e-9)


def test_layers_that_stiffen_and_slow_amplifiers_have_no_such_remedies():
    stiff = judged_of(arm(structural=["stiffness"])).patches["link"].remedies
    assert (stiff.layers, stiff.thickness) == (0, np.inf)
    solution = arm(limit=None, amplifier={"slew": 10.0, "range": [-2e6, 1e6]})
    slow = judged_of(solution).patches["link"]
    (row,) = voltage_cells(ffrobot.solve(solution.scene), "motion")
    share = np.max(slow.required_moment / slow.available_moment)
    assert float(row["required /\nlimit"]) == pytest.approx(share, rel=5e-3)
    assert share < 1.0 < slow.factor.max()
    assert (slow.remedies.limit, slow.remedies.layers, slow.remedies.count) == (np.inf, 0, 0)


def test_number_of_patches_that_would_do():
    """Found by trying; a limit between the needs of 10 and of 20 patches has an answer, a lower one has none."""
    solution = arm()
    layout, body = solution.patches["link"].arrays["link"].layout, solution.bodies["link"]

    def needs(count):
        other = with_count(layout, body.modal, body.carrying, count)
        return other and np.abs(other.voltages(modal_forces(solution))["link"].required).max()

    assert needs(21) is None  # 21 × 0.05 m on 1 m
    least = min(needs(count) for count in range(10, 21))
    assert least < needs(10)
    between = judged_of(arm(limit=0.5 * (least + needs(10)))).patches["link"].remedies
    assert 10 < between.count <= 20
    assert needs(between.count) <= 0.5 * (least + needs(10)) < needs(between.count - 1)
    without = judged_of(arm(limit=0.9 * least)).patches["link"].remedies
    assert (without.count, without.most_count) == (0, 20)
    assert without.most_factor == pytest.approx(needs(20) / (0.9 * least), rel=1e-9)


def test_motors_peak_by_peak():
    """τ = J θ̈ + m g L/2 cos θ of a link held straight, θ̇ = 0.2 cos 2t, and their product."""
    motor = judged_of(arm()).motors["O"]
    t, m = np.arange(51) * 0.01, 7850.0 * 0.025 * 0.015
    theta, rate, acceleration = 0.1 * np.sin(2 * t), 0.2 * np.cos(2 * t), -0.4 * np.sin(2 * t)
    tau = m / 3 * acceleration + m * 9.81 / 2 * np.cos(theta)
    assert motor.speed == pytest.approx(0.2, rel=1e-12)
    largest = np.abs(tau).max(), np.abs(tau * rate).max()
    assert (motor.moment, motor.power) == pytest.approx(largest, rel=1e-9)
    assert (motor.moment_limit, motor.speed_limit, motor.power_limit) == (10.0, 0.2, 1e3)
    assert (motor.factor, motor.saturation_time) == pytest.approx((motor.moment / 10.0, 0.0))


def test_predicted_shift_of_the_tip_is_what_happens():
    """Held by its motor under its weight: patches at their limits against patches without, each solved statically."""
    straight = arm(target="0")
    voltages = straight.analyses["motion"].actuation.voltages["link"]
    tips = []
    for volts in (voltages.required[0], voltages.within_limit[0]):
        load = {"pzt": "link", "voltage": [f"{v!r}" for v in volts.tolist()]}
        held = arm({"kind": "static"}, "0", load=[load])
        tips.append(deflection(held.analyses["motion"].run, "link.tip")[0, 1])
    assert abs(tips[0]) < 1e-12  # straight
    shift = straight.analyses["motion"].predicted_shift["link.tip"][0]
    np.testing.assert_allclose(shift, [0.0, tips[1], 0.0], rtol=1e-9, atol=1e-15)


def test_rms_and_shares_of_time_by_hand():
    """τ = m g L/2 + J θ̈ at θ ≈ 0 over whole periods; speed 0.2 |cos 2t| against a limit of 0.1: beyond for 2/3."""
    periods = STRAIGHT | {"end": np.pi, "output_step": np.pi / 2000}
    motor = judged_of(arm(periods, "1e-3*sin(2*t)", motor={"speed_limit": 1e-3})).motors["O"]
    m = 7850.0 * 0.025 * 0.015
    swing = m / 3 * 4e-3  # amplitude of J θ̈; the weight's moment changes by θ²/2 only
    assert motor.rms_moment == pytest.approx(np.hypot(m * 9.81 / 2, swing / np.sqrt(2)), rel=1e-6)
    assert motor.share_beyond == pytest.approx(2 / 3, abs=2e-3)
    assert not motor.has_spike


def test_jump_of_a_path_is_seen():
    """From rest at t = 0 with 0.2 rad/s² at once, or smoothly."""
    for value, jump in (("0.1*t**2", "acceleration"), ("0.1*sin(2*t)**2*t**2", "")):
        assert path_jump(arm(target=value).analyses["motion"].run, 0) == jump


def test_short_peaks_of_motors_only_are_laid_to_the_jerk():
    """Three links with rotors along a quintic, whose jerk jumps at both ends, and along a path whose jerk does not."""
    u = "(t/0.5)"
    quintic = f"(10*{u}**3 - 15*{u}**4 + 6*{u}**5)"
    smooth = f"(126*{u}**5 - 420*{u}**6 + 540*{u}**7 - 315*{u}**8 + 70*{u}**9)"
    spikes = []
    for law in (quintic, smooth):
        results = ffrobot.solve(three_links(law))
        about = dict(results.attributes("motors/feasibility/joints/shoulder"))
        spikes.append((about["moment"] > 1.1 * about["usual_moment"], about["jump"]))
        peak = np.abs(results["motors/joints/shoulder/moment"]).argmax()
        assert about["moment_time"] == pytest.approx(results.time("motors")[peak], abs=0.0005)  # between outputs
    assert spikes == [(True, "jerk"), (False, "")]


def three_links(law):
    """Upper arm, forearm and hand, their tip and their hand's angle led along a law of motion from 0 to 1."""
    modes = {"count": 4, "attachment_modes": False, "family": "in-plane-bending"}
    links = {"upper": 0.5, "fore": 0.5, "hand": 0.15}
    bodies = [
        {"name": name, "link": beam_link(length, tube(0.04, 0.034), 10, modes=modes, damping={"ratio": 0.01})}
        for name, length in links.items()
    ]
    motors = ("shoulder", 100.0, 6e-5), ("elbow", 100.0, 2e-5), ("wrist", 50.0, 1e-5)
    before = ("ground", *(f"{name}.tip" for name in links))
    joints = [
        {"name": name, "type": "revolute", "between": [a, f"{b}.root"], "gear_ratio": N, "rotor_inertia": J}
        for (name, N, J), a, b in zip(motors, before, links, strict=False)
    ]
    tip = {"name": "tip", "point": "hand.tip", "x": f"0.85 - 0.2*{law}", "y": f"0.2 + 0.2*{law}"}
    return ffrobot.make_scene(
        name="three links", gravity=[0.0, -9.81], body=bodies, joint=joints,
        payload=[{"point": "hand.tip", "mass": 1.0}],
        initial={"state": "static", "angles": {"upper": "60*deg", "fore": "-20*deg", "hand": "-30*deg"}},
        trajectory=[tip, {"name": "grip", "angle": "hand", "value": f"-0.5 + 0.3*{law}"}],
        analysis=[{"name": "motors", "kind": "motors-only", "end": 0.5, "output_step": 0.0005}],
    )  # fmt: skip
