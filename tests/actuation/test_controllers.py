"""Computed torque, LQR and functions of the user."""

import runpy

import numpy as np
import pytest
from four_bar import closed, planar
from loop_scenes import PID, blow, loop, two_rods, wheel

from ffrobot.actuation.control.robot import RigidArm
from ffrobot.common.errors import SolveError
from ffrobot.common.python_files import python_allowed
from ffrobot.mbs.quantities.supply import motor_moments
from ffrobot.run.solve import solve_scene
from ffrobot.scene.load import make_scene


def test_rigid_arm_knows_the_moments_of_the_inverse_analysis():
    built = {"gear_ratio": 30.0, "rotor_inertia": 1e-3, "viscous_friction": 0.2, "coulomb_friction": 0.5}
    solution = solve_scene(two_rods(first=built, second=built))
    inverse = solution.outcomes["inverse"]
    t = inverse.time
    gamma = np.column_stack([0.4 + 0.9 * np.sin(2 * t), -1.1 + 0.7 * np.cos(3 * t)])
    rate = np.column_stack([1.8 * np.cos(2 * t), -2.1 * np.sin(3 * t)])
    acceleration = np.column_stack([-3.6 * np.sin(2 * t), -6.3 * np.cos(3 * t)])
    arm = RigidArm(solution.model.without_paths(), inverse.q[0])
    moments = np.array([arm.moments(*state) for state in zip(gamma, rate, acceleration, strict=True)])
    found = motor_moments(solution.analyses["inverse"].run)
    tau = np.column_stack([found[joint] for joint in "OA"])
    np.testing.assert_allclose(moments, tau, atol=1e-8 * np.abs(tau).max())


def test_the_rigid_arm_says_where_its_links_do_not_reach():
    """A four-bar driven at its rocker, which crank and coupler hold between two angles."""
    path = {"name": "t", "joint": "D", "value": str(closed(1.0)["D"])}
    inverse = {"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.1}
    joints = {name: {"motor": name == "D"} for name in "ABCD"}
    solution = solve_scene(make_scene(**planar(joints, [inverse], trajectory=[path])))
    arm = RigidArm(solution.model.without_paths(), solution.outcomes["inverse"].q[0])
    assert np.abs(np.cos(arm.place(np.array([closed(1.1)["D"]]))[0]) - np.cos(1.1)).min() < 1e-9
    with pytest.raises(SolveError, match="expected joint angles that the rigid links can have, found"):
        arm.place(np.array([0.3]))


def test_a_function_of_the_user_acts_like_the_same_controller_of_the_scene(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(
        "import numpy as np\n\n"
        "def controller(setup):\n"
        "    y_O, y_rate = setup.columns('joint/O', 'joint/O/rate')\n"
        "    (u_O,) = setup.places('joint/O')\n"
        "    def at_sample(k, y):\n"
        "        u, e = np.zeros(len(setup.inputs)), setup.reference[k] - y\n"
        "        u[u_O] = 20.0 * e[y_O] + 4.0 * e[y_rate]\n"
        "        return u\n"
        "    return at_sample\n"
    )
    sensor = [{"joint": "O"}, {"joint": "O", "measure": "rate"}]
    mine = {"kind": "python", "python": f"{file}:controller"}
    itself = {"kind": "python", "python": runpy.run_path(str(file))["controller"]}
    loops = [
        loop("itself", controller=[itself], sensor=sensor, disturbance=blow()),
        loop("theirs", controller=[PID], sensor=sensor, disturbance=blow()),
        loop("mine", controller=[mine], sensor=sensor, disturbance=blow()),
    ]
    with python_allowed([tmp_path]):
        solution = solve_scene(wheel(*loops))
    theirs, own = solution.outcomes["theirs"].details, solution.outcomes["mine"].details
    np.testing.assert_allclose(own.commands, theirs.commands, atol=1e-12)
    np.testing.assert_array_equal(solution.outcomes["itself"].details.commands, own.commands)
    assert np.abs(own.commands).max() > 0.5


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("return np.full(3, np.nan)", r"expected 1 finite commands, shape \(1,\)"),
        ("return y[99]", r"IndexError: .* \(line \d+ of \w+\.py, in \w+\)"),
        ("return 10**400", r"OverflowError: int too large to convert to float"),
        (
            "return setup.columns('none')",
            r'InputError: .*expected readings \("joint/O"\), found "none" \(line \d+ of \w+\.py, in \w+\)',
        ),
    ],
)
def test_what_a_users_function_does_wrong_is_said(tmp_path, body, expected):
    file = tmp_path / "mine.py"
    file.write_text(f"import numpy as np\ndef controller(setup):\n    def act(k, y):\n        {body}\n    return act\n")
    mine = {"kind": "python", "python": f"{file}:controller"}
    with python_allowed([tmp_path]), pytest.raises(SolveError, match=f"sample 0, t = 0 s: {expected}"):
        solve_scene(wheel(loop(controller=[mine], sensor=[{"joint": "O"}])))


def test_lqr_names_the_modes_out_of_reach():
    """A second wheel that hangs on its own, without motor and sensor: it swings with √(m g d/(I + m d²))."""
    pendulum = {"mass": 1.0, "inertia": 0.3, "center": [0.1, 0.0], "points": {"root": [0.0, 0.0], "tip": [0.2, 0.0]}}
    scene = wheel(
        loop(controller=[{"kind": "lqr", "moment": 1.0}], disturbance=blow()),
        bodies=[{"name": "p", "rigid": pendulum}], gravity=[0.0, -9.81], initial={"angles": {"p": -np.pi / 2}},
        joints=[{"name": "P", "type": "revolute", "between": ["ground", "p.root"], "motor": False,
                 "viscous_friction": 0.1}],
    )  # fmt: skip
    frequency = np.sqrt(9.81 * 0.1 / 0.31) / (2 * np.pi)
    lines = solve_scene(scene).outcomes["loop"].details.warnings
    for word in ("uncontrollable", "unobservable"):
        assert any(word in line and f"({frequency:.4g} Hz)" in line for line in lines), lines
    assert any("no sensor reads joint/P" in line for line in lines), lines
