"""Round-off that light parts amplify, or that loads leave where motors bear them, ends no run and shortens no steps."""

import re

import numpy as np
import pytest
from beam_links import beam_link, rectangle, tube
from tables_3d import joint, planar, scene

import ffrobot

TIGHT = 1e-9
INVERSE = {"name": "inv", "kind": "pcid", "max_steps": 20000}


def beam(name, length, height, width, condition, ratio):
    keys = {"modes": {"count": 1, "attachment_modes": False}, "damping": {"ratio": ratio}}
    return {"name": name, "link": beam_link(length, rectangle(height, width), 8, condition=condition, **keys)}


@pytest.fixture(scope="module")
def four_bar():
    """A crank of 0.4 g, whose tip turns the rod by a universal joint, in static equilibrium: runs by their keys."""

    def solved(**keys):
        bodies = [
            beam("crank", 0.06577, 0.0013, 0.00183, "simply-supported", 0.01),
            beam("rod", 0.39146, 0.00705, 0.01092, "cantilever", 0.0),
            beam("rock", 0.3461, 0.00721, 0.01041, "simply-supported", 0.01),
        ]
        joints = [
            joint("O", "revolute", "ground", "crank.root", motor=True, **DRIVE),
            joint("U", "universal", "crank.tip", "rod.root", motor=False, **UNIVERSAL),
            joint("S", "spherical", "rod.tip", "rock.tip"),
            joint("Q", "revolute", "ground", "rock.root", motor=False, **ROCKER),
        ]
        tables = scene(
            bodies, joints, INVERSE | {"end": 0.3, "output_step": 0.01} | keys, gravity=[0.6571, -8.558, 4.7503],
            initial={"state": "static", "joints": {"O": -0.49315}},
            trajectory=[{"name": "d", "joint": "O", "value": MOTION}],
        )  # fmt: skip
        return ffrobot.solve(ffrobot.make_scene(**tables))

    return solved


MOTION = "-0.49315 + 0.00597*(10*(t/0.3)**3 - 15*(t/0.3)**4 + 6*(t/0.3)**5)"
DRIVE = {"axis": [0.46033, 0.8619, -0.21267], "rpy": [-2.28683, 0.66224, -2.624]}
ROCKER = {
    "axis": [0.8398, -0.49703, 0.21842], "rpy": [-0.82132, 0.58578, -2.81788], "at": [0.10956, -0.1357, -0.18527],
}  # fmt: skip
UNIVERSAL = {
    "axis": [-0.3624011439914209, 0.8698454308570439, 0.3347153077629302],
    "second_axis": [-0.7642044079087118, 0.5449168110059214, -0.3450467968494014],
    "rpy": [-0.9549194277130745, 0.04012673226025898, 0.1575400414727917],
}


def rates(results):
    """Of the joints that are angles: (T, 4) rad/s."""
    return np.column_stack([results[f"inv/joints/{name}/rate"] for name in "OUQ"])


def relative(found, expected):
    return np.abs(found - expected).max() / np.abs(expected).max()


@pytest.mark.filterwarnings("ignore::ffrobot.FfrobotWarning")
def test_a_light_crank_in_equilibrium(four_bar):
    """It ended at 1e-4 s as no step was small enough. Two integrators that estimate errors otherwise agree."""
    by_dop853 = four_bar(integrator="dop853", tolerance=1e-6)
    by_dopri5 = four_bar(integrator="dopri5", tolerance=1e-6)
    assert by_dop853.attributes("inv")["status"] == "completed"
    assert relative(rates(by_dop853), rates(by_dopri5)) < 1e-5


@pytest.mark.filterwarnings("ignore::ffrobot.FfrobotWarning")
def test_a_tolerance_below_rounding_is_named(four_bar):
    """The tolerance that is said to do bounds what a run with another integrator differs by."""
    tight, other = (four_bar(integrator=name, tolerance=TIGHT) for name in ("dop853", "dopri5"))
    (text,) = [text for text in tight.warnings["inv"] if "below round-off" in text]
    would_do = float(re.search(r"tolerance = ([\d.e-]+)", text)[1])
    assert TIGHT < would_do < 1e-4
    assert relative(rates(tight), rates(other)) < would_do


def chain(count, link, path, *, space=planar, load=None, **keys):
    """Hinged links without gravity whose joints follow a path each, under a load on each."""
    axis, ends = {"axis": [0.0, 0.6, 0.8]} if space is scene else {}, ["ground", *(f"b{k}.tip" for k in range(count))]
    tables = space(
        [{"name": f"b{k}", "link": link} for k in range(count)],
        [joint(f"j{k}", "revolute", ends[k], f"b{k}.root", **axis) for k in range(count)],
        INVERSE | {"end": 1.0, "output_step": 0.05} | keys,
        gravity=[0.0] * (3 if space is scene else 2),
        trajectory=[{"name": f"t{k}", "joint": f"j{k}", "value": path} for k in range(count)],
        load=[] if load is None else [{"joint": f"j{k}", "moment": load} for k in range(count)],
    )
    return ffrobot.solve(ffrobot.make_scene(**tables))


@pytest.mark.parametrize("space", [planar, scene])
@pytest.mark.parametrize("rate", ["0", "0.1*t"])
@pytest.mark.parametrize("load", ["80*exp(-((t - 0.50037)/0.002)**2)", "1e4*sin(20*t)"])
def test_loads_that_motors_bear(space, rate, load):
    """Twelve steps became two thousand, or none was short enough. Motors add the loads, and nothing else changes."""
    slender = beam_link(0.6, tube(0.02, 0.016), 10, modes={"count": 3}, damping={"ratio": 0.01})
    alone, loaded = (chain(2, slender, rate, space=space, load=of) for of in (None, load))
    steps, more = (float(of.attributes("inv")["steps"]) for of in (alone, loaded))
    assert more <= 3 * steps
    t = loaded.time("inv")
    size = np.abs(given := np.array([eval(load, vars(np) | {"t": x}) for x in t])).max()
    for name in ("j0", "j1"):
        added = loaded[f"inv/joints/{name}/moment"] - alone[f"inv/joints/{name}/moment"]
        assert np.abs(added + given).max() < 1e-6 * size


def test_many_modes_at_the_default_tolerance():
    """Steps of order 5: a hundredth of the tolerance takes 2.5 times as many, where it took 6 and 20 times."""
    link = beam_link(0.3, tube(0.02, 0.016), 40, modes={"count": 20, "family": "in-plane-bending"})
    path = "0.5*(10*t**3 - 15*t**4 + 6*t**5)"
    keys = {"damping": {"ratio": 0.01}}
    loose, tight = (chain(5, link | keys, path, integrator="radau", tolerance=at) for at in (1e-4, 1e-6))
    assert tight.attributes("inv")["steps"] <= 4 * loose.attributes("inv")["steps"]
    found = [of["inv/joints/j0/moment"] for of in (loose, tight)]
    assert relative(*found) < 1e-4
