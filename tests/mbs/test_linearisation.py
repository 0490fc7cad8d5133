"""The linear equations about a planar motion against the oracle's: errors fall with the perturbation squared."""

import numpy as np
import pytest
import zoo
from links import arm, arm_links, ritz_link
from mechanisms import ModalLoad, make_model, pcid, revolute
from oracle_runs import run

from ffrobot.common.errors import SolveError
from ffrobot.mbs import _core
from ffrobot.mbs.model.model import without_paths
from ffrobot.mbs.solve.linearisation import LinearEquations
from ffrobot.mbs.solve.start import undeformed_posture

constant = _core.TimeFunction.constant
ROW = 2  # of the outputs: an instant at which everything moves


def links(is_stiffened):
    return arm_links(damping_ratio=0.02, stiffening=is_stiffened)


@pytest.fixture(scope="module", params=[False, True], ids=["plain", "stiffened"])
def motion(request):
    """The arm's inverse dynamics."""
    return request.param, run(arm(links(request.param)), pcid(end=0.4, output_step=0.1))


def linearised(outcome, points=()):
    run, model = outcome.outcome, without_paths(outcome.robot.model)
    return LinearEquations(model, run.q[ROW], points).at(run.time[ROW], run.q[ROW], run.v[ROW], run.a[ROW])


def driven(outcome, is_stiffened, more):
    """The arm with the moments and modal forces of one output, and `more` moments, in place of its trajectory."""
    moments = zip("OA", outcome.tau[ROW] + more, strict=True)
    modal = [
        ModalLoad(body.name, outcome.F_p[ROW, outcome.modal_columns(body.name)], constant(1.0))
        for body in outcome.robot.bodies
    ]
    load = [{"joint": joint, "moment": repr(float(moment))} for joint, moment in moments]
    tables = outcome.robot.tables | {"trajectory": [], "load": load}
    del tables["body"]
    return make_model(links(is_stiffened), modal, **tables)


def test_outputs_and_inputs_are_dual(motion):
    """A force at a point works on the point's motion: one gradient serves both."""
    linear = linearised(motion[1], ("link2.tip",))
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
