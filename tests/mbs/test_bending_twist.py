"""Beams that bend and twist: a clamped link under loads at its tip that stay or follow, against an exact rod."""

from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from beam_links import beam_link, modal_body, rectangle
from exact_rod import rigidities, tip_of
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

from ffrobot.mbs.model.body import bent_section, from_modal_body

E, L = 70e9, 0.5
ROUND_OFF = 1e-10  # of rotations by moments alone, which have hardly any error


class Case(NamedTuple):
    """A section (mm, height y and width z), Poisson's ratio, and what loads the tip (N, N·m, m)."""

    section: tuple[float, float]
    nu: float
    force: tuple[float, float, float] = (0.0, 0.0, 0.0)
    moment: tuple[float, float, float] = (0.0, 0.0, 0.0)
    arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    follows: bool = False


FORCE, TORQUE = (0.0, 1.6, 3.0), (0.35, 0.0, 0.0)
CASES = {
    "beside the axis": Case((4, 20), 0.33, (0, 0, -15), arm=(0, 0.06, 0)),
    "wide": Case((5, 12), 0.3, (0, 1.6, 0), TORQUE),
    "high": Case((12, 5), 0.3, (0, 9, 0), TORQUE),
    "force alone": Case((5, 12), 0.3, FORCE),
    "force and torque": Case((5, 12), 0.3, FORCE, TORQUE),
    "force and torque that follow": Case((5, 12), 0.3, FORCE, TORQUE, follows=True),
    "moments": Case((5, 12), 0.3, moment=(0.35, 0.5, 0.3)),
    "moments that follow": Case((5, 12), 0.3, moment=(0.35, 0.5, 0.3), follows=True),
}


@cache
def body(section, nu, condition):
    """Of a section, with the lowest modes that bend and twist, and the static shapes of loads at the tip."""
    modes = {"count": 8, "family": ["in-plane-bending", "out-of-plane-bending", "torsion"]}
    of_mm = rectangle(*(x / 1e3 for x in section))
    modal = modal_body(beam_link(L, of_mm, 20, E=E, nu=nu, condition=condition, modes=modes))
    return from_modal_body("rod", modal, stiffened=True)


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
def test_order_in_the_load(name):
    """What is left out is of third order: halved loads have an eighth of the error, in positions and rotations.

    With frames at the root, and along the chord, which turn with the ends of the link.
    """
    case, found = CASES[name], {"cantilever": [], "simply-supported": []}
    for size in (0.5, 0.25):
        load = (size * np.array(case.force), size * np.array(case.moment), case.arm, case.follows)
        exact = tip_of(rigidities(*(x / 1e3 for x in case.section), E, case.nu), L, *load)
        for condition, errors in found.items():
            tip = tip_at_rest(body(case.section, case.nu, condition), *load)
            errors.append([np.linalg.norm(a - b) for a, b in zip(tip, exact, strict=True)])
    for errors in found.values():
        assert np.all((np.log2(np.divide(*errors)) > 2.9) | (np.array(errors[0]) < ROUND_OFF))
