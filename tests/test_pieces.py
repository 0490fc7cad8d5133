"""Links in pieces: the same names and datasets as of the one link, and right where that is bent too far."""

import h5py
import numpy as np
import pytest
from beam_links import beam_link, rectangle
from rod_chain import extrapolated

from ffrobot import make_scene
from ffrobot.common.errors import InputError
from ffrobot.fe_models.pieces import cut
from ffrobot.results.write import results_image
from ffrobot.run.solve import solve_scene

SOFT, STIFF = 1e9, 7e10
DRIVEN = [
    {"name": "O", "type": "revolute", "between": ["ground", "link1.root"]},
    {"name": "A", "type": "revolute", "between": ["link1.tip", "link2.root"]},
]


def link(modulus=SOFT, **keys):
    return (
        beam_link(
            1.0,
            rectangle(0.01, 0.02),
            16,
            E=modulus,
            nu=0.3,
            name="link",
            modes={"count": 8, "family": "in-plane-bending"},
        )
        | keys
    )


def pendulum(pieces, of=None, analysis=None, **keys):
    """Two links, hinged, that fall from the horizontal."""
    divided = {} if pieces is None else {"pieces": pieces}
    tables = {
        "space": "planar",
        "gravity": [0.0, -9.81],
        "body": [{"name": name, "link": of or link(), **divided} for name in ("link1", "link2")],
        "joint": [
            {"name": "O", "type": "revolute", "between": ["ground", "link1.root"], "motor": False},
            {"name": "A", "type": "revolute", "between": ["link1.tip", "link2.root"], "motor": False},
        ],
        "analysis": analysis
        or [{"name": "fall", "kind": "forward", "end": 1.0, "output_step": 0.01, "tolerance": 1e-5}],
    }
    return make_scene(name="soft", **(tables | keys))


def solved(scene, tmp_path):
    path = tmp_path / f"{scene.body[0].pieces}.h5"
    path.write_bytes(results_image(solve_scene(scene)))
    return h5py.File(path)


@pytest.fixture(scope="module")
def truth():
    return extrapolated(SOFT, 10, np.linspace(0.0, 1.0, 101))


@pytest.mark.parametrize(("pieces", "bound"), [(2, 2.5e-3), (4, 4e-4)])
def test_soft_double_pendulum(pieces, bound, truth, tmp_path):
    """Bent by 14 % of its length; one affine frame is off by 4e-3 and a linear one by more than the length."""
    with solved(pendulum(pieces), tmp_path) as file:
        assert file["fall"].attrs["status"] == "completed"
        tip = file["fall/points/link2.tip/position"][()]
        deflection = file["fall/points/link2.tip/deflection"][()]
    assert np.linalg.norm(tip - truth, axis=1).max() < bound
    assert np.abs(deflection[:, 1]).max() == pytest.approx(0.136, abs=0.002)


def test_a_path_is_followed_with_a_payload_and_named_interfaces(tmp_path):
    """PCID: the moments of four pieces are those of the one link where that is stiff; reactions of its joints too."""
    modes = {"count": 8, "family": "in-plane-bending", "attachment_modes": True}
    named = link(3 * STIFF, modes=modes, interface=[{"name": "hook", "position": 0.4, "mass": 0.2}])
    keys = {
        "joint": DRIVEN,
        "payload": [{"point": "link2.tip", "mass": 0.3}],
        "load": [{"point": "link1.hook", "y": "-2.0"}],
        "trajectory": [
            {"name": "first", "joint": "O", "value": "0.3*(10*t**3-15*t**4+6*t**5)"},
            {"name": "second", "joint": "A", "value": "0.5-0.4*(10*t**3-15*t**4+6*t**5)"},
        ],
        "initial": {"state": "static", "angles": {"link1": 0.0, "link2": 0.5}},
    }
    analysis = [{"name": "inverse", "kind": "pcid", "end": 1.0, "output_step": 0.01, "tolerance": 1e-6}]
    found = []
    for pieces in (None, 4):
        with solved(pendulum(pieces, named, analysis, geometric_stiffening=True, **keys), tmp_path) as file:
            found.append(
                [file[f"inverse/joints/{joint}/{key}"][()] for joint in "OA" for key in ("moment", "reaction")]
            )
            assert sorted(file["inverse/joints"]) == ["A", "O"]
    for one, four in zip(*found, strict=True):
        assert np.abs(one - four).max() < 3e-3 * np.abs(one).max()


def test_pieces_make_up_the_link():
    """Lengths, steps of the section, masses at interfaces and names of points."""
    stepped = link(
        geometry={
            "kind": "beam",
            "length": 1.2,
            "segment": [
                {"until": 0.5, "section": {"shape": "rectangle", "height": 0.02, "width": 0.02}},
                {"until": 1.2, "section": {"shape": "rectangle", "height": 0.01, "width": 0.02}},
            ],
        },
        interface=[{"name": "hub", "position": 0.4, "mass": 0.3}, {"name": "eye", "position": 0.7, "mass": 0.1}],
    )
    scene = pendulum(3, stepped)
    pieces = cut(scene.body[0].link, 3)
    assert pieces.starts == pytest.approx([0.0, 0.4, 0.8])
    assert pieces.places == {
        "root": (0, "root"), "tip": (2, "tip"), "hub": (0, "tip"), "eye": (1, "eye"), "mid": (1, "mid")
    }  # fmt: skip
    first, second, third = (table.keys for table in pieces.tables)
    assert [segment["until"] for segment in second["geometry"]["segment"]] == pytest.approx([0.1, 0.4])
    assert [len(table["geometry"]["segment"]) for table in (first, third)] == [1, 1]
    assert first["interface"][0] | {"inertia": None} == {"name": "tip", "mass": 0.3, "inertia": None}
    assert second["interface"][0]["position"] == pytest.approx(0.3)


def test_paths_of_angles_are_refused():
    with pytest.raises(InputError, match="expected a point or a joint"):
        solve_scene(pendulum(2, trajectory=[{"name": "turn", "angle": "link1", "value": "t"}]))
