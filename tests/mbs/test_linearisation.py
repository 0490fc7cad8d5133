"""Coordinates, inputs and outputs of the linear equations about a planar motion."""

import numpy as np
import pytest
import zoo
from links import arm, arm_links, ritz_link
from mechanisms import make_model, pcid, revolute
from oracle_runs import run

from ffrobot.common.errors import SolveError
from ffrobot.mbs.linear.linearisation import LinearEquations
from ffrobot.mbs.posture.start import undeformed_posture


@pytest.mark.parametrize("stiffened", [False, True])
def test_outputs_and_inputs_are_dual(stiffened):
    """A force at a point works on the point's motion: one gradient serves both."""
    found = run(arm(arm_links(damping_ratio=0.02, stiffening=stiffened)), pcid(end=0.2, output_step=0.1))
    one, model = found.outcome, found.robot.model.without_paths()
    linear = LinearEquations(model, one.q[-1], ("link2.tip",)).at(one.time[-1], one.q[-1], one.v[-1], one.a[-1])
    for axis in "xy":
        np.testing.assert_array_equal(
            linear.inputs[f"force/link2.tip/{axis}"], linear.outputs[f"point/link2.tip/{axis}"]
        )
    assert "force/link2.tip/z" not in linear.inputs
    assert list(linear.outputs)[:2] == ["joint/O", "joint/A"]
    np.testing.assert_allclose(linear.inputs["joint/A"], np.eye(len(linear.names))[1], atol=1e-12)


@pytest.mark.parametrize(
    ("name", "driven", "expected"),
    [
        ("four-bar", ["j1"], ["joint/j1"]),
        ("chain of 2", ["j2"], ["joint/j2", "joint/j1"]),
        ("chain of 2", [], ["joint/j1", "joint/j2"]),
    ],
)
def test_independent_coordinates(name, driven, expected):
    """Motors first, then the other joints, then modes."""
    joints = [joint | {"motor": joint["name"] in driven} for joint in zoo.build(name).tables["joint"]]
    model = zoo.build(name, trajectory=[], joint=joints).model
    names = LinearEquations(model, undeformed_posture(model).q).names
    assert [one for one in names if not one.startswith("modal/")] == expected
    assert len(names) == len(expected) + sum(node.body.n_modes for node in model.tree.nodes)


def test_singular_configuration_is_refused():
    """Stretched, the slider no longer determines the crank."""
    joints = [revolute(*one, motor=False) for one in (("O", "ground", "link1.root"), ("A", "link1.tip", "link2.root"))]
    joints += [revolute("B", "link2.tip", "slider.root", motor=False)]
    joints += [{"name": "rail", "type": "prismatic", "between": ("ground", "slider.root"), "axis": (1.0, 0.0),
                "motor": True}]  # fmt: skip
    bodies = [*arm_links(), ritz_link("slider", "cantilever")]
    bent, stretched = (
        make_model(bodies, joint=joints, initial={"angles": {"link1": angle, "link2": -angle}}).model
        for angle in (0.7, 0.0)
    )
    q, rest = undeformed_posture(bent).q, np.zeros(bent.tree.n_v)
    linearisation = LinearEquations(bent, q)
    assert linearisation.names[0] == "joint/rail"
    linearisation.at(0.0, q, rest, rest)
    with pytest.raises(SolveError, match="joint/rail do not determine the posture"):
        linearisation.at(0.0, undeformed_posture(stretched).q, rest, rest)
