"""An arm with a flexible link that is held straight (FCID with p = 0): the inverse dynamics of rigid robots."""

import re
from pathlib import Path

import h5py
import numpy as np
from rigid_robots import moments, with_motion

CASE = Path(__file__).parents[2] / "cases" / "arm_6r"
ARM = (CASE / "arm.urdf").read_text(encoding="utf-8")
TUBE = (CASE / "links" / "tube.toml").read_text(encoding="utf-8")

# Moments at q = 0.3(1 … n), q̇ = 0.2(n … 1), q̈ = 0.5 cos(0 … n − 1) by Pinocchio 2.6.20, without friction.
EXPECTED = [
    0.680362372872216, -23.62796142979181, -1.070964938424388, -0.0493105744644358, 2.341927292101834, 0.00159795706122,
]  # fmt: skip


def test_straight_links_move_as_rigid_ones(tmp_path, ffrobot):
    names = re.findall(r'<joint name="(\w+)" type="revolute"', ARM)
    n = len(names)
    rows = 0.3 * np.arange(1, n + 1), 0.2 * np.arange(n, 0, -1), 0.5 * np.cos(np.arange(n))
    motion = [dict(zip(names, map(float, row), strict=True)) for row in rows]
    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "forearm.toml").write_text(TUBE)
    ffrobot.ok("import", "arm.urdf", "-o", "out", "--flexible", "forearm=forearm.toml", cwd=tmp_path)
    scene = tmp_path / "out" / "scene.toml"
    keys = re.sub(r"^(viscous|coulomb)_friction = .*\n", "", scene.read_text(), flags=re.MULTILINE)
    scene.write_text(with_motion(keys, *motion).replace('\nkind = "pcid"', '\nkind = "fcid"\nshape = "zero"'))
    ffrobot.ok("solve", scene)
    with h5py.File(scene.with_suffix(".results.h5")) as file:
        found = np.array([file[f"inverse/joints/{name}/moment"][0] for name in names])
        assert "modal" in file["inverse/bodies/forearm"]
    np.testing.assert_allclose(found, EXPECTED, atol=1e-10 * np.abs(EXPECTED).max())
    of_urdf = moments(ARM, *motion)
    np.testing.assert_allclose(found, [of_urdf[name] for name in names], atol=1e-12 * np.abs(EXPECTED).max())
