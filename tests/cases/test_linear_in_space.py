"""Linear models of robots in space: those of planar robots put there, patches, closed forms, bad input."""

import numpy as np
import planar_in_space
import pytest
from checkpoints import CASES
from planar_in_space import CRANK, TWO_LINK

import ffrobot

INVERSE = {"name": "inverse", "kind": "pcid", "end": 0.2, "output_step": 0.05, "tolerance": 1e-10}
MOVING = {"name": "moving", "kind": "linear", "about": "inverse", "times": [0.0, 0.1, 0.2]}


def both(case, guess, analyses, folder):
    """Results of a planar scene and of the same in space; the joint on the ground has a motor."""
    planar = planar_in_space.read(CASES / case / "scene.toml")
    planar.pop("pzt", None)
    planar["joint"][0]["motor"] = True
    planar["analysis"] = analyses
    spatial = planar_in_space.in_space(planar) | {"initial": {"joints": guess}, "analysis": analyses}
    return [
        ffrobot.solve(planar_in_space.write(tables, folder / f"{name}.toml"))
        for name, tables in (("planar", planar), ("spatial", spatial))
    ]


def same_models(planar, spatial, close):
    """The same transfer from motors and forces in the plane to joints and points, and the same poles."""
    for in_plane, in_space in zip(planar, spatial, strict=True):
        sources = [name for name in in_plane.input_names if name in in_space.input_names]
        targets = [name for name in in_plane.output_names if name in in_space.output_names and name[:6] != "modal/"]
        assert any(name.startswith("joint/") for name in sources)
        assert any(name.startswith("joint/") for name in targets)
        assert any(name.startswith("point/") for name in targets)
        omega = np.array([0.0, 3.0, 40.0, 700.0]) + 0.2
        expected, found = (model.frequency_response(omega, sources, targets) for model in (in_plane, in_space))
        for k in range(len(omega)):
            np.testing.assert_allclose(found[k], expected[k], rtol=0, atol=close * np.abs(expected[k]).max())


def test_two_links_along_their_path(tmp_path):
    planar, spatial = both("two_link", TWO_LINK, [INVERSE, MOVING], tmp_path)
    with planar, spatial:
        same_models(planar.linear("moving"), spatial.linear("moving"), 1e-7)
        expected, found = (results["moving/linear/frequency"] for results in (planar, spatial))
        np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-6)
        for name in ("position", "modal"):
            key = f"moving/linear/modes/link2/{name}"
            sign = np.sign(np.sum(planar[key][0, 3] * spatial[key][0, 3][..., : planar[key].shape[-1]]))
            shape = sign * spatial[key][0, 3][..., : planar[key].shape[-1]]
            np.testing.assert_allclose(shape, planar[key][0, 3], atol=1e-6 * np.abs(planar[key][0, 3]).max())


def test_two_links_at_rest(tmp_path):
    planar, spatial = both("two_link", TWO_LINK, [{"name": "rest", "kind": "linear"}], tmp_path)
    with planar, spatial:
        same_models(planar.linear("rest"), spatial.linear("rest"), 1e-9)
        assert spatial.linear("rest")[0].freedom == planar.linear("rest")[0].freedom


def test_a_loop(tmp_path):
    inverse = INVERSE | {"end": 0.02, "output_step": 0.01}
    moving = MOVING | {"times": [0.0, 0.02]}
    planar, spatial = both("slider_crank", CRANK, [inverse, moving], tmp_path)
    with planar, spatial:
        same_models(planar.linear("moving"), spatial.linear("moving"), 1e-6)


def test_what_cannot_be_had_is_refused(tmp_path):
    planar = planar_in_space.read(CASES / "two_link" / "scene.toml")
    planar.pop("pzt", None)
    planar["analysis"] = [{"name": "rest", "kind": "linear"}]
    spatial = planar_in_space.in_space(planar) | {"initial": {"joints": TWO_LINK}, "analysis": planar["analysis"]}
    for change, message in (
        ({"motors": "frame"}, r'motors: expected "section" for linear models in space, found "frame"'),
        ({"analysis": [{"name": "rest", "kind": "linear", "points": ["link2.nose"]}]}, r'points: .*found "link2.nose"'),
        ({"analysis": [{"name": "rest", "kind": "linear", "about": "inverse"}]}, "about: expected an earlier analysis"),
    ):
        path = planar_in_space.write(spatial | change, tmp_path / "spatial.toml")
        with pytest.raises(ffrobot.InputError, match=message):
            ffrobot.solve(path)
