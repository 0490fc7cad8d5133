"""Robots of links by Craig and Bampton: the motion, forces and frequencies of the same robots in other frames.

Steel a hundred times as stiff: what equations leave out of the foreshortening of a bent link depends on where its frame
is, and with steel itself (sag 1.6 %) makes 2e-3 of a moment between any frame on the root and one along the chord.
"""

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from tables_3d import pin, planar

import ffrobot

E, H, B = 2.0e13, 0.015, 0.025
CONDITIONS = ("craig-bampton", "cantilever", "simply-supported")


def link(name, condition, length, count=6):
    """A steel link."""
    modes = {"count": count, "family": "in-plane-bending"}
    return beam_link(length, rectangle(H, B), 16, E=E, nu=0.3, rho=7800.0, condition=condition, name=name, modes=modes)


def law(start, by):
    """A quintic of half a second."""
    return f"{start} + {by}*(10*(2*t)**3 - 15*(2*t)**4 + 6*(2*t)**5)"


def bodies(conditions, lengths):
    pairs = zip(conditions, lengths, strict=True)
    return [{"name": f"l{k}", "link": link(f"l{k}", *pair)} for k, pair in enumerate(pairs, 1)]


def difference(found, expected, names):
    """The largest difference of datasets from the first of several results, of their peaks."""
    return max(np.abs(found[name] - expected[name]).max() / np.abs(expected[name]).max() for name in names)


def chain(folder, conditions):
    """Two links, each joint on a law of its own, a payload at the end."""
    tables = planar(
        bodies(conditions, [0.6, 0.5]),
        [pin("j1", "ground", "l1.root"), pin("j2", "l1.tip", "l2.root")],
        {"name": "inverse", "kind": "pcid", "end": 0.2, "output_step": 0.005, "tolerance": 1e-6},
        {"name": "models", "kind": "linear", "about": "inverse", "times": [0.0]},
        payload=[{"point": "l2.tip", "mass": 1.5}],
        initial={"state": "static"},
        trajectory=[{"name": f"t{k}", "joint": f"j{k}", "value": law(0.4 / k, 0.8 - 0.3 * k)} for k in (1, 2)],
    )
    return ffrobot.solve(ffrobot.make_scene(folder=folder, **tables))


@pytest.fixture(scope="module")
def chains(tmp_path_factory):
    """Two links under each condition."""
    folder = tmp_path_factory.mktemp("chains")
    return [chain(folder, (condition,) * 2) for condition in CONDITIONS]


def test_chain_along_its_laws(chains):
    """Motor moments to 1e-6 of their peaks in the same frame, to 1e-4 in the other; the tip, of what links bend."""
    found, *others = chains
    moments = [f"inverse/joints/j{k}/moment" for k in (1, 2)]
    tip = "inverse/points/l2.tip/position"
    bent = sum(np.abs(found[f"inverse/points/l{k}.tip/deflection"]).max() for k in (1, 2))
    for other, bound in zip(others, (1e-6, 1e-4), strict=True):
        assert difference(found, other, moments) < bound
        assert np.abs(found[tip] - other[tip]).max() < 10 * bound * bent


def test_frequencies_of_the_assembled_robot(chains):
    """Two links with free joints: the first six of twelve elastic modes, beside attachment or constraint modes."""
    models = [results.linear("models")[0] for results in chains]
    found, *others = (np.sort(np.abs(np.linalg.eigvals(model.A).imag))[::2] for model in models)
    assert len(found) == 2 + 2 * (6 + 2)
    for other in others:
        np.testing.assert_allclose(found[2:8], other[2:8], rtol=5e-4)
