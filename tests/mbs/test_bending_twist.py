"""Beams that bend and twist: a clamped link under loads at its tip that stay or follow, against an exact rod."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from beam_links import beam_link, modal_body, rectangle
from exact_rod import rigidities, tip_of
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

from ffrobot.mbs.model.body import bent_section, from_modal_body, transformed

E, L = 70e9, 0.5
BENDING = ("in-plane-bending", "out-of-plane-bending")
COUNTS = {"in-plane-bending": 3, "out-of-plane-bending": 3, "torsion": 2}


@dataclass(frozen=True)
class Case:
    """A section (mm, height y and width z), what loads the tip, and its second-order displacement (mm)."""

    section: tuple[float, float]
    nu: float
    force: tuple[float, float, float]
    moment: tuple[float, float, float]
    complete: tuple[float, float, float]
    arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    follows: bool = False


FORCE, TORQUE = (0.0, 1.6, 3.0), (0.35, 0.0, 0.0)
# By NumPy alone, with the same modes.
CASES = {
    "A": Case((4, 20), 0.33, (0, 0, -4.9), (0, 0, 0), (-0.0014485, 0.0903377, -1.0942536), (0, 0.06, 0)),
    "B": Case((4, 20), 0.33, (0, 0, -15), (0, 0, 0), (-0.0146152, 0.8547427, -3.3629277), (0, 0.06, 0)),
    "C": Case((5, 12), 0.3, (0, 1.6, 0), TORQUE, (-0.0696664, 7.6193248, 0.0376611)),
    "D": Case((12, 5), 0.3, (0, 9, 0), TORQUE, (-0.0664624, 7.4415558, -0.1006384)),
    "E": Case((5, 12), 0.3, FORCE, (0, 0, 0), (-0.0770764, 7.6205879, 2.4809805)),
    "F": Case((5, 12), 0.3, FORCE, TORQUE, (-0.0779837, 7.6542954, 2.5190297)),
    "G": Case((5, 12), 0.3, FORCE, TORQUE, (-0.0740986, 7.4376375, 2.5218883), follows=True),
    "H": Case((5, 12), 0.3, (0, 0, 0), (0.35, 0.5, 0.3), (-0.0261047, 4.2591791, -1.2144867)),
    "I": Case((5, 12), 0.3, (0, 0, 0), (0.35, 0.5, 0.3), (-0.0272663, 4.3597961, -1.2161779), follows=True),
}
ROTATIONS = {"B": (-0.046071074, 0.010037987, 0.003544797), "G": (0.017858626, -0.007397055, 0.022427066)}
CHORD = {"B": (-0.0146527, 0.8538782, -3.3627106), "F": (-0.0779379, 7.6515001, 2.5185705)}


def link(section, nu, condition="cantilever", **modes):
    modes = {"family": [*BENDING, "torsion"]} | modes
    return beam_link(L, rectangle(*(x / 1e3 for x in section)), 20, E=E, nu=nu, condition=condition, modes=modes)


def with_one_static_twist(modal):
    """Of static shapes in torsion only that of a moment at the tip, as the checkpoints have it."""
    body = from_modal_body("rod", modal, stiffened=True)
    twists = np.flatnonzero((np.array(modal.family) == "torsion") & (modal.residual == 1))
    shape = body.points["tip"].rotation[0, twists] / body.stiffness[twists]
    T = np.eye(body.n_modes)
    T[np.ix_(twists, twists[:1])] = (shape / np.linalg.norm(shape))[:, None]
    T = np.delete(T, twists[1:], axis=1)
    return transformed(body, T, np.diag(T.T @ (body.stiffness[:, None] * T)).copy())


@cache
def body(section, nu, condition="cantilever"):
    """Of a section, with the eigenmodes of `COUNTS` and the static shapes of loads at the tip."""
    family = np.array(modal_body(link(section, nu, condition, count=30, attachment_modes=False)).family)
    indices = sorted(int(i) + 1 for f, n in COUNTS.items() for i in np.flatnonzero(family == f)[:n])
    return with_one_static_twist(modal_body(link(section, nu, condition, indices=indices)))


def tip_at_rest(body, force, moment, arm=(0.0, 0.0, 0.0), follows=False):
    """Displacement and rotation vector of the tip of a body whose root section is clamped: K p = work of the load."""
    force, moment, arm = (np.asarray(v, dtype=float) for v in (force, moment, arm))

    def placed(p):
        root, tip = (bent_section(body, name, p) for name in ("root", "tip"))
        to_root = Rotation.from_rotvec(root.phi).inv()
        return to_root.apply(tip.u - root.u), to_root * Rotation.from_rotvec(tip.phi)

    def forces(p):
        R = placed(p)[1]
        f, m = (R.apply(force), R.apply(moment)) if follows else (force, moment)
        m = m + np.cross(R.apply(arm), f)
        found = -body.stiffness * p
        for k, h in enumerate(1e-3 / np.sqrt(body.stiffness)):
            (r, turned), (r_before, before) = (placed(p + sign * h * np.eye(len(p))[k]) for sign in (1, -1))
            found[k] += ((r - r_before) @ f + (turned * before.inv()).as_rotvec() @ m) / (2 * h)
        return found

    root = np.sqrt(body.stiffness)
    scaled = fsolve(lambda x: forces(x / root) / root, np.zeros(body.n_modes), xtol=1e-11)
    r, R = placed(scaled / root)
    return r - [L, 0.0, 0.0], R.as_rotvec()


@pytest.mark.parametrize("name", CASES)
def test_checkpoints(name):
    """All digits of the second-order solution with the same modes."""
    case = CASES[name]
    load = (case.force, case.moment, case.arm, case.follows)
    u, phi = tip_at_rest(body(case.section, case.nu), *load)
    np.testing.assert_allclose(1e3 * u, case.complete, atol=2e-7)
    if name in ROTATIONS:
        np.testing.assert_allclose(phi, ROTATIONS[name], atol=2e-9)


@pytest.mark.parametrize("name", CHORD)
def test_frame_along_the_chord(name):
    """Simple supports: the frame turns with the ends of the link, and not about it at the root."""
    case = CASES[name]
    u, _ = tip_at_rest(body(case.section, case.nu, "simply-supported"), case.force, case.moment, case.arm)
    np.testing.assert_allclose(1e3 * u, CHORD[name], atol=2e-5)  # of other modes: they differ in the fifth digit


@pytest.mark.parametrize("condition", ["cantilever", "simply-supported"])
@pytest.mark.parametrize("name", ["B", "F", "G"])
def test_order_in_the_load(name, condition):
    """What is left out is of third order: halved loads have an eighth of the error, in positions and rotations."""
    case, errors = CASES[name], []
    for size in (0.5, 0.25):
        load = (size * np.array(case.force), size * np.array(case.moment), case.arm, case.follows)
        exact = tip_of(rigidities(*(x / 1e3 for x in case.section), E, case.nu), L, *load)
        found = tip_at_rest(body(case.section, case.nu, condition), *load)
        errors.append([np.linalg.norm(a - b) for a, b in zip(found, exact, strict=True)])
    assert np.all(np.log2(np.divide(*errors)) > 2.9)
