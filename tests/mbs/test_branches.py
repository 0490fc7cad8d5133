"""The postures in which a scene can start: two of a planar arm, eight of an arm with a spherical wrist."""

from pathlib import Path

import numpy as np

from ffrobot.mbs.solve.branches import start_postures
from ffrobot.run.solve import prepare_scene

CASES = Path(__file__).parents[2] / "cases"


def test_elbow_up_and_down(tmp_path):
    """Two links of equal length: the other start is the mirror image about the line to the tip."""
    model = prepare_scene(CASES / "two_link" / "scene.toml").model
    first, second = start_postures(model)
    columns = model.tree.joint_columns
    np.testing.assert_allclose(first.q[: model.tree.n_v][columns], np.radians([0.0, 60.0]), atol=1e-12)
    np.testing.assert_allclose(second.q[: model.tree.n_v][columns], np.radians([60.0, -60.0]), atol=1e-12)
    assert second.guess == 'joints = { O = "60*deg", A = "-60*deg" }'
    np.testing.assert_allclose(second.away, np.radians(120.0), rtol=1e-12)


def test_shoulder_elbow_and_wrist_of_six_axes():
    """Each turn of the wrist comes in two, each elbow, each shoulder: all hold the tool in the same place and triad."""
    model = prepare_scene(CASES / "arm_6r" / "scene.toml").model
    found = start_postures(model)
    assert len(found) == 8
    tree, section = model.tree, model.tree.section("flange.tool", np.eye(3))
    held = [tree.motion(section, one.q[None], tree.frames(one.q[None])) for one in found]
    for motion in held:
        np.testing.assert_allclose(motion.r, held[0].r, atol=1e-10)
        np.testing.assert_allclose(motion.F, held[0].F, atol=1e-10)
    wrist = np.array([one.q[tree.nodes[tree.carried["wrist_pitch"]].q.start] for one in found])
    np.testing.assert_allclose(np.sort(wrist), -np.sort(wrist)[::-1], atol=1e-9)
