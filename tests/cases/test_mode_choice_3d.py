"""`modes` of bodies in 3D: what is promised of "auto" holds."""

import numpy as np
import pytest
import scenes_in_3d
from beam_links import beam_link, rectangle
from checkpoints import CASES
from tables_3d import joint, scene

import ffrobot
from ffrobot.common.errors import InputError
from ffrobot.mbs.model.truncation import with_fewer_modes
from ffrobot.mbs.quantities.motion import deflection
from ffrobot.run.bodies import load_bodies
from ffrobot.run.mode_search import difference, reported_modes
from ffrobot.run.solve import solve_scene
from ffrobot.run.watcher import Watcher
from ffrobot.scene.load import load_scene

POINTS = ("root", "tip")


ARM_MODES = '[modes]\nfamily = ["in-plane-bending", "out-of-plane-bending", "torsion"]\ncount = 18\n'


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """The 3R arm of tubes with 18 modes a link, from rest: its folder, the tables, and what all modes give."""
    folder = tmp_path_factory.mktemp("arm")
    case = CASES / "arm_3r"
    for link in ("upper", "fore"):
        text = (case / f"{link}.toml").read_text(encoding="utf-8")
        head, tail = text[: text.index("[modes]")], text[text.index("[damping]") :]
        (folder / f"{link}.toml").write_text(head + ARM_MODES + "attachment_modes = false\n" + tail, encoding="utf-8")
    tables = scenes_in_3d.read(case / "scene.toml")
    for body in tables["body"]:
        if "link" in body:
            body["link"] = f"{body['name']}.toml"
    # Errors are those of modes alone: steps of DOP853 that vibrations hold err less than their tolerance.
    tables["analysis"] = [tables["analysis"][0] | {"tolerance": 1e-6, "integrator": "dop853"}]
    return folder, tables, solved(folder, tables, None)


def solved(folder, tables, modes, **analysis):
    bodies = [body | {"modes": modes} if "link" in body and modes is not None else body for body in tables["body"]]
    tables = tables | {"body": bodies, "analysis": [tables["analysis"][0] | analysis]}
    return solve_scene(scenes_in_3d.write(tables, folder / "arm.toml"), Watcher())


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_the_estimate_of_an_arm_in_3d_is_honest(tolerance, arm):
    """All modes tell the error of a line in three dimensions: within the tolerance, and not far from the estimate."""
    folder, tables, exact = arm
    solution = solved(folder, tables, "auto", tolerance=tolerance)
    check_estimate(solution, exact, tolerance)
    for name in ("upper", "fore"):
        assert solution.bodies[name].spatial.reduction.lowest % 2 == 0  # of tubes both planes
        assert any(note.startswith(f"{name}: all modes but 6 of 18 modes and") for note in solution.notes)


def check_estimate(solution, exact, tolerance):
    """As in the plane: 3 times too small never, 6 times too large at most; half of the tolerance is kept."""
    found, expected = (reported_modes(of.analyses["inverse"]) for of in (solution, exact))
    errors = difference(found, expected)
    assert set(errors) == {"deflections", "forces", "motors"}
    worst, estimated = max(errors.values()), max(solution.mode_choice.errors["inverse"].values())
    assert worst <= tolerance
    assert worst / 3 < estimated < 6 * worst
    assert estimated <= tolerance / 2
    assert solution.mode_choice.tried[-1] < 36


@pytest.fixture(scope="module", params=[None, "fore.tip"])
def link(request, arm):
    """The fore arm with all its modes, bare and with a payload off its axis, which couples families."""
    folder, tables, _ = arm
    load = [{"point": request.param, "mass": 0.2, "center": [0.01, 0.02, 0.03]}] if request.param else []
    path = scenes_in_3d.write(tables | {"payload": load}, folder / "loaded.toml")
    scene = load_scene(path)
    (loaded,) = (body for body in load_bodies(scene, lambda _: None).values() if body.spatial.name == "fore")
    return loaded.spatial


@pytest.mark.parametrize("lowest", [0, 2, 5])
def test_what_is_left_out_keeps_its_static_flexibility_in_3d(link, lowest):
    body = with_fewer_modes(link, lowest, POINTS)
    assert body.n_modes < link.n_modes
    assert body.reduction.lowest == lowest

    def flexibility(of):
        rows = [np.vstack([of.points[name].translation, of.points[name].rotation]) for name in POINTS]
        B_T = np.vstack(rows).T
        return B_T.T @ (B_T / of.stiffness[:, None])

    np.testing.assert_allclose(flexibility(body), flexibility(link), rtol=0, atol=1e-9 * flexibility(link).max())


@pytest.mark.parametrize("modes", ["many", -1, 2.5])
def test_wrong_numbers_of_modes_in_3d(modes, tmp_path):
    tables = scenes_in_3d.read(CASES / "arm_3r" / "scene.toml")
    tables["body"][1]["modes"] = modes
    with pytest.raises(InputError, match=r'body "upper": modes: expected ("auto" or )?a .*number'):
        load_scene(scenes_in_3d.write(tables, tmp_path / "wrong.toml"))


@pytest.mark.parametrize(
    ("modes", "rigid", "sag"), [(1, "out-of-plane-bending, axial, torsion", 0.0), (2, "axial, torsion", 1.0)]
)
def test_motions_of_which_no_mode_is_kept_are_told(modes, rigid, sag):
    """A cantilever twice as wide as high under its weight across the wide side: its second mode is the first to sag."""
    link = beam_link(1.0, rectangle(0.01, 0.02), 10, name="link")
    body = {"name": "beam", "link": link, "modes": modes}
    tables = scene([body], [joint("wall", "weld", "ground", "beam.root")], {"name": "rest", "kind": "static"})
    solution = solve_scene(ffrobot.make_scene(**tables | {"gravity": [0.0, 0.0, -9.81]}))
    assert f"beam: rigid in {rigid}, of which its equations keep none of the modes" in solution.notes
    found = deflection(solution.analyses["rest"].run, "beam.tip")[0, 2]
    closed_form = -12 * 2700.0 * 9.81 / (8 * 70e9 * 0.02**2)
    assert found == pytest.approx(sag * closed_form, rel=0.015, abs=1e-12)
