"""Mass and stiffness of patches, against a finite element model of the link with the composite sections."""

import numpy as np
import pytest
from beam_links import modal_body, paper_link, rectangle
from patches_on_links import layout, patched, planar_body

from ffrobot.actuation.patches.composite import structure_effect_of

E, RHO, H, B = 2.068427e11, 7850.0, 0.015, 0.025
E_P, RHO_P, T_P = 63e9, 7600.0, 0.75e-3


def composite_link(faces, mass, stiffness):
    """A steel link with a rectangle under each patch that has the same EI and ρA as the composite section."""
    EI, rho_A = E * B * H**3 / 12, RHO * B * H
    outer, inner = H / 2 + T_P, H / 2
    EI_p = EI + stiffness * faces * E_P * B * (outer**3 - inner**3) / 3
    if faces == 1:  # the axis stretches freely: the neutral axis moves
        EI_p -= stiffness * (E_P * B * (outer**2 - inner**2) / 2) ** 2 / (E * B * H + E_P * B * T_P)
    rho_A_p = rho_A + mass * faces * RHO_P * B * T_P
    height = np.sqrt(12 * EI_p / E * RHO / rho_A_p)
    sections = [(H, B), (float(height), float(rho_A_p / (RHO * height)))]
    ends = [*np.round(np.arange(0.025, 1.0, 0.05), 3).tolist(), 1.0]  # ten patches of 0.05 m, gaps as long between them
    segments = [{"until": end, "section": rectangle(*sections[k % 2])} for k, end in enumerate(ends)]
    link = paper_link()
    return modal_body(
        link | {"geometry": {"kind": "beam", "length": 1.0, "segment": segments}, "mesh": {"elements": 40}}
    )


@pytest.mark.parametrize("face", [None, "both"])
@pytest.mark.parametrize("structural", [("mass",), ("stiffness",), ("mass", "stiffness")])
def test_frequencies_are_those_of_the_composite_link(cantilever, face, structural):
    """Ritz with 20 modes of the bare link: curvature has steps at patch edges that smooth modes only come near."""
    body = cantilever(20)
    bare = planar_body(body)
    stiffer = patched(body, layout(density=RHO_P, face=face, structural=structural), bare=bare)
    reference = composite_link(2 if face else 1, "mass" in structural, "stiffness" in structural)
    effect = structure_effect_of(bare, stiffer)
    ritz, exact = effect.frequency[1, :5], reference.frequency[:5]
    assert np.all(ritz > exact * (1 - 1e-9))  # Rayleigh's principle
    np.testing.assert_allclose(ritz, exact, rtol=1e-3)
    if len(structural) == 1:  # together they cancel almost
        np.testing.assert_allclose(ritz / effect.frequency[0, :5] - 1, exact / effect.frequency[0, :5] - 1, rtol=0.04)
    assert effect.mass[1] == pytest.approx(reference.mass, rel=1e-12)
    assert effect.inertia[1] == pytest.approx(reference.second_moment[0, 0], rel=1e-12)
    np.testing.assert_allclose(stiffer.first_moment[:2], reference.first_moment[:2], atol=1e-12)
    np.testing.assert_allclose(np.abs(stiffer.S_bar[1, :5]), np.abs(reference.S_bar[1, :5]), rtol=2e-3)
