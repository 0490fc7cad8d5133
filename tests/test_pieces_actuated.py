"""Patches, linear models and closed loops of links in pieces: as of the one link where that is stiff."""

import io

import h5py
import numpy as np
import pytest
from beam_links import beam_link, rectangle
from datasets import datasets
from tables_3d import pin, planar

from ffrobot import make_scene
from ffrobot.results.write import results_image
from ffrobot.run.solve import solve_scene

S = "(10*t**3-15*t**4+6*t**5)"
PATCHES = {"count": 4, "length": 0.12, "width": 0.02, "thickness": 5e-4, "modulus": 63e9, "d31": 1.1e-10}
INVERSE = {"name": "inverse", "kind": "pcid", "end": 0.5, "output_step": 0.01, "tolerance": 1e-5}
LOOP = {"kind": "closed-loop", "end": 0.2, "output_step": 0.01, "tolerance": 1e-5, "sample_time": 1e-3} | {
    "actuation": "inverse", "unlimited": True
}  # fmt: skip


def link(condition):
    keys = {"modes": {"count": 4, "family": "in-plane-bending"}, "damping": {"rayleigh": [0.0, 2e-4]}}
    return beam_link(1.0, rectangle(0.01, 0.02), 16, nu=0.3, condition=condition, name="link", **keys)


def solved(pieces, analyses, **keys):
    """Two links on a straight path of the tip, from equilibrium, as a results file."""
    conditions = {"link1": "simply-supported", "link2": "cantilever"}
    divided = {} if pieces is None else {"pieces": pieces}
    tables = planar(
        [{"name": name, "link": link(condition), **divided} for name, condition in conditions.items()],
        [pin("O", "ground", "link1.root"), pin("A", "link1.tip", "link2.root")],
        *analyses,
        geometric_stiffening=True,
        payload=[{"point": "link2.tip", "mass": 0.2}],
        initial={"state": "static", "angles": {"link1": 0.0, "link2": 0.8}},
        trajectory=[{"name": "tip", "point": "link2.tip", "x": f"1.6-0.2*{S}", "y": f"0.6+0.2*{S}"}],
        pzt=[{"body": name, **PATCHES, "allocation": "least-squares"} for name in conditions],
    )
    solution = solve_scene(make_scene(**tables | keys))
    return h5py.File(io.BytesIO(results_image(solution)))


@pytest.fixture(scope="module")
def one_and_four():
    """A path and its replay, with links whole and in four pieces."""
    replay = INVERSE | {"name": "replay", "kind": "forward", "actuation": "inverse", "apply": "joints+pzt", "end": 0.1}
    files = [solved(pieces, [INVERSE, replay, {"name": "robot", "kind": "linear"}]) for pieces in (None, 4)]
    yield files
    for file in files:
        file.close()


def difference(files, key):
    one, four = (file[key][()] for file in files)
    return np.abs(one - four).max() / np.abs(one).max()


@pytest.mark.parametrize(
    "key",
    ["joints/O/moment", "joints/A/moment", "pzt/link1/voltage", "pzt/link1/required_voltage",
     "pzt/link2/voltage", "points/link2.tip/predicted_shift"],
)  # fmt: skip
def test_moments_and_voltages_are_those_of_the_one_link(key, one_and_four):
    """Sags are 2 % of the length here: stiffening of one frame is right to 1e-3 there."""
    assert difference(one_and_four, f"inverse/{key}") < 2e-3


@pytest.mark.parametrize("group", ["inverse", "robot/linear/modes"])
def test_datasets_have_the_names_of_the_one_link(one_and_four, group):
    one, four = (datasets(file[group]).keys() for file in one_and_four)
    assert one == four


def test_voltages_are_applied_across_cuts(one_and_four):
    """Four patches serve four modes; what they leave of static shapes vibrates, whole or in pieces, and is small."""
    for file in one_and_four:
        tip = "points/link2.tip/position"
        replayed = file[f"replay/{tip}"][()]
        assert np.linalg.norm(replayed - file[f"inverse/{tip}"][: len(replayed)], axis=1).max() < 2e-5


def test_linear_model_of_pieces(one_and_four):
    """Frequencies, what motors and patches do to them, and how links move in the robot's modes."""
    one, four = (file["robot/linear"] for file in one_and_four)
    np.testing.assert_allclose(four["frequency"][0, 2:6], one["frequency"][0, 2:6], rtol=2e-3)
    np.testing.assert_allclose(four["damping_ratio"][0, 2:5], one["damping_ratio"][0, 2:5], rtol=5e-3)
    assert list(four.attrs["input_names"]) == list(one.attrs["input_names"])
    tips = [name for name in one.attrs["output_names"] if name.startswith("point/")]
    assert tips == [name for name in four.attrs["output_names"] if name.startswith("point/")]
    static = [gain(model, "pzt/link1/2", "point/link2.tip/y") for model in (one, four)]
    assert static[1] == pytest.approx(static[0], rel=5e-3)  # four eigenmodes of the one link are not all of it
    for mode in range(2, 5):
        shapes = [model["modes/link2/modal"][0, mode, :3] for model in (one, four)]
        cosine = shapes[0] @ shapes[1] / np.prod([np.linalg.norm(shape) for shape in shapes])
        assert abs(cosine) == pytest.approx(1.0, abs=1e-3)
        assert np.linalg.norm(shapes[1]) == pytest.approx(np.linalg.norm(shapes[0]), rel=2e-2)


def gain(model, given, read):
    """Response at 10 rad/s, below the first vibration, where the first motor holds nothing."""
    u, y = (list(model.attrs[key]).index(name) for key, name in (("input_names", given), ("output_names", read)))
    A, B, C = (model[key][0] for key in "ABC")
    return abs(C[y] @ np.linalg.solve(10j * np.eye(len(A)) - A, B[:, u]))


def test_a_closed_loop_acts_on_pieces_and_knows_the_links():
    """Sensors of joints, points, patches and modes read the pieces, controllers have the names of the links.

    Patches from the start on: there four modes sag under weight as pieces do within 0.3 % of the reading.
    """
    paths = [{"name": "first", "joint": "O", "value": f"0.1+0.4*{S}"},
             {"name": "second", "joint": "A", "value": f"0.5-0.6*{S}"}]  # fmt: skip
    loop = LOOP | {
        "name": "loop", "tip": "link2.tip",
        "disturbance": [{"point": "link2.tip", "y": "where(t < 0.1, 5.0*sin(10*pi*t)**2, 0.0)"}],
        "sensor": [{"pzt": "link2"}, {"point": "link2.tip"}, {"modal": "link1"}],
        "controller": [
            {"kind": "joint-pid", "proportional": {"O": 5.0, "A": 1.0}, "derivative": {"O": 0.05, "A": 0.01}},
            {"kind": "modal-velocity", "bodies": ["link2"], "modes": 1, "damping_ratio": 0.01},
        ],
    }  # fmt: skip
    lqr = {"kind": "lqr", "modes": 2, "moment": 0.1, "voltage": 10.0, "angle": 0.2, "rate": 2.0, "deflection": 0.05}
    design = LOOP | {"name": "design", "controller": [lqr], "end": 0.01}
    analyses = [INVERSE, loop, design]
    with solved(None, analyses, trajectory=paths) as one, solved(2, analyses, trajectory=paths) as two:
        for name in ("loop", "design"):
            assert {file[name].attrs["status"] for file in (one, two)} == {"completed"}
            assert list(one[f"{name}/control"].attrs["outputs"]) == list(two[f"{name}/control"].attrs["outputs"])
        outputs = list(one["loop/control"].attrs["outputs"])
        readings = [file["loop/control/readings"][()] for file in (one, two)]
        bounds = {"joint/A": 1e-3, "point/link2.tip/y": 2e-4, "pzt/link2/2": 1e-2, "modal/link1/1": 5e-3}
        for name, bound in bounds.items():
            a, b = (values[:, outputs.index(name)] for values in readings)
            if name.startswith("pzt"):
                assert b[0] == pytest.approx(a[0], rel=3e-3)
                a, b = a - a[0], b - b[0]
            assert np.abs(a - b).max() < bound * np.ptp(a), name
