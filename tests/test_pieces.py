"""Links in pieces, right where the one link is bent too far; tests/cases/test_pieces_3d.py has stiff ones."""

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from rod_chain import extrapolated
from tables_3d import pin, planar

import ffrobot
from ffrobot.fe_models.pieces import cut

SOFT = 1e9


def link(**keys):
    modes = {"count": 8, "family": "in-plane-bending"}
    return beam_link(1.0, rectangle(0.01, 0.02), 16, E=SOFT, nu=0.3, name="link", modes=modes) | keys


def pendulum(pieces, of):
    """Two links, hinged, that fall from the horizontal."""
    bodies = [{"name": name, "link": of, "pieces": pieces} for name in ("link1", "link2")]
    joints = [pin("O", "ground", "link1.root", motor=False), pin("A", "link1.tip", "link2.root", motor=False)]
    fall = {"name": "fall", "kind": "forward", "end": 1.0, "output_step": 0.01, "tolerance": 1e-5}
    return ffrobot.make_scene(**planar(bodies, joints, fall))


def test_soft_double_pendulum():
    """Bent by 14 % of its length; one affine frame is off by 4e-3 and a linear one by more than the length."""
    truth = extrapolated(SOFT, 10, np.linspace(0.0, 1.0, 101))
    results = ffrobot.solve(pendulum(4, link()))
    assert results.attributes("fall")["status"] == "completed"
    assert np.linalg.norm(results["fall/points/link2.tip/position"] - truth, axis=1).max() < 4e-4
    deflection = results["fall/points/link2.tip/deflection"]
    assert np.abs(deflection[:, 1]).max() == pytest.approx(0.136, abs=0.002)


def test_pieces_make_up_the_link():
    """Lengths, steps of the section, masses at interfaces and names of points."""
    segments = [{"until": end, "section": rectangle(height, 0.02)} for end, height in ((0.5, 0.02), (1.2, 0.01))]
    stepped = link(
        geometry={"kind": "beam", "length": 1.2, "segment": segments},
        interface=[{"name": "hub", "position": 0.4, "mass": 0.3}, {"name": "eye", "position": 0.7, "mass": 0.1}],
    )
    pieces = cut(pendulum(3, stepped).body[0].link, 3)
    assert pieces.starts == pytest.approx([0.0, 0.4, 0.8])
    assert pieces.places == {
        "root": (0, "root"), "tip": (2, "tip"), "hub": (0, "tip"), "eye": (1, "eye"), "mid": (1, "mid")
    }  # fmt: skip
    first, second, third = (table.keys for table in pieces.tables)
    assert [segment["until"] for segment in second["geometry"]["segment"]] == pytest.approx([0.1, 0.4])
    assert [len(table["geometry"]["segment"]) for table in (first, third)] == [1, 1]
    assert first["interface"][0] | {"inertia": None} == {"name": "tip", "mass": 0.3, "inertia": None}
    assert second["interface"][0]["position"] == pytest.approx(0.3)
