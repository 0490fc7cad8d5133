"""`modes` of a body: fewer modes than its file has, as many as the tolerance needs, and what is said about it."""

import tomllib
from pathlib import Path

import h5py
import numpy as np
import pytest

from ffrobot import make_scene
from ffrobot.common import checksum
from ffrobot.results.file import Results
from ffrobot.results.write import results_image
from ffrobot.run.mode_search import ErrorEstimate, reported_modes
from ffrobot.run.solve import solve_scene

CASE = Path(__file__).parents[1] / "cases" / "two_link"
S = "(10*t**3-15*t**4+6*t**5)"  # from rest to rest with zero acceleration at both ends
QUINTIC = {"x": f"1.5-0.5*{S}", "y": f"sqrt(3)/2+0.3*{S}"}


def scene(state="static", path=QUINTIC, modes=None, forward=(), **analysis):
    keys = tomllib.loads((CASE / "scene.toml").read_text(encoding="utf-8"))
    for body in keys["body"]:
        body["modes"] = modes
    keys["initial"]["state"] = state
    keys["trajectory"][0] |= path or {}
    keys["analysis"] = [keys["analysis"][0] | analysis, *forward]
    return make_scene(folder=CASE, **keys)


def test_all_modes_are_taken_where_fewer_do_not_do():
    solution = solve_scene(scene("undeformed", None, "auto", tolerance=1e-3, end=0.1))
    assert solution.mode_choice.tried[-1] == 20
    assert len(solution.mode_choice.tried) <= 4  # it sees from the pace that there is no hope
    assert set(solution.mode_choice.errors["inverse"].values()) == {0.0}
    assert max(solution.mode_choice.before["inverse"].values()) > 1e-3
    assert all(node.body.reduction is None for node in solution.model.tree.nodes)


def test_errors_that_shrink_by_a_constant_ratio_are_found_exactly():
    estimate = ErrorEstimate()
    for n in range(3):
        assert not estimate.meets({"run": 1.0})
        estimate.add({"run": {"forces": {"tip": np.array([1.0, -0.5 + 0.2 * 0.25**n])}}})
    assert estimate.errors["run"]["forces"] == pytest.approx(0.2 * 0.25**2)
    assert estimate.meets({"run": 0.03})
    assert not estimate.meets({"run": 0.02})
    assert estimate.is_hopeless({"run": 1e-4}, more=2)
    assert not estimate.is_hopeless({"run": 1e-4}, more=5)


def test_what_forces_and_voltages_do_forwards_with_fewer_modes():
    """The arm that carries out its own inverse dynamics moves as that said; voltages serve modes left out too."""
    run = {"name": "forward", "kind": "forward", "actuation": "inverse", "apply": "joints+pzt"}
    solution = solve_scene(scene(modes=3, forward=[run], end=0.2, tolerance=1e-7))
    inverse, back = (reported_modes(solution.analyses[name])["deflections"] for name in ("inverse", "forward"))
    for point, deflection in inverse.items():
        np.testing.assert_allclose(back[point], deflection, rtol=0, atol=1e-8)


@pytest.fixture(scope="module")
def reduced():
    return solve_scene(scene(modes="auto", tolerance=3e-3))


def test_results_say_what_their_modal_coordinates_are(reduced, tmp_path):
    path = tmp_path / "reduced.h5"
    path.write_bytes(results_image(reduced))
    checksum.seal(path)
    with h5py.File(path) as file:
        body = file["inverse/bodies/link2"]
        assert body["modal"].shape == (1001, 5)
        assert body["modal_transform"].shape == (10, 5)
        assert "modal_transform" in body.attrs["modal_coordinates"]
        assert body.attrs["modes_kept"] == "3 of 10 modes and 2 static shapes for the others"
        assert 0.0 < file["inverse"].attrs["mode_error_forces"] < 3e-3
    with Results(path) as results:
        p, modal = results.modal("inverse", "link2"), results.modal_body("link2")
        deflection = results["inverse/points/link2.tip/deflection"]
        np.testing.assert_allclose(p @ modal.interfaces["tip"].translation[:2].T, deflection, atol=1e-15)
        assert any("3 of 10 modes and 2 static shapes" in line for line in results.skipped)
