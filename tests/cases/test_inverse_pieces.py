"""Links in pieces in 3D whose shape is prescribed, or that motors alone move.

They are compared with links cut by hand and welded, which no code for links in pieces touches.
"""

from pathlib import Path

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from scipy.interpolate import make_interp_spline
from tables_3d import joint, revolute, scene, solved

import ffrobot
from ffrobot.fe_models.link_source import LinkTable
from ffrobot.fe_models.pieces import cut
from ffrobot.run.pieces import make_whole_links
from ffrobot.run.solve import solve_scene
from ffrobot.run.watcher import Watcher

S = "(10*(t/0.8)**3-15*(t/0.8)**4+6*(t/0.8)**5)"
NAMES = "upper", "fore"
LINK = beam_link(0.8, rectangle(0.01, 0.02), 8, nu=0.3, name="link", modes={"count": 4, "family": "in-plane-bending"})
RUN = {"end": 0.8, "output_step": 0.04}
STATIC = {"name": "static", "kind": "fcid", "shape": "static", **RUN}
ZERO = {"name": "zero", "kind": "fcid", "shape": "zero", **RUN}
ALONE = {"name": "alone", "kind": "motors-only", "tolerance": 1e-7, "output": "redefined", "factor": 0.0, **RUN}


def arm(bodies, welds, ends, analyses, **tables):
    """Two links on a path of the tip; `ends` are root and tip of each."""
    upper, fore = ends
    joints = [revolute("O", "ground", upper[0], motor=True), revolute("A", upper[1], fore[0], motor=True)]
    path = {"name": "tip", "point": fore[1], "x": f"1.46-0.1*{S}", "y": f"0.53+0.1*{S}"}
    keys = {"gravity": [0.0, -9.81, 0.0], "payload": [{"point": fore[1], "mass": 0.1}], "trajectory": [path]}
    keys |= {"geometric_stiffening": True, "initial": {"joints": {"O": 0.1, "A": 0.5}}}
    return scene(bodies, joints + welds, *analyses, **keys | tables)


def in_pieces(analyses, count=2, **tables):
    divided = {} if count is None else {"pieces": count}
    bodies = [{"name": name, "link": LINK, **divided} for name in NAMES]
    return arm(bodies, [], [(f"{name}.root", f"{name}.tip") for name in NAMES], analyses, **tables)


def by_hand(analyses):
    """Of links in two pieces."""
    tables = [dict(table.keys) for table in cut(LinkTable(LINK, Path("link.toml")), 2).tables]
    bodies = [{"name": f"{name}{k}", "link": tables[k]} for name in NAMES for k in range(2)]
    welds = [joint(name, "weld", f"{name}0.tip", f"{name}1.root") for name in NAMES]
    return arm(bodies, welds, [(f"{name}0.root", f"{name}1.tip") for name in NAMES], analyses)


def agree(found, expected, share, at=slice(None)):
    np.testing.assert_allclose(found[at], expected[at], rtol=0, atol=share * np.abs(expected).max())


def test_motors_and_tips_are_those_of_links_cut_by_hand():
    """Under static shapes, none, and motors alone, which leave the path by what bends."""
    analyses = [STATIC, ZERO, ALONE]
    with solved(in_pieces(analyses)) as pieces, solved(by_hand(analyses)) as hand:
        for name in ("static", "zero", "alone"):
            for joint in "OA":
                found, expected = (of[f"{name}/joints/{joint}/moment"].ravel() for of in (pieces, hand))
                agree(found, expected, 1e-8)
            agree(pieces[f"{name}/points/fore.tip/position"], hand[f"{name}/points/fore1.tip/position"], 1e-8)


def test_coordinates_of_links_made_whole_have_their_derivatives():
    """Rates and accelerations of what controllers take for the whole links, by a spline through coordinates."""
    shape = {"name": "shape", "kind": "fcid", "shape": "static", "end": 0.8, "output_step": 0.01}
    solution = solve_scene(ffrobot.make_scene(**in_pieces([shape])), Watcher())
    run = make_whole_links(solution).as_links(solution.outcomes["shape"])
    assert len(run.model.tree.nodes) < len(solution.outcomes["shape"].model.tree.nodes)
    for order, found in ((1, run.v), (2, run.a)):
        expected = make_interp_spline(run.time, run.q, 7).derivative(order)(run.time)
        agree(found, expected, 1e-5, slice(8, -8))


@pytest.mark.parametrize(("count", "share"), [(None, 1e-13), (3, 1e-4)])
def test_a_shape_is_given_in_the_modes_of_the_whole_link(count, share):
    """Small, so that what is told of the pieces as the one link is the same again; faster than the outputs are."""
    given = {"name": "given", "kind": "fcid", "shape": "given", "modal": {"fore": ["1e-4*sin(900*t)", "1e-5*t"]}, **RUN}
    with solved(in_pieces([given], count)) as results:
        t = results["given/time"]
        wanted = np.zeros((2, *results["given/bodies/fore/modal"].shape))
        wanted[:, :, 0] = 1e-4 * np.sin(900 * t), 0.09 * np.cos(900 * t)
        wanted[:, :, 1] = 1e-5 * t, np.full_like(t, 1e-5)
        agree(results["given/bodies/fore/modal"], wanted[0], share)
        agree(results["given/bodies/fore/modal_velocity"], wanted[1], max(share, 1e-6))
        assert np.abs(results["given/bodies/upper/modal"]).max() < 1e-12
