"""Attachment modes in mechanisms: exact statics with few modes."""

import numpy as np
import pytest
from steel_arms import EI, LINE, two_links

import ffrobot


def errors(found, expected, name="swing"):
    """Of the tip in m, of the moments relative to their peaks."""
    tip = f"{name}/points/b.tip/position"
    moments = [f"{name}/joints/{joint}/moment" for joint in "OA"]
    return (
        np.abs(found[tip] - expected[tip]).max(),
        *(np.abs(found[m] - expected[m]).max() / np.abs(expected[m]).max() for m in moments),
    )


@pytest.fixture(scope="module")
def all_modes():
    """All 80 eigenmodes of the meshes; twelve kept, with the statics of the others, in the equations."""
    return ffrobot.solve(two_links(80, False, kept=12))


def test_fewer_modes_of_a_file_with_attachment_modes(all_modes):
    """`modes = 4` of ten: static shapes for all that is left out, attachment modes among it."""
    found = ffrobot.solve(two_links(10, True, kept=4))
    assert found.attributes("swing/bodies/a")["modes_kept"] == "4 of 10 modes and 2 static shapes for the others"
    tip, *moments = errors(found, all_modes)
    assert tip < 1e-6
    assert max(moments) < 1e-5


def test_sag_of_two_links():
    """Two horizontal links under their weight and payload, of which the motors hold the sections at the joints.

    The section angles are held: each link sags as a cantilever, and what the first turns at its tip is taken back by
    the second motor.
    """
    held = [{"name": "first", "joint": "O", "value": "0.0"}, {"name": "second", "joint": "A", "value": "0.0"}]
    analysis = [{"name": "swing", "kind": "static"}]
    keys = {"trajectory": held, "analysis": analysis, "initial": {"angles": {"a": 0, "b": 0}}}
    g, payload = 9.81e-4, 2.0  # linear theory: positions turn rigidly with the first link's slope
    found = ffrobot.solve(two_links(4, True, gravity=[0.0, -g], **keys))
    weight = LINE * g
    force, moment = weight + payload * g, weight / 2 + payload * g  # of the second link on the tip of the first
    middle = weight / (8 * EI) + force / (3 * EI) + moment / (2 * EI)
    turn = weight / (6 * EI) + force / (2 * EI) + moment / EI
    expected = middle + turn + weight / (8 * EI) + payload * g / (3 * EI)
    assert -found["swing/points/b.tip/position"][0, 1] == pytest.approx(expected, rel=1e-6)
    # simply supported: the frame goes through the tip
    assert found["swing/points/a.tip/deflection"][0, 1] == pytest.approx(0.0, abs=1e-12)
