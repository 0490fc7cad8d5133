"""Placement of patches: against gramians, closed forms of beams, and exhaustive search."""

import numpy as np
import pytest
from beam_links import beam_link, modal_body, paper_link, rectangle
from patches_on_links import SCENE, patches, planar_body
from scipy.linalg import solve_continuous_lyapunov

import ffrobot
from ffrobot.actuation.control.linear_model import state_space
from ffrobot.actuation.control.placement import PatchableLink, Placement, locked_modes, place
from ffrobot.common.errors import InputError
from ffrobot.mbs.linear.linearisation import LinearEquations
from ffrobot.mbs.model.build import build_model
from ffrobot.scene.load import make_scene


@pytest.fixture(scope="module")
def arm(cantilever):
    """One link on a motor: (modal body, planar body, linear model); modes are those of the file."""
    modal = cantilever(6)
    planar = planar_body(modal, "arm")
    rigid = {"mass": 1.0, "inertia": 1.0, "center": [0.0, 0.0], "points": {"root": [0.0, 0.0]}}
    scene = make_scene(
        name="arm", gravity=[0.0, 0.0], body=[{"name": "arm", "rigid": rigid}],
        joint=[{"name": "hub", "type": "revolute", "between": ["ground", "arm.root"]}],
        analysis=[{"name": "linear", "kind": "linear"}],
    )  # fmt: skip
    model = build_model(scene, [planar])
    rest = np.zeros(model.tree.n_v)
    return modal, planar, state_space(LinearEquations(model, rest).at(0.0, rest, rest, rest))


def link_of(modal, planar, count):
    def elsewhere(**changes):
        return patches(modal, planar, allocation="least-squares", **({"count": count} | changes))

    return PatchableLink(elsewhere(), ("arm",), np.eye(planar.n_modes), elsewhere)


def placed(arm, count, F_p=None, **keys):
    modal, planar, model = arm
    wanted = Placement(body="arm", count=count, **keys)
    return place(SCENE, wanted, link_of(modal, planar, count), None if F_p is not None else model, F_p)


def test_held_modes_are_those_of_the_clamped_link(arm):
    modal, planar, model = arm
    frequency, _, share = locked_modes(model, link_of(modal, planar, 1), 3)
    np.testing.assert_allclose(frequency, np.sqrt(planar.stiffness[:3]) / (2 * np.pi), rtol=1e-9)
    np.testing.assert_allclose(share, 1.0, rtol=1e-9)


def test_reach_is_what_the_gramian_grows_with(arm):
    """Diagonal of the controllability gramian of the lightly damped modes: Σ b²/(4 ζ ω) in velocity coordinates."""
    modal, planar, _ = arm
    found = placed(arm, 2, modes=3)
    ratios = []
    for centers in (found.best.centers, found.even.centers):
        B = patches(modal, planar, centers=tuple(centers), allocation="least-squares").Phi_V
        omega, n = np.sqrt(planar.stiffness), planar.n_modes
        A = np.block([[np.zeros((n, n)), np.diag(omega)], [-np.diag(omega), -np.diag(2e-4 * omega)]])
        gramian = solve_continuous_lyapunov(A, -np.vstack([0 * B, B]) @ np.vstack([0 * B, B]).T)
        ratios.append(np.diag(gramian)[n : n + 3])
    np.testing.assert_allclose(found.best.reach / found.even.reach, ratios[0] / ratios[1], rtol=1e-3)


def test_evenly_spread_patches_at_nodes_do_nothing():
    """Mode 2 of a supported link has its node at the middle, and its largest curvature at a quarter."""
    second = {"indices": [2], "family": "in-plane-bending", "attachment_modes": False}
    modal = modal_body(paper_link("simply-supported") | {"modes": second})
    link = link_of(modal, planar_body(modal), 2)
    found = place(SCENE, Placement(body="link", count=1), link, None, np.ones((1, 1)))
    pairs = [(abs(of.centers.item() - 0.5), of.reach.item()) for of in (found.best, found.even)]
    np.testing.assert_allclose(pairs, [(0.25, 1.0), (0.0, 0.0)], atol=1e-12)  # either quarter


@pytest.mark.parametrize("measure", ["worst", "mean", "product"])
def test_evolution_finds_what_exhaustive_search_finds(arm, measure):
    exhaustive = placed(arm, 3, modes=4, measure=measure)
    evolved = placed(arm, 3, modes=4, measure=measure, most_sets=10)
    assert (exhaustive.method, evolved.method) == ("all sets", "evolution")
    np.testing.assert_allclose(evolved.best.centers, exhaustive.best.centers)
    assert exhaustive.best.value > exhaustive.even.value


@pytest.mark.parametrize("count", [2, 5, 10])
def test_patches_stay_on_the_link_and_off_each_other(arm, count):
    centers = placed(arm, count, modes=2, spacing=0.03, most_sets=2000).best.centers
    assert 0.025 - 1e-12 <= centers[0] <= centers[-1] <= 0.975 + 1e-12
    assert np.diff(centers).min(initial=1.0) >= 0.05 - 1e-12


def test_voltages_over_a_path(arm):
    """Forces of the first mode alone: one patch at the clamp takes the least voltage; two patches share it."""
    _, planar, _ = arm
    F_p = np.outer(np.sin(np.linspace(0.0, 3.0, 50)), np.eye(planar.n_modes)[0])
    one = placed(arm, 1, F_p, criterion="voltage", modes=1)
    assert one.best.centers == pytest.approx([0.025])
    assert one.largest_voltage[0] == pytest.approx(-one.best.value)
    assert one.largest_voltage[0] < one.largest_voltage[1]
    two = placed(arm, 2, F_p, criterion="voltage", modes=1)
    assert two.best.centers == pytest.approx([0.025, 0.075])
    assert two.largest_voltage[0] < one.largest_voltage[0]


STEP = 1e-3
PATCH = {"body": "arm", "length": 0.06, "width": 0.02, "thickness": 0.5e-3, "modulus": 63e9, "d31": 110e-12}
PATCH |= {"structural": False, "allocation": "least-squares", "permittivity": 1.5e-8}
OPEN = {"electrodes": "open", "face": "+y", "structural": ["stiffness"]}
NOISY = {"joint": "hub", "noise": 1e-5}
ESTIMATE = {
    "modes": 2, "process": {"force/arm.tip/y": 2.0, "joint/hub": 0.1}, "noise": 0.5, "sample_time": STEP,
    "tip": "arm.tip", "sensor": [NOISY],
}  # fmt: skip


def scene_of(patch, pieces, *analyses):
    link = beam_link(0.6, rectangle(0.004, 0.02), 20, damping={"rayleigh": [0.0, 1e-5]}, modes={"count": 3})
    return make_scene(
        name="arm", gravity=[0.0, 0.0], body=[{"name": "arm", "link": link, "pieces": pieces}],
        joint=[{"name": "hub", "type": "revolute", "between": ["ground", "arm.root"], "motor": True}],
        trajectory=[{"name": "still", "joint": "hub", "value": "0"}], pzt=[PATCH | patch], analysis=list(analyses),
    )  # fmt: skip


def sensors_placed(patch, pieces=1, estimate=ESTIMATE, **keys):
    wanted = {"body": "arm", "count": 1, "criterion": "estimate", "estimate": estimate, "spacing": 0.06} | keys
    return ffrobot.solve(scene_of(patch, pieces, {"name": "where", "kind": "placement", "placement": wanted}))


def deviation_in_a_loop(patch, pieces=1):
    """That of the tip, m, by the filter of a closed loop."""
    observer = {"kind": "kalman", "modes": 2, "process": ESTIMATE["process"]}
    sensors = [*ESTIMATE["sensor"], {"pzt": "arm", "noise": ESTIMATE["noise"]}]
    loop = {"name": "loop", "kind": "closed-loop", "actuation": "inverse", "sample_time": STEP, "tip": "arm.tip"}
    inverse = {"name": "inverse", "kind": "pcid", "end": 0.01, "output_step": STEP}
    found = ffrobot.solve(scene_of(patch, pieces, inverse, loop | {"observer": observer, "sensor": sensors}))
    return float(np.sqrt(np.square(found["loop/control/estimate/points/arm.tip/sigma"][0]).sum()))


def test_patches_as_sensors_by_the_deviation_of_the_estimated_tip():
    """The value is the deviation that the filter of a closed loop has with its patch there, and the least of all."""
    results = sensors_placed({"count": 1})
    best = results["where/placement/best/centers"][()]
    value = -results["where/placement/best/value"][()]
    assert deviation_in_a_loop({"centers": [float(x) for x in best]}) == pytest.approx(value, rel=1e-6)
    places = results["where/placement/candidates"][()][::3]
    assert all(deviation_in_a_loop({"centers": [float(x)]}) >= value * (1 - 1e-6) for x in places)


@pytest.mark.parametrize("pieces", [1, 2])
@pytest.mark.parametrize("patch", [{}, OPEN])
def test_estimates_by_patches_of_any_electrodes_and_links_in_pieces(patch, pieces):
    """A patch stays where the scene has it, and so does the stiffness that the filter knows."""
    patch |= {"centers": [0.21]}
    results = sensors_placed(patch, pieces)
    assert results["where/placement/best/centers"][()] == pytest.approx([0.21])
    assert -results["where/placement/best/value"][()] == pytest.approx(deviation_in_a_loop(patch, pieces), rel=1e-6)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"sensor": [{"joint": "hub"}]}, 'estimate: expected sensors with noise, .* none of these of "joint/hub'),
        ({"sensor": []}, "estimate: expected sensors that see every .*: they cannot see joint/hub"),
        ({"sensor": [NOISY | {"delay": 1.5 * STEP}]}, r"multiple of sample_time \(0.001 s\) as delay"),
        ({"sensor": [NOISY | {"sample_time": 2 * STEP}]}, "read at every sample, found no. 1 slower"),
        ({"process": {"force/arm.top/y": 1.0}}, 'process: expected a point of "arm" .*, found "arm.top"'),
        ({"process": {"force": 1.0}}, 'process: expected motors .*, found "force"'),
    ],
)
def test_filters_that_patches_cannot_serve(keys, said):
    with pytest.raises(InputError, match=said):
        sensors_placed({"count": 1}, estimate=ESTIMATE | keys)
