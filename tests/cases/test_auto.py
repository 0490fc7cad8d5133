"""`integrator = "auto"` in 3D: what it chooses, and what becomes of a choice that turns out badly."""

import re

import h5py
import numpy as np
import pytest
from checkpoint_scene_files import solved, write_scene
from checkpoint_scenes import checkpoint_scene

from ffrobot.mbs import _core
from ffrobot.mbs.model.model import build_model
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.mbs.solve.start import undeformed_posture
from ffrobot.mbs.solve.vibration import vibrations_of, without_rows
from ffrobot.run.bodies import load_bodies

COARSE = ("tolerance = 1e-08", "tolerance = 1e-3")


def thick(folder):
    """Links thirty times as thick: they vibrate thirty times as fast."""
    for path in folder.glob("links/*.toml"):
        text = path.read_text()
        for size in re.findall(r"(?:outer|inner|height|width) = ([0-9.e-]+)", text):
            text = text.replace(f"= {size}", f"= {30 * float(size)!r}")
        path.write_text(text)


@pytest.fixture(scope="module")
def arm():
    """Without weight, which adds to the stiffness of links."""
    scene = checkpoint_scene("arm3_line_static").model_copy(update={"gravity": (0.0, 0.0, 0.0)})
    return build_model(scene, [body.spatial for body in load_bodies(scene, lambda _: None)])


def test_vibrations_show_in_the_motion(arm):
    """A little of each as the initial deflection, with the path held: it is pulled back by ω² times that."""
    start = undeformed_posture(arm)
    modes = vibrations_of(arm, without_rows(arm), 0.0, start.q)
    system, size = MultibodySystem(arm), 1e-8

    def acceleration(q):
        states = np.concatenate([q, np.zeros_like(start.v)])[None]
        return _core.tree_outputs(system.core, system.scene, [0.0], states).accelerations[0]

    at_rest = acceleration(start.q)
    for omega, shape in zip(modes.frequency, modes.shape.T, strict=True):
        pulled = (acceleration(arm.tree.integrate(start.q, size * shape)) - at_rest) / size
        np.testing.assert_allclose(pulled, -(omega**2) * shape, atol=2e-2 * omega**2 * np.abs(shape).max())


def test_soft_links_are_integrated_explicitly(tmp_path, ffrobot):
    file = solved(ffrobot, write_scene("arm3_line_static", tmp_path))
    assert file["inverse"].attrs["integrator"] == "dop853"
    assert "highest excited frequency" in file["inverse"].attrs["integrator_reason"]


def test_stiff_links_that_do_not_ring_are_integrated_implicitly(tmp_path, ffrobot):
    """With a fraction of the evaluations."""
    scene = write_scene("arm3_line_static", tmp_path, COARSE)
    thick(tmp_path)
    counts = {}
    for name, keys in {"auto": "", "explicit": 'integrator = "dop853"'}.items():
        scene.write_text(scene.read_text().replace("tolerance = 1e-3", f"tolerance = 1e-3\n{keys}"))
        done = ffrobot("solve", scene, "--verbose")
        assert done.returncode == 0, done.stderr
        with h5py.File(scene.with_suffix(".results.h5")) as file:
            counts[name] = file["inverse"].attrs["evaluations"]
            if name == "auto":
                assert file["inverse"].attrs["integrator"].startswith("radau")  # at its end
                top, rings = re.findall(r"frequency (\S+) rad/s", file["inverse"].attrs["integrator_reason"])
                assert float(rings) < 0.2 * float(top)
                assert "integrator" in done.stdout
    assert counts["auto"] < 0.6 * counts["explicit"], counts


def test_a_bad_choice_is_changed_during_the_run(arm):
    """Radau IIA where DOP853 is expected to get a thousand times as far: it takes over, and the motion is the same."""
    start, system, times = undeformed_posture(arm), MultibodySystem(arm), np.linspace(0.0, 0.1, 11).tolist()

    def run(*methods):
        controls = _core.IntegrationControls(tolerance=1e-6, max_steps=100_000, methods=methods, spectral_radius=0.8)
        return _core.tree_motion(system.core, system.scene, times, start.q, start.v, controls, lambda _: True)

    explicit, implicit = _core.MethodKind.dop853, _core.MethodKind.radau
    alone, changed = run((explicit, 1.0, 0.0)), run((implicit, 1.0, 0.0), (explicit, 1.0, 1e3))
    ((at, before, after, _),) = changed.changes
    assert 0.0 < at < 0.1
    assert (before, after) == (implicit, explicit)
    assert not alone.changes
    q = slice(0, arm.tree.n_q)
    np.testing.assert_allclose(changed.states[:, q], alone.states[:, q], atol=1e-5)
