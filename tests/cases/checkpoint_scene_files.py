"""Scene files of the checkpoints in 3D, and how closely datasets have to meet their numbers."""

import shutil
from pathlib import Path

import h5py
import numpy as np
import scene_of
from checkpoint_mechanisms import load

FOLDER = Path(scene_of.__file__).parent


def write_scene(name, folder, *changes, more=""):
    """The scene of a checkpoint in a folder, with `changes` (old, new) to its text and `more` after it."""
    text, links = scene_of.scene(load(name), 1e-8)
    for link in links:
        shutil.copy(FOLDER / link, folder)
    scene = folder / "scene.toml"
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    scene.write_text(text + more)
    return scene


def solved(ffrobot, scene):
    """The results of a scene, which has to run."""
    ffrobot.ok("solve", scene)
    return h5py.File(scene.with_suffix(".results.h5"))


def close(found, expected, least=1e-12):
    """To 1e-6 of the peak, which is `least` at the least."""
    expected = np.array(expected)
    np.testing.assert_allclose(found[()], expected, atol=1e-6 * max(np.abs(expected).max(), least))
