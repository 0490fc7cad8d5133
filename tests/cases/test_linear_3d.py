"""Linear models of robots in 3D: gears, closed forms, bad input."""

import numpy as np
import pytest

import ffrobot


@pytest.mark.parametrize("turned", [False, True])
def test_a_motor_behind_its_gear_swings_against_a_body(tmp_path, turned):
    """ω² of k (1, −1)ᵀ(1, −1) in the kinetic energy ½ I q̇² + ½ J (N θ̇ + q̇)² on the body, ½ J N² θ̇² on the ground."""
    J, N, k, axis, inertia = 3e-3, 9.0, 500.0, np.array([0.48, -0.6, 0.64]), np.diag([0.3, 0.2, 0.4])
    sides = ["b.root", "ground"] if turned else ["ground", "b.root"]
    rigid = {"mass": 1.0, "center": [0.0, 0.0, 0.0], "inertia": inertia.tolist(), "points": {"root": [0.0, 0.0, 0.0]}}
    joint = {"name": "O", "type": "revolute", "between": sides, "axis": axis.tolist(), "gear_ratio": N}
    scene = ffrobot.make_scene(
        name="gear", space="spatial", gravity=[0.0, 0.0, 0.0], body=[{"name": "b", "rigid": rigid}],
        joint=[joint | {"rotor_inertia": J, "stiffness": k}], analysis=[{"name": "rest", "kind": "linear"}],
    )  # fmt: skip
    I = axis @ inertia @ axis  # noqa: E741
    M = np.array([[N**2 * J, -N * J], [-N * J, I + J]]) if turned else np.diag([N**2 * J, I])
    expected = np.linalg.eigvals(np.linalg.solve(M, k * np.array([[1.0, -1.0], [-1.0, 1.0]]))).real.max()
    with ffrobot.solve(scene) as results:
        assert results["rest/linear/frequency"][0, 1] == pytest.approx(np.sqrt(expected) / (2 * np.pi), rel=1e-9)
        (model,) = results.linear("rest")
        low = model.frequency_response(np.array([1e-3]), "joint/O", ["joint/O", "motor/O"])[0, :, 0]
        whole = np.ones(2) @ M @ np.ones(2)  # θ = γ: both turn together
        np.testing.assert_allclose(low, -1e6 / whole, rtol=1e-4)
