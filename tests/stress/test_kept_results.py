"""A run that ends before its end, as a user sees it: exit code, message, and what the results file holds."""

import h5py
import numpy as np

SCENE = """
name = "rod"
gravity = [0.0, -9.81]

[[body]]
name = "arm"
rigid = { mass = 1.0, inertia = 0.1, center = [0.5, 0.0], points = { root = [0.0, 0.0], tip = [1.0, 0.0] } }

[[joint]]
name = "O"
type = "revolute"
between = ["ground", "arm.root"]

[[load]]
joint = "O"
moment = "1/(0.5005-t)"

[[analysis]]
name = "fall"
kind = "forward"
end = 1.0
output_step = 0.01
"""


def test_ends_with_time_cause_and_results(ffrobot, tmp_path):
    (tmp_path / "scene.toml").write_text(SCENE)
    done = ffrobot("solve", "scene.toml", cwd=tmp_path)
    assert done.returncode == 1
    (message,) = done.stderr.splitlines()
    assert 'analysis "fall" ended at t = 0.500' in message
    assert "(step underflow)" in message
    assert 'load on "O", moment, jumps from' in message
    with h5py.File(tmp_path / "scene.results.h5") as file:
        fall = file["fall"]
        assert fall.attrs["status"] == "step underflow"
        assert fall.attrs["cause"] in message
        np.testing.assert_allclose(fall["time"], np.arange(51) * 0.01, atol=1e-12)
        assert np.isfinite(fall["bodies/arm/angle"]).all()
