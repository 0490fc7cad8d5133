"""Patches on a link from stage 1: deflection in closed form, virtual work, and what is refused."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from beam_links import modal_body, paper_link
from patches_on_links import layout, modes_in_the_plane, on_link, patches, planar_body

from ffrobot.actuation.patches.link_patches import check_reach, link_patches
from ffrobot.actuation.patches.patches import voltage_gain
from ffrobot.common.errors import InputError
from ffrobot.fe_models.modal_body import OutlinedPatches

EI = 2.068427e11 * 0.025 * 0.015**3 / 12
C = 63e9 * 110e-12 * 0.025 * (0.75e-3 + 0.015) / 2  # Shabana 2022, Eq. 14


def test_moment_per_volt(cantilever):
    np.testing.assert_allclose(patches(cantilever(10)).moment_per_volt, 1.364344e-3, rtol=1e-6)  # c of docs/theory.md
    np.testing.assert_allclose(patches(cantilever(10)).moment_per_volt, C, rtol=1e-12)


def test_modes_that_no_patch_reaches_are_named():
    """Mode 4 of a supported beam has nodes of curvature at its quarters, where all four patches are."""
    body = modal_body(paper_link("simply-supported", 4))
    layouts = [layout(name="three", centers=(0.25, 0.5, 0.75)), layout(name="one", centers=(0.25,))]
    of_link = link_patches(layouts, body, planar_body(body))
    assert list(of_link.reach.unreached_modes) == [3]
    frequency = (4 * np.pi) ** 2 / (2 * np.pi) * np.sqrt(EI / (7850.0 * 0.025 * 0.015))
    message = r"singular Φ_V \(condition number .*\): no voltages serve mode 4 \(.* Hz\); move patches"
    with pytest.raises(InputError, match=message) as caught:
        check_reach(of_link)
    assert float(str(caught.value).split("mode 4 (")[1].split(" Hz")[0]) == pytest.approx(frequency, rel=2e-4)
    one = [each.model_copy(update={"allocation": "least-squares"}) for each in layouts]
    of_link = link_patches(one, body, planar_body(body))
    check_reach(of_link)
    round_off = replace(of_link.reach, Phi_V=np.diag([1.0, 1.0, 1.0, 1e-14]))
    np.testing.assert_allclose(voltage_gain(round_off), np.diag([1.0, 1.0, 1.0, 0.0]), atol=1e-12)
    second = {"indices": [2], "family": "in-plane-bending", "attachment_modes": False}
    with pytest.raises(InputError, match="expected eigenmodes of the link that patches"):
        on_link(modal_body(paper_link("simply-supported") | {"modes": second}), centers=(0.5,), d31=-110e-12)


def test_patches_that_only_bend_leave_axial_modes_as_they_are(all_modes):
    """Patches without a named face do not stretch the link; those on one face do, and serve its axial mode."""
    moving = modes_in_the_plane(all_modes)
    bending = [k for k in moving if all_modes.family[k] == "in-plane-bending"]
    assert len(bending) == len(moving) - 1
    F_p = np.random.default_rng(4).standard_normal((2, len(all_modes.family)))
    for face, rows in ((None, bending), ("+y", moving)):
        of_link = on_link(all_modes, count=len(moving), face=face)
        assert list(of_link.reach.modes.rows) == list(rows)
        check_reach(of_link)
        left = of_link.unmet(F_p, of_link.voltages(F_p)["link"].required)
        np.testing.assert_allclose(left[:, rows], 0.0, atol=1e-8)
        np.testing.assert_array_equal(np.delete(left, rows, axis=1), np.delete(F_p, rows, axis=1))


def test_weights_of_points_keep_the_tip_where_it_is_wanted(cantilever):
    """Two patches, ten modes, a uniform load: with all weight on the tip hardly anything of its deflection is left."""
    body = cantilever(10)
    planar = planar_body(body)
    F_p = planar.S_bar[1:2] * 1e-3
    tip = planar.points["tip"].translation[1] / planar.stiffness
    equal, weighted = (
        on_link(body, centers=(0.1, 0.5), allocation="least-squares", **keys).voltages(F_p)["link"]
        for keys in ({}, {"point_weights": {"tip": 1.0}})
    )
    left = [abs(tip @ voltages.unmet[0]) / abs(tip @ F_p[0]) for voltages in (equal, weighted)]
    assert left[1] < 0.02 < 0.2 < left[0]


def tapered(body, rise):
    """The same modes under heights that change linearly along the link by `rise` in all, as a file states them."""
    x = body.stations.position[:, 0]
    middles = np.append((x[1:] + x[:-1]) / 2, x[-1])
    return replace(body, stations=replace(body.stations, height=0.015 * (1 + rise * middles)))


def test_patches_on_a_taper_bend_with_the_local_lever_arm(cantilever):
    """Φ_V = ∫ c(x) φ'' dx over the patch, c = E d31 w (t_p + t_b(x))/2; stations share it out to second order."""
    body = cantilever(4)
    found = patches(tapered(body, -0.4), centers=(0.47,), length=0.2)
    nodes, weights = np.polynomial.legendre.leggauss(5)
    expected = np.zeros(4)
    ends = np.concatenate([[0.37], np.arange(8, 12) * 0.05, [0.57]])
    for start, end in pairwise(ends):
        for x, w in zip((start + end) / 2 + (end - start) / 2 * nodes, (end - start) / 2 * weights, strict=True):
            c = 63e9 * 110e-12 * 0.025 * (0.75e-3 + 0.015 * (1 - 0.4 * x)) / 2
            near = [body.interpolate(at).rotation[2] for at in (x - 1e-5, x + 1e-5)]
            expected += w * c * (near[1] - near[0]) / 2e-5
    np.testing.assert_allclose(found.Phi_V[:, 0], expected, rtol=1e-3, atol=1e-6 * np.abs(expected).max())
    mean_height = 0.015 * (1 - 0.4 * 0.47)
    assert found.moment_per_volt[0] == pytest.approx(C / 0.01575 * (0.75e-3 + mean_height), rel=1e-3)
    constant = patches(body, centers=(0.47,), length=0.2)
    assert abs(found.Phi_V[0, 0] / constant.Phi_V[0, 0] - 1) > 0.1


def test_a_step_of_more_than_a_tenth_under_a_patch_is_refused(cantilever):
    body = cantilever(4)
    x = body.stations.position[:, 0]
    fine, coarse = (
        replace(body, stations=replace(body.stations, height=np.where(x < 0.5, 0.015, 0.015 * factor)))
        for factor in (1.05, 1.2)
    )
    patches(fine, centers=(0.3, 0.5, 0.7))
    patches(coarse, centers=(0.3, 0.7))
    with pytest.raises(InputError, match=r"across a step of the height from 0\.015 to 0\.018 m at 0\.5 m"):
        patches(coarse, centers=(0.5,))


def outlined(body, faces=("top", "bottom"), width=0.025, count=10):
    """The link with ten patches outlined on it, and the strain integrals of plane sections on its faces."""
    edges = (np.arange(count)[:, None] + 0.5) / count + np.array([-0.025, 0.025])
    turn = np.array([body.interpolate(b).rotation[2] - body.interpolate(a).rotation[2] for a, b in edges])
    strains = {"top": -0.0075 * width * turn, "bottom": 0.0075 * width * turn}
    return replace(body, surface_patches=OutlinedPatches(edges, width, **{face: strains[face] for face in faces}))


@pytest.mark.parametrize("faces", [("top",), ("bottom",), ("top", "bottom")])
def test_patches_on_the_surface_work_as_on_the_sections(cantilever, faces):
    """Where sections stay plane the two couplings are one: N b h/2 = c V, halved where both faces have patches."""
    body = outlined(cantilever(6), faces)
    found, rotation = patches(body, coupling="surface"), patches(body)
    np.testing.assert_allclose(found.Phi_V, rotation.Phi_V, rtol=1e-12)
    np.testing.assert_array_equal(found.moment_per_volt, rotation.moment_per_volt)


def test_surface_patches_of_another_layout_are_refused(cantilever):
    body = outlined(cantilever(6))
    with pytest.raises(InputError, match=r'pzt "link": coupling: expected "rotation", or a link whose file outlines'):
        patches(cantilever(6), coupling="surface")
    with pytest.raises(InputError, match=r"expected the 10 patches that the link file outlines, .* found 9, from"):
        patches(body, coupling="surface", count=9)
    with pytest.raises(InputError, match=r"0\.025 m wide, found 10, .* and 0\.02 m wide"):
        patches(body, coupling="surface", width=0.02)
    with pytest.raises(InputError, match=r"from 0\.025 to 0\.075, .* found 10, from 0\.03 to 0\.07"):
        patches(body, coupling="surface", length=0.04)
