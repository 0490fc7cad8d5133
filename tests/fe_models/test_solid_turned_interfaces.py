"""Geometric stiffness of solids under moments belongs to rotation vectors, as that of beams, however faces are held."""

from pathlib import Path

import numpy as np
import pytest
from beam_links import link_keys, rectangle

from ffrobot.fe_models.link import computed_modal_body
from ffrobot.fe_models.link_source import LinkTable

FAMILIES = {"in-plane-bending": 2, "out-of-plane-bending": 2, "torsion": 1}


def bar(kind, condition, coupling, folder):
    """8 × 12 × 200 mm, with its lowest modes of each family."""
    mesh = {"divisions": [40, 2, 3], "order": 2} if kind == "solid" else {"elements": 30}
    more = {"interface": [{"name": "tip", "coupling": coupling}]}
    if kind == "beam":
        more = {"model": {"theory": "timoshenko"}}
    modes = {"count": 7, "family": list(FAMILIES), "attachment_modes": False}
    section = rectangle(0.008, 0.012)
    table = link_keys(kind, 0.2, section, mesh, nu=0.3, condition=condition, name="bar", modes=modes, **more)
    return computed_modal_body(LinkTable(table, Path(folder / "bar.toml")))


def of_families(body):
    """What modes do at the ends (12, n), and K (n, n) by load; n by family, signs so that ends move alike."""
    family = np.array(body.family)
    kept = np.concatenate([np.flatnonzero(family == f)[:n] for f, n in FAMILIES.items()])
    ends = [body.interfaces[name] for name in ("tip", "root")]
    rows = np.concatenate([np.concatenate([at.translation, 0.2 * at.rotation])[:, kept] for at in ends])
    return rows, {load: K[np.ix_(kept, kept)] for load, K in body.geometric_stiffness.items()}


@pytest.mark.parametrize(
    ("condition", "coupling"), [("cantilever", "mean"), ("cantilever", "rigid"), ("simply-supported", "mean")]
)
def test_loads_at_interfaces_do_the_work_of_those_on_a_beam(condition, coupling, tmp_path):
    """Without their turn, K of the moment about x alone is 5.6 times as large. Warping at ends is all that is left."""
    (ends, beam), (moved, solid) = (of_families(bar(kind, condition, coupling, tmp_path)) for kind in ("beam", "solid"))
    signs = np.sign(np.sum(ends * moved, axis=0))
    for kind in ("force", "moment"):
        loads = [f"{kind}/tip/{axis}" for axis in "xyz"]
        scale = max(np.abs(beam[load]).max() for load in loads)
        for load in loads:
            expected, found = beam[load], solid[load] * np.outer(signs, signs)
            expected[4, 4] = found[4, 4] = 0.0  # fibres that twist shortens, which beams have not
            atol = 0.022 * (np.abs(expected).max() or scale)
            np.testing.assert_allclose(found, expected, atol=atol, err_msg=load)
