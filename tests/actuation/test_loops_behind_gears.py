"""Sampled control of motors behind gears that give."""

import numpy as np
import pytest
from loop_scenes import GIVES, INERTIA, ON_MOTORS, blow, loop, two_rods, wheel
from scipy.linalg import expm

from ffrobot.common.errors import InputError
from ffrobot.mbs.quantities.motion import joint_motion
from ffrobot.run.solve import solve_scene


def test_gains_on_the_motors_side_stand_beside_a_rigid_gear():
    """Also where advice for the loop, which is not stable, tries gains for all motors."""
    still = {"O": {"joint": "O", "value": "0.4"}, "A": {"joint": "A", "value": "-1.1"}}
    wild = ON_MOTORS | {"derivative": {"O": 1e5}}
    record = solve_scene(two_rods(loop(controller=[wild]), first=GIVES, paths=still)).outcomes["loop"].details
    assert record.margins.radius > 1.0
    assert record.advice


def test_gears_that_give_are_wound_at_the_start():
    """Rods that stand still under gravity: the feed-forward holds them, and no controller has anything to do."""
    still = {"O": {"joint": "O", "value": "0.4"}, "A": {"joint": "A", "value": "-1.1"}}
    scene = two_rods(
        loop(controller=[ON_MOTORS]), loop("from_scene", controller=[ON_MOTORS], start="scene"),
        first=GIVES, second=GIVES, paths=still,
    )  # fmt: skip
    solution = solve_scene(scene)
    for name in ("loop", "from_scene"):
        record = solution.outcomes[name].details
        assert record.tip_error.max() < 1e-9
        assert np.abs(record.readings - record.reference).max() < 1e-9
        assert "motor/O" in record.outputs


def test_a_motor_behind_a_spring_is_its_two_masses():
    """P on the motor of a free wheel: γ of a step in the reference rate against the two masses, sampled finely."""
    I_m, k, c, P, D, T_fine = 1e-4 * 50.0**2, 2e3, 1.0, 200.0, 10.0, 1e-4
    on_motor = loop(controller=[ON_MOTORS], sample_time=T_fine, disturbance=blow(), feed_forward="none")
    rigid = loop("rigid", controller=[{"kind": "computed-torque", "bandwidth": 5.0}])
    solution = solve_scene(wheel(on_motor, rigid, joint=GIVES))
    assert solution.outcomes["rigid"].details.warnings[0].endswith("designed for rigid gears, but some are compliant")
    outcome, (angle, _) = solution.outcomes["loop"], joint_motion(solution.analyses["loop"].run, "O")
    # x = (θ_m, γ, rates); the blow is a moment of 5 N times 0.3 m on the wheel for 0.1 s, which turns by little
    M, K = np.diag([I_m, INERTIA]), np.array([[k + P, -k], [-k, k]])
    damping = np.array([[c + D, -c], [-c, c]])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, damping)]])
    b = np.array([0.0, 0.0, 0.0, 5.0 * 0.3 / INERTIA])
    settled = np.linalg.solve(A, b)
    t = outcome.time
    x = np.array([expm(A * min(s, 0.1)) @ settled - settled for s in t])
    x = np.array([expm(A * max(s - 0.1, 0.0)) @ row for s, row in zip(t, x, strict=True)])
    assert np.abs(angle[:, 0] - x[:, 1]).max() < 5e-3 * np.abs(x[:, 1]).max()


@pytest.mark.parametrize(
    "keys", [{"controller": [ON_MOTORS]}, {"sensor": [{"motor": "O"}]}, {"sensor": [{"motor": "P"}]}]
)
def test_motors_are_read_behind_gears_that_give_alone(keys):
    with pytest.raises(InputError, match="expected a joint with stiffness"):
        wheel(loop(**keys))
