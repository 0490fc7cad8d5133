"""Patches without a voltage of an amplifier: open electrodes in closed form, resistors by their charge as a state."""

from functools import partial

import numpy as np
import pytest
from beam_links import beam_link, modal_body, rectangle
from one_link import one_link
from patches_on_links import SCENE, patched

import ffrobot
from ffrobot.actuation.patches.link_patches import link_patches
from ffrobot.actuation.patches.records import PztLayout
from ffrobot.common.errors import InputError
from ffrobot.common.validation import validate
from ffrobot.mbs.model.body import from_modal_body
from ffrobot.mbs.run.context import amplifiers_on, strain_directions
from ffrobot.run.solve import prepare_scene

E, L, H, B = 70e9, 0.3, 0.004, 0.02
E_P, D31, T_P, EPS = 61e9, -179e-12, 1e-3, 1700 * 8.8541878128e-12
LINK = beam_link(L, rectangle(H, B), 20, E=E, nu=0.3, name="strip", modes={"count": 8, "family": "in-plane-bending"})
PATCH = {
    "body": "strip", "centers": (L / 2,), "length": L, "width": B, "thickness": T_P, "modulus": E_P, "d31": D31,
    "face": "both", "permittivity": EPS,
}  # fmt: skip

PLACE = {"centers": (0.06,), "length": 0.1}


@pytest.fixture(scope="module")
def strip():
    return modal_body(LINK)


def layout(**keys):
    return validate(PztLayout, PATCH | keys, SCENE)


def read_by_modes(of_link, body):
    """Readings by the modal coordinates of the equations, V/(m·√kg)."""
    own = of_link.bodies["strip"]
    return np.linalg.solve(own.capacitance, own.charge.T) @ body.modal_transform


@pytest.mark.parametrize("count", [1, 3])
def test_open_patches_along_a_cantilever_under_a_force_at_its_tip(strip, count):
    """EI κ = M + c V, c ∫κ dx + C V = 0 on each patch of length l: the tip moves by (F L³/3 + Σ c V l (L − x))/EI."""
    keys = {"centers": [L * (k + 0.5) / count for k in range(count)], "length": L / count}
    A, S, I = (2 * B * np.diff([(H / 2) ** k, (H / 2 + T_P) ** k])[0] / k for k in (1, 2, 3))  # noqa: E741
    EI, c = E * B * H**3 / 12 + E_P * I, E_P * D31 * S / T_P
    C = A * L / count / T_P**2 * (EPS - E_P * D31**2)
    arm = L / count * (L - np.array(keys["centers"]))  # ∫ (L − x) dx
    V = -c * arm / (C * EI + c**2 * L / count)
    for electrodes, expected in (("shorted", L**3 / 3 / EI), ("open", (L**3 / 3 + c * V @ arm) / EI)):
        body = patched(strip, one := layout(electrodes=electrodes, **keys))
        tip = body.points["tip"].translation[1]
        assert tip**2 @ (1.0 / body.stiffness) == pytest.approx(expected, rel=1e-6)
    volts = read_by_modes(link_patches([one], strip, body), body)
    assert volts @ (tip / body.stiffness) == pytest.approx(-V, rel=1e-6)


@pytest.mark.parametrize("share", [0.3, 1.0, 4.0])
def test_resistor_against_the_charge_as_a_state(strip, share):
    """R q̇ + (q − Φᵀp)/C = 0; the stiffness and damping of each mode's own frequency miss it by (k² of it)²."""
    shorted, opened = (patched(strip, layout(electrodes=of, **PLACE)) for of in ("shorted", "open"))
    omega = np.sqrt(shorted.stiffness)
    T = np.linalg.lstsq(opened.modal_transform, shorted.modal_transform, rcond=None)[0]
    values, vectors = np.linalg.eigh(T.T @ np.diag(opened.stiffness) @ T - np.diag(shorted.stiffness))
    Phi, n = vectors[:, -1] * np.sqrt(values[-1]), len(omega)  # over √C
    assert np.abs(values[:-1]).max() < 1e-9 * values[-1]
    lag = share / omega[0]  # R C
    zero, none = np.zeros((n, n)), np.zeros((n, 1))
    A = np.block(
        [
            [zero, np.eye(n), none],
            [-np.diag(omega**2) - np.outer(Phi, Phi), zero, Phi[:, None]],
            [Phi[None] / lag, none.T, -np.ones((1, 1)) / lag],
        ]
    )
    exact = np.linalg.eigvals(A)
    exact = exact[np.argsort(np.abs(exact - 1j * omega[0]))[0]]
    driven = link_patches([layout(**PLACE)], strip, shorted)
    C = np.sum((shorted.modal_transform.T @ driven.Phi_V[:, 0]) ** 2) / (Phi @ Phi)
    body = patched(strip, layout(shunt=lag / C, **PLACE))
    Z, I = np.zeros((n, n)), np.eye(n)  # noqa: E741
    found = np.linalg.eigvals(np.block([[Z, I], [-np.diag(body.stiffness), -body.damping]]))
    found = found[np.argsort(np.abs(found - 1j * omega[0]))[0]]
    assert -exact.real / abs(exact) > 0.002
    assert found.real == pytest.approx(exact.real, rel=0.03)
    assert abs(found) - omega[0] == pytest.approx(abs(exact) - omega[0], rel=0.05, abs=2e-5 * omega[0])


@pytest.mark.parametrize("count", [2, 8])
@pytest.mark.parametrize("electrodes", ["driven", "open"])
@pytest.mark.parametrize(("face", "offset"), [("both", 0.0), ("+y", 0.0), ("+y", 4e-3)])
def test_readings_of_a_patch_under_a_force_at_the_tip(electrodes, face, offset, count):
    """q = ∫ f·e dx of the composite section under the moments of the force, by however few modes; V = q/C."""
    w, force, keys = 0.008, np.array([0.0, 1.0, 0.5]), {"count": count, "family": "all"}
    body = modal_body(LINK | {"modes": keys})
    keys = PATCH | PLACE | {"width": w, "face": face, "offset": offset, "electrodes": electrodes}
    spatial = patched(body, one := validate(PztLayout, keys, SCENE, None, "spatial"))
    volts = read_by_modes(link_patches([one], body, spatial), spatial)
    found = volts[0] @ (force @ spatial.points["tip"].translation / spatial.stiffness)
    faces, sign = (2, 0.0) if face == "both" else (1, 1.0)
    A, arm, I = (faces * w * np.diff([(H / 2) ** k, (H / 2 + T_P) ** k])[0] / k for k in (1, 2, 3))  # noqa: E741
    rows = [[A, -sign * arm, -A * offset], [-sign * arm, I, sign * arm * offset]]
    across = [-A * offset, sign * arm * offset, A * (offset**2 + w**2 / 12)]
    EA, EI, EI_z = E * H * B, E * B * H**3 / 12, E * H * B**3 / 12
    f = E_P * D31 / T_P * np.array([-sign * A, arm, sign * A * offset])
    K, length = np.diag([EA, EI, EI_z]) + E_P * np.array([*rows, across]), PLACE["length"]
    charge = length * f @ np.linalg.solve(K, (L - PLACE["centers"][0]) * np.array([0.0, *force[1:]]))
    C = A * length / T_P**2 * EPS
    if electrodes == "open":
        C += length * (f @ np.linalg.solve(K, f) - A / T_P**2 * E_P * D31**2)
    assert found == pytest.approx(charge / C, rel=1e-6)


@pytest.mark.parametrize(
    ("strip", "structural"),
    [({}, True), ({}, False), ({"count": 8, "pieces": 2}, True), ({"count": 8, "modes": 2}, True)],
)
def test_slow_charges_and_readings_by_any_number_of_modes(strip, structural):
    """q = C V + c² l V/EI of a pair alone, read without C V; gauges and pairs beside it read loads alone."""
    of_body, far = {"count": 2} | strip, 0.2
    modes = {"count": of_body.pop("count"), "family": "in-plane-bending"}
    link = LINK | {"modes": modes, "stress": {"points": {"gauge": [0.14, -H / 2, 0.0], "under": [0.2, -H / 2, 0.0]}}}
    gauges = [{"strain": "strip.gauge"}, {"strain": "strip.under"}]
    seen = {"name": "seen", "kind": "linear", "sensor": [{"pzt": "strip"}, *gauges]}
    pairs = [PATCH | {"centers": [0.06, far], "length": 0.1, "structural": ["stiffness"] if structural else False}]
    scene = one_link("strip", link, seen, body=[{"name": "strip", "link": link} | of_body], pzt=pairs)
    names = [*(f"pzt/strip/{k}" for k in (1, 2)), "strain/strip.gauge"]
    model = (results := ffrobot.solve(scene)).linear("seen")[0]
    doubtful = [text.split('"')[1] for text in results.attributes("seen")["warnings"]]
    assert doubtful == ["strip.gauge", "strip.under"]["pieces" not in strip :]
    by_volt, by_force = (
        model.frequency_response(1e-3 * np.ones(1), of, names)[0, :, 0] for of in (names[0], "force/strip.tip/y")
    )
    A, S, I = (2 * B * np.diff([(H / 2) ** k, (H / 2 + T_P) ** k])[0] / k for k in (1, 2, 3))  # noqa: E741
    bare, c, free = E * B * H**3 / 12, E_P * D31 * S / T_P, A * 0.1 / T_P**2 * EPS
    EI = bare + E_P * I * structural
    np.testing.assert_allclose(by_volt, [c**2 * 0.1 / EI / free, 0.0, 0.0], rtol=1e-6, atol=1e-9)
    prepared = prepare_scene(scene)
    Phi_V = strain_directions(prepared.model, prepared.patches)
    found = amplifiers_on(prepared.model, prepared.patches).capacitance + prepared.model.compliance(Phi_V, Phi_V)
    clamped = free - A * 0.1 / T_P**2 * E_P * D31**2
    np.testing.assert_allclose(found, (clamped + c**2 * 0.1 / EI) * np.eye(2), rtol=1e-9, atol=1e-9 * clamped)
    if not of_body:
        assert by_force[1:] == pytest.approx([c * 0.1 * (L - far) / EI / free, (L - 0.14) * H / 2 / bare], rel=1e-6)


def test_voltages_leave_out_passive_patches(strip):
    """Whatever is asked, they get none, and nothing drives the link."""
    spatial = from_modal_body("strip", strip)
    driven, open_ = (
        layout(name=name, centers=[x], length=0.1, allocation="least-squares", **keys)
        for name, x, keys in (("driven", 0.06, {}), ("sensor", 0.2, {"electrodes": "open"}))
    )
    alone, both = (link_patches(layouts, strip, spatial) for layouts in ([driven], [driven, open_]))
    only = link_patches([open_], strip, spatial)
    F_p = np.ones((1, strip.mode_count))
    found = both.voltages(F_p)
    assert [*found["sensor"].required, *only.voltages(F_p)["sensor"].within_limit] == [[0.0], [0.0]]
    assert found["driven"].required == pytest.approx(alone.voltages(F_p)["driven"].required, rel=0.1)
    assert not both.Phi_V[:, 1].any()


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"shunt": 1e4, "electrodes": "driven"}, 'expected a shunt in the place of electrodes = "driven", found both'),
        ({"shunt": 1e4, "limit": 100.0}, 'expected no "limit" with a shunt, which takes no voltage, found one'),
        ({"electrodes": "open", "amplifier": {"slew": 1.0}}, 'expected no "amplifier" with electrodes = "open"'),
        ({"shunt": 0.0}, "greater than 0"),
        ({"permittivity": 1e-9, "shunt": 1e4}, "expected a permittivity above 1.955e-09 F/m"),
        ({"electrodes": "open", "structural": False}, 'expected a face, structural with "stiffness"'),
        ({"strain": "biaxial"}, 'expected the key "poissons_ratio" with strain = "biaxial"'),
        ({"poissons_ratio": 1.2}, "expected a poissons_ratio between -1 and 1"),
    ],
)
def test_contradictions(keys, message):
    with pytest.raises(InputError, match=message):
        layout(**keys)


def test_voltages_for_passive_patches_are_refused():
    bent, shunted = {"name": "bent", "kind": "static"}, [PATCH | {"shunt": 1e4}]
    with pytest.raises(InputError, match=r'load no. 1: pzt: expected patches that voltages drive .*, found "strip"'):
        one_link("strip", LINK, bent, pzt=shunted, load=[{"pzt": "strip", "voltage": ["1.0"]}])
    seen = {"name": "seen", "kind": "linear", "sensor": [{"pzt": "strip"}]}
    with pytest.raises(InputError, match=r'"seen": sensor: pzt: expected patches without a shunt.*, found "strip"'):
        one_link("strip", LINK, seen, pzt=shunted)
    damper = {"kind": "modal-velocity", "bodies": ["strip"], "damping_ratio": 0.1}
    damped = {"kind": "closed-loop", "actuation": "bent", "sample_time": 1e-3, "controller": [damper]}
    with pytest.raises(InputError, match=r'"damped": bodies: expected patches that voltages drive .*, found "strip"'):
        one_link("strip", LINK, bent, {"name": "damped"} | damped, pzt=shunted)


def test_passive_patches_need_nothing_and_pieces_leave_their_charge_whole():
    """A shunt acts at frequencies of the whole link; a cut would make two charges of one."""
    damped = LINK | {"damping": {"rayleigh": [0.0, 1e-7]}}
    turned = {"name": "turned", "kind": "pcid", "end": 0.1, "output_step": 0.01}
    halves = [{"name": "strip", "link": damped, "pieces": 2}]
    turning = partial(one_link, "strip", damped, turned, joint={}, target="0.1*t**3")
    with ffrobot.solve(turning(pzt=[PATCH | PLACE | {"shunt": 1e4}])) as results:
        assert not results.verdict["turned"].patches
    for keys, message in (
        ({"shunt": 1e4, **PLACE}, "shunt: expected a link in one piece with a shunt, found 2 pieces"),
        ({"electrodes": "open"}, 'through a patch with electrodes = "open", found one at 0.15 m'),
    ):
        with pytest.raises(InputError, match=message):
            ffrobot.solve(turning(body=halves, pzt=[PATCH | keys]))
