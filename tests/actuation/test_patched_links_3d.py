"""Patches in 3D on a link from stage 1: closed forms of bending in both planes and of twist, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from beam_links import beam_link, modal_body, rectangle, tube
from patches_on_links import SCENE, patched

from ffrobot.actuation.feasibility import judge_patches
from ffrobot.actuation.patches.link_patches import check_reach, link_patches
from ffrobot.actuation.patches.records import PztLayout, plain_lamina
from ffrobot.common.errors import InputError
from ffrobot.common.validation import validate
from ffrobot.fe_models.beam.section_stress import surface_shear
from ffrobot.mbs.model.body import from_modal_body

E, NU, L = 70e9, 0.33, 0.4
G = E / (2 * (1 + NU))
START, END, VOLT, WIDE = 0.06, 0.14, 100.0, 0.005
PLAIN = {"modulus": 63e9, "d31": 110e-12, "thickness": 0.5e-3}
FIBRES = {
    "modulus": 30.3e9, "modulus_across": 15.9e9, "shear_modulus": 5.5e9, "poissons_ratio": 0.31, "d33": 400e-12,
    "d31": -170e-12, "thickness": 0.3e-3, "electrode_spacing": 0.5e-3,
}  # fmt: skip
SQUAT = rectangle(0.006, 0.014)
TUBE = tube(0.020, 0.018)


def link(section, count=12, family="all"):
    return modal_body(beam_link(L, section, 10, nu=NU, modes={"count": count, "family": family}))


def layout(**keys):
    places = {} if keys.keys() & {"count", "centers"} else {"centers": [(START + END) / 2], "length": END - START}
    tables = {"body": "link", "width": WIDE, "allocation": "least-squares"} | places | keys
    material = FIBRES if "fibre_angle" in tables else PLAIN
    return validate(PztLayout, material | tables, SCENE)


def tip(body, layouts, volts=None):
    """Φp (3,) and Φ_r p (3,) of the tip under a voltage on all patches, statically, with what the patches stiffen."""
    spatial = patched(body, *layouts)
    found = link_patches(layouts, body, spatial)
    V = np.full(found.Phi_V.shape[1], VOLT) if volts is None else np.asarray(volts, dtype=float)
    p = spatial.modal_transform.T @ (found.Phi_V @ V) / spatial.stiffness
    at = spatial.points["tip"]
    return at.translation @ p, at.rotation @ p


def bending(h, b, faces, offset=0.0, beside=0.0):
    """Curvatures towards the layers' normal and across it, and stretch: a fiber at η, ζ strains u' − η κ − ζ κ_t.

    Of the composite section by Gauss points of the layers, on faces h apart; `beside`: other rigidity of bending.
    """
    t, Ep = PLAIN["thickness"], PLAIN["modulus"]
    nodes, weights = np.polynomial.legendre.leggauss(3)
    stiffness, load = np.diag([E * b * h**3 / 12 + beside, E * h * b**3 / 12, E * b * h]), np.zeros(3)
    for sign in (1, -1)[:faces]:
        for i, j in np.ndindex(3, 3):
            fiber = np.array([-sign * (h + t + t * nodes[i]) / 2, -(offset + WIDE * nodes[j] / 2), 1.0])
            force = Ep * t * WIDE * weights[i] * weights[j] / 4
            stiffness += force * np.outer(fiber, fiber)
            load -= sign * force * PLAIN["d31"] * VOLT / t * fiber
    return np.linalg.solve(stiffness, load)


@pytest.mark.parametrize(("bends", "axis", "names"), [("in-plane", 1, ("+y", "-y")), ("out-of-plane", 2, ("+z", "-z"))])
@pytest.mark.parametrize("face", [None, "both", 0, 1])
def test_tip_of_a_cantilever_in_both_planes(bends, axis, names, face):
    """w(L) = κ (x2 − x1)(L − (x1 + x2)/2) of the composite section: towards +y or +z on whichever face patches lie."""
    h, b = 0.006, 0.014
    body = link(rectangle(h, b))
    name = names[face] if isinstance(face, int) else face
    translation, rotation = tip(body, [layout(bends=bends, face=name)])
    across = (h, b) if axis == 1 else (b, h)
    curvature, _, stretch = bending(*across, 2 if face == "both" else 1)
    expected = np.zeros(3)
    expected[axis] = curvature * (END - START) * (L - (START + END) / 2)
    if isinstance(face, int):
        expected[0] = stretch * (1 if face == 0 else -1) * (END - START)
    np.testing.assert_allclose(translation, expected, atol=2e-7 * abs(expected[axis]))
    assert rotation[3 - axis] == pytest.approx((1 if axis == 1 else -1) * curvature * (END - START), rel=1e-6)
    assert abs(rotation[0]) < 1e-12 * abs(rotation[3 - axis])


@pytest.mark.parametrize(("bends", "face", "normal"), [("in-plane", "+y", 1), ("out-of-plane", "+z", 2)])
@pytest.mark.parametrize("offset", [0.004, -0.002])
def test_patches_off_the_middle_bend_about_both_axes(bends, face, normal, offset):
    sides = (0.01, 0.014)
    body = link(rectangle(*sides))
    translation, _ = tip(body, [layout(bends=bends, face=face, offset=offset / normal)])
    curvature, across, stretch = bending(*sides[:: 3 - 2 * normal], 1, offset / normal)
    expected = np.zeros(3)
    expected[[normal, 3 - normal]] = np.array([curvature, across]) * (END - START) * (L - (START + END) / 2)
    expected[0] = stretch * (END - START)
    np.testing.assert_allclose(translation, expected, atol=1e-6 * abs(expected[normal]))


def classical(angle):
    """(C, stress per volt) of the layer with σ_s = 0 by transformed stiffnesses Q̄ (Jones 1999, eq. 2.84), not S̄."""
    E1, E2, G12, nu = (FIBRES[key] for key in ("modulus", "modulus_across", "shear_modulus", "poissons_ratio"))
    q = 1 - nu**2 * E2 / E1
    Q = np.array([[E1, nu * E2, 0], [nu * E2, E2, 0], [0, 0, q * G12]]) / q
    c, s = np.cos(angle), np.sin(angle)
    of_strain = np.array([[c * c, s * s, s * c], [s * s, c * c, -s * c], [-2 * s * c, 2 * s * c, c * c - s * s]])
    Q_bar = of_strain.T @ Q @ of_strain
    free = np.linalg.solve(of_strain, np.array([FIBRES["d33"], FIBRES["d31"], 0.0]) / FIBRES["electrode_spacing"])
    kept, out = [0, 2], [1]
    reduce = Q_bar[np.ix_(kept, out)] / Q_bar[1, 1]
    C = Q_bar[np.ix_(kept, kept)] - reduce @ Q_bar[np.ix_(out, kept)]
    held = Q_bar @ free
    return C, held[kept] - reduce[:, 0] * held[1]


def test_ceramic_held_across_in_compliances():
    """σ_x = ε_x/s11 − d31 V/(t s11), free across; with ε_s = 0: (s11 ε_x − (s11 − s12) d31 V/t)/(s11² − s12²)."""
    s11, nu, d31, t = 1 / 63e9, 0.35, -179e-12, 0.5e-3
    s12 = -nu * s11
    for held, stiffness, stress in ((False, 1 / s11, d31 / s11), (True, s11 / (s11**2 - s12**2), d31 / (s11 + s12))):
        found = plain_lamina(1 / s11, d31, t, nu, held=held)
        np.testing.assert_allclose([found.C[0, 0], found.per_volt[0]], [stiffness, stress / t], rtol=1e-14)
        assert found.energy == pytest.approx(2 * d31**2 / (s11 + s12) / t**2, rel=1e-14)
    assert plain_lamina(1 / s11, d31, t).energy == pytest.approx(d31**2 / s11 / t**2, rel=1e-14)


@pytest.mark.parametrize("angle", [np.pi / 4, -np.pi / 4, 0.4])
def test_tube_with_fibres_at_an_angle_twists(angle):
    """Layers on both faces of a tube, γ = r φ': (u', φ') of the section with stiffness and coupling of the layers."""
    body, w, t = link(TUBE), WIDE, FIBRES["thickness"]
    _, rotation = tip(body, [layout(bends="twist", face="both", fibre_angle=angle)])
    C, n = classical(angle)
    r = 0.01
    A, S, I = (2 * w * ((r + t) ** k - r**k) / k for k in (1, 2, 3))  # noqa: E741
    area, moment = np.pi * (0.01**2 - 0.009**2), np.pi / 2 * (0.01**4 - 0.009**4)
    stiffness = np.diag([E * area, G * moment]) + np.array([[C[0, 0] * A, C[0, 1] * S], [C[0, 1] * S, C[1, 1] * I]])
    _, twist = np.linalg.solve(stiffness, VOLT * np.array([n[0] * A, n[1] * S]))
    assert rotation[0] == pytest.approx(twist * (END - START), rel=1e-6)
    assert np.sign(rotation[0]) == np.sign(angle)
    assert np.abs(rotation[1:]).max() < 1e-9 * abs(rotation[0])


def test_thin_strip_with_fibres_at_45_degrees_twists_like_a_plate():
    """κ_xy = 2φ' of plates: GJ φ' = 2 (h + t) w N_xs V/2 on each face; beyond the strip's edges GJ is St Venant's."""
    h, b, w, t = 0.001, 0.03, 0.02, FIBRES["thickness"]
    body = link(rectangle(h, b))
    _, rotation = tip(body, [layout(bends="twist", face="both", fibre_angle=np.pi / 4, width=w, structural=False)])
    N_xs = classical(np.pi / 4)[1][1] * t
    GJ = G * b * h**3 / 3 * (1 - 0.63025 * h / b)  # Timoshenko & Goodier, Theory of Elasticity, §109
    expected = 2 * w * (h + t) * N_xs * VOLT / GJ * (END - START)
    assert rotation[0] == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("ratio", [0.05, 0.3, 1.0, 2.0, 7.0])
def test_shear_around_a_rectangle(ratio):
    """Twice the area is the circulation of the shear of unit twist (Timoshenko & Goodier, §102)."""
    h, b = ratio * 0.01, 0.01
    around = 2 * (b * surface_shear(h, b, b) + h * surface_shear(b, h, h))
    assert around == pytest.approx(2 * h * b, rel=1e-4)


def test_overlap_of_layouts_is_shared():
    """Of patches that overlap in part each stretch has its own section: curvatures add up to the tip."""
    h, b, sides = 0.006, 0.014, {"in-plane": (0.06, 0.14), "out-of-plane": (0.12, 0.2)}
    body = link(rectangle(h, b), 8)
    pair = [
        layout(name=bends, bends=bends, face="both", centers=[sum(ends) / 2], length=0.08)
        for bends, ends in sides.items()
    ]
    other = PLAIN["modulus"] * 2 * PLAIN["thickness"] * WIDE**3 / 12  # of layers beside the axis of bending
    expected = np.zeros(3)
    for axis, across, alone in ((1, (h, b), (0.06, 0.12)), (2, (b, h), (0.14, 0.2))):
        for (start, end), beside in ((alone, 0.0), ((0.12, 0.14), other)):
            expected[axis] += bending(*across, 2, beside=beside)[0] * (end - start) * (L - (start + end) / 2)
    np.testing.assert_allclose(tip(body, pair)[0], expected, atol=1e-6 * expected[1])


def test_round_links_do_not_mix_their_planes():
    """Frequencies in the two planes are equal; patches in one leave the other's modes alone, payload or not."""
    body = link(TUBE)
    spatial = patched(body, layout(structural=True, density=7600.0))
    families = np.array(body.family)
    assert not spatial.modal_transform[families[:, None] != families].any()


def test_mass_of_layers():
    """∫ρ(y² + z²) over the layers; modes stay orthonormal."""
    body = link(SQUAT)
    keys = {"count": 5, "length": 0.05, "structural": True, "density": 7600.0, "face": "both"}
    spatial = patched(body, layout(**keys))
    A, I = 2 * WIDE * 0.5e-3, 2 * WIDE * (0.0035**3 - 0.003**3) / 3  # noqa: E741
    assert spatial.mass - body.mass == pytest.approx(5 * 0.05 * 7600.0 * A, rel=1e-9)
    layers = 5 * 0.05 * 7600.0 * (I + A * WIDE**2 / 12)
    assert spatial.J_spin - body.J_spin == pytest.approx(layers, rel=1e-9)
    np.testing.assert_allclose(spatial.S_bar_kl.trace(axis1=0, axis2=1) + spatial.S_spin, np.eye(len(body.family)),
                               atol=1e-9)  # fmt: skip


def test_voltages_of_two_planes_do_not_disturb_each_other():
    """Each plane finds its voltages as if alone; torsion and stretch are left as they are, mode by mode."""
    body = link(SQUAT)
    spatial = from_modal_body("link", body)
    side, up = (
        layout(name="side", count=4, length=0.05, limit=200.0),
        layout(name="up", bends="out-of-plane", count=3, length=0.05, limit=200.0),
    )
    F_p = np.random.default_rng(0).standard_normal((3, spatial.n_modes))
    together = link_patches([side, up], body, spatial)
    found = together.voltages(F_p)
    for one in (side, up):
        alone = link_patches([one], body, spatial).voltages(F_p)[one.label]
        np.testing.assert_allclose(found[one.label].required, alone.required, rtol=1e-8, atol=1e-8 * alone.largest)
        np.testing.assert_allclose(found[one.label].within_limit, alone.within_limit, atol=1e-4)
    unmet = together.unmet(F_p, np.concatenate([found[name].within_limit for name in ("side", "up")], axis=1))
    left = np.isin(body.family, ("torsion", "axial"))
    np.testing.assert_allclose(unmet[:, left], F_p[:, left], rtol=1e-12)


def test_field_between_interdigitated_electrodes():
    body, time, F_p = link(SQUAT), np.arange(2.0), np.eye(2, 12)
    of_link = link_patches([layout(fibre_angle=0.0)], body, from_modal_body("link", body))
    array, volts = of_link.arrays["link"], of_link.voltages(F_p @ np.eye(12, body.mode_count))["link"]
    p, forces = np.zeros((2, body.mode_count)), np.zeros((2, len(array.Phi_V)))
    judged = judge_patches(array, volts, 0.0 * volts.required, time, p, forces, with_count=None)
    np.testing.assert_allclose(judged.field, np.abs(volts.required).max(axis=0) / 0.5e-3, rtol=1e-12)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"bends": "twist"}, "plain piezoceramic strains alike in all directions of its plane and twists at no angle"),
        ({"bends": "twist", "fibre_angle": 0.0}, "expected fibers at an angle that shear under a voltage"),
        ({"bends": "twist", "fibre_angle": "90*deg"}, "expected fibers at an angle that shear under a voltage"),
        ({"bends": "out-of-plane", "face": "+y"}, r'expected face "\+z", "-z", "both"'),
        ({"face": "-z"}, r'expected face "\+y", "-y", "both" with bends = "in-plane"'),
        ({"d33": 4e-10}, r'expected the keys "fibre_angle", "modulus_across"'),
        ({"fibre_angle": 0.3, "poissons_ratio": 1.5}, "expected a poissons_ratio between -1.38 and 1.38"),
        ({"bends": "sideways"}, "in-plane"),
        ({"offset": 0.001}, 'expected a face and coupling = "rotation" with an offset, found none'),
    ],
)
def test_layouts_that_do_nothing_or_contradict_themselves(keys, message):
    with pytest.raises(InputError, match=message):
        layout(**keys)


def test_patches_that_do_not_fit_their_link():
    body = link(SQUAT)
    spatial = from_modal_body("link", body)
    with pytest.raises(InputError, match=r'pzt "up": expected patches within the link'):
        link_patches([layout(name="up", centers=[0.39], length=0.06)], body, spatial)
    with pytest.raises(InputError, match=r"expected as many patches as modes \(\d+\) or more, found 1"):
        check_reach(link_patches([layout(allocation="exact")], body, spatial))
    for wide in ({"width": 0.015}, {"width": 0.01, "offset": 0.003, "face": "+y"}):
        with pytest.raises(InputError, match=r"width: expected patches on the face of the link, 0.014 m wide at 0"):
            link_patches([layout(**wide)], body, spatial)
    old = replace(body, stations=replace(body.stations, width=None, outline=None))
    imported = replace(body, stations=replace(body.stations, height=np.zeros_like(body.stations.height)))
    for keys, without in (({"bends": "out-of-plane"}, old), ({}, imported)):
        with pytest.raises(InputError, match="an imported or old one: compute it from a link file"):
            link_patches([layout(**keys)], without, spatial)
    upright = link(SQUAT, 4, "out-of-plane-bending")
    for allocation in ("exact", "least-squares"):
        with pytest.raises(
            InputError, match=r'bends: expected eigenmodes of the link that patches for "in-plane" reach'
        ):
            link_patches([layout(allocation=allocation)], upright, from_modal_body("link", upright))
    few = link(SQUAT, 3)  # torsion among its attachment modes only
    assert "torsion" in few.family
    assert "torsion" not in few.family[: few.eigenmode_count]
    twisting = layout(bends="twist", face="both", fibre_angle=np.pi / 4)
    with pytest.raises(InputError, match=r"found eigenmodes in (?!.*torsion).*: add such modes .*a larger count"):
        link_patches([twisting], few, from_modal_body("link", few))
    link_patches([twisting], body, spatial)  # the remedy: a larger count
    with pytest.raises(InputError, match="expected no weights with other layouts"):
        link_patches([layout(name="a", point_weights={"tip": 1.0}), layout(name="b", bends="out-of-plane")],
                     body, spatial)  # fmt: skip
