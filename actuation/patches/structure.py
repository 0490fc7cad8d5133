"""What patches add to their link: mass, the stiffness of the composite section, and charges without an amplifier."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...common.arrays import Array
from ...common.keys import SMALLEST
from ...common.rotations import skew
from ...common.structs import struct
from ...fe_models.modal_body import ModalBody
from ...mbs.model.body import Body, BodyPoint
from ...mbs.model.masses import with_line_masses
from .composite import PlacedLayout, composite, gauss_points, layers_on_link
from .sections import layer_section, link_sections, side

PASSES = 6  # until modes and the stiffness of shunts at their frequencies agree


@struct
class StructureEffect:
    """Changes of a link by patches, bare → with patches."""

    mass: Array  # (2,) kg
    inertia: Array  # (2,) about the body's z axis, kg·m²
    frequency: Array  # (2, n) Hz


def patched_body(spatial: Body, body: ModalBody, placed: Sequence[PlacedLayout]) -> Body:
    """Add mass and stiffness of patches to a link or a piece of it, as the layouts ask; all modes are kept.

    Mass lies in the plane of the patches' normal at their offset from the axis, with its moment of inertia about the
    line that it is on, ∫ρ (η² + ζ²) dA. The stiffness is that of the `composite` section.
    """
    T, sections = spatial.modal_transform, link_sections(body)
    points, masses, spins = [], [], []
    for layout, edges in placed:
        extent = sections.extent(layout.normal, side(layout))
        arm = layout.offset * np.eye(3)[2 if layout.normal == "y" else 1]
        for place in gauss_points(body, edges) if layout.adds_mass else ():
            at = body.interpolate(place.x)
            moved = at.translation - skew(arm) @ at.rotation
            points.append(BodyPoint(at.position + arm, moved @ T, at.rotation @ T))
            A, _, I = layer_section(layout, extent[place.station])  # noqa: E741
            line_density = place.weight * (layout.density or 0.0)
            masses.append(line_density * A)
            spins.append(line_density * (I + A * layout.width**2 / 12))
    stiff = [one for one in placed if one.layout.adds_stiffness]
    added = T.T @ composite(stiff, body)[0] @ T if stiff else np.zeros((spatial.n_modes, spatial.n_modes))
    patched = with_line_masses(spatial, points, np.array(masses), np.array(spins), added)
    return _with_charges(patched, body, stiff) if any(one.layout.gives_way for one in stiff) else patched


def _with_charges(patched: Body, body: ModalBody, placed: Sequence[PlacedLayout]) -> Body:
    """With what the charges of patches do whose electrodes are open, or behind a resistor of R Ω each.

    With the charge q = C V + Φᵀp and V = −R q̇ a patch has the dynamic stiffness Φ iωR/(1 + iωRC) Φᵀ (Hagood and von
    Flotow, J. Sound Vib. 146, 1991), ΦΦᵀ/C where R is infinite. Its stiffness and damping are those at the frequency
    of each mode that they lead to.
    """
    layers = layers_on_link(placed, body)
    layouts = [one.layout for one in placed for _ in one.edges]
    share = np.diff(np.concatenate([one.edges for one in placed]))[:, 0] / [of.length for of in layouts]
    charged = np.flatnonzero([of.gives_way for of in layouts])
    C = np.array([of.capacitance(clamped=True) for of in layouts]) * share + layers.yielding
    Phi = (layers.by_volts.T @ layers.B @ patched.modal_transform)[charged] / np.sqrt(C[charged])[:, None]
    R = np.array([layouts[k].shunt or np.inf for k in charged]) / share[charged]
    K, modes = np.diag(patched.stiffness), np.eye(patched.n_modes)
    values, added = patched.stiffness, np.zeros_like(K)
    for _ in range(PASSES):
        omega = np.sqrt(values.clip(min=SMALLEST))
        with np.errstate(divide="ignore"):
            lag = 1.0 / np.multiply.outer(R * C[charged], omega)  # 1/(ωRC)
        stiff = Phi @ modes / np.sqrt(1.0 + lag**2) @ modes.T
        damps = Phi @ modes * np.sqrt(lag / (omega * (1.0 + lag**2))) @ modes.T
        added = stiff.T @ stiff
        values, modes = np.linalg.eigh(K + added)
    with_damping = replace(patched, damping=patched.damping + damps.T @ damps)
    return with_line_masses(with_damping, (), np.zeros(0), np.zeros(0), added)


def structure_effect_of(bare: Body, patched: Body) -> StructureEffect:
    """Return the changes of a link by its patches."""
    pair = (bare, patched)
    return StructureEffect(
        np.array([body.mass for body in pair]),
        np.array([body.inertia[2, 2] for body in pair]),
        np.array([np.sqrt(body.stiffness) / (2 * np.pi) for body in pair]),
    )
