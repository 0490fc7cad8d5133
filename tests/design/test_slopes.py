"""Gradients in a search: one run for each number with the steps of the design's own, against `ffrobot sensitivity`."""

import numpy as np
import pytest
import tomli_w
from small_robots import SWING

import ffrobot
from ffrobot.batch.batch import Batch, Processes
from ffrobot.design.designs import Designs, Runs, changes_for
from ffrobot.design.evaluations import Differentiation, Evaluations
from ffrobot.design.responses import read_problem
from ffrobot.design.variables import read_space

OUTER, LOAD = "links.arm.geometry.section.outer", "payload.0.mass"
GOALS = ("rms joints.shoulder.moment", "rms points.arm.tip.deflection")


def differentiation(tmp_path, scene):
    """Of `GOALS` by the tube's diameter and the payload; and its first design."""
    path = tmp_path / "scene.toml"
    path.write_text(tomli_w.dumps(scene), encoding="utf-8")
    problem = read_problem(GOALS[0], None, [f"{GOALS[1]} <= 1"])
    space = read_space(path, [f"{OUTER}=0.018:0.03", f"{LOAD}=0.1:1:log"])
    fixed = changes_for(path, problem.responses, 1e-7, keep_steps=True)
    designs = Designs(Runs(path, tmp_path / "runs", Batch(lambda: Processes(2))), space.keys, space.own, fixed)
    evaluations = Evaluations(designs, space, problem)
    (first,) = evaluations.at([space.start_place])
    found = Differentiation(evaluations, 1e-7)
    return found, first


def by_keys(found, first):
    """∂response/∂key from ∂response/∂u."""
    variables = found.evaluations.space.variables
    return np.array([variable.slope(u) for variable, u in zip(variables, first.place, strict=True)])


def test_one_run_for_each_number(tmp_path):
    """Steps of 6e-6 of a number: truncation is 1e-5 of the derivative or so, and the estimate says so."""
    found, first = differentiation(tmp_path, SWING)
    slopes = found.slopes(first)
    assert found.evaluations.designs.count == 1 + 2 + 1
    expected = ffrobot.sensitivity(tmp_path / "scene.toml", GOALS, [OUTER, LOAD], processes=2)
    scale = np.abs(expected.derivative * by_keys(found, first))
    difference = np.abs(slopes.gradient - expected.derivative * by_keys(found, first))
    assert np.all(difference <= 1e-4 * scale)
    assert np.all(difference <= slopes.error + 1e-6 * scale)
    assert np.all(slopes.error <= 1e-3 * scale)
    assert found.slopes(first).gradient == pytest.approx(slopes.gradient, rel=0, abs=0)
    assert found.evaluations.designs.count == 4
