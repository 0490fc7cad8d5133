"""Scene files of the checkpoints in 3D, and how closely datasets have to meet their numbers."""

import shutil

import h5py
import numpy as np
from checkpoint_mechanisms import FOLDER


def write_scene(name, folder, *changes):
    """The scene of a checkpoint in a folder, with `changes` (old, new) to its text."""
    shutil.copytree(FOLDER / "links", folder / "links")
    text, scene = (FOLDER / f"{name}.toml").read_text(), folder / "scene.toml"
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    scene.write_text(text)
    return scene


def solved(ffrobot, scene):
    """The results of a scene, which has to run."""
    ffrobot.ok("solve", scene)
    return h5py.File(scene.with_suffix(".results.h5"))


def close(found, expected, least=1e-12):
    """To 1e-6 of the peak, which is `least` at the least."""
    expected = np.array(expected)
    np.testing.assert_allclose(found[()], expected, atol=1e-6 * max(np.abs(expected).max(), least))
