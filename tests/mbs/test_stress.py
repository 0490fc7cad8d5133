"""Stress histories: von Mises by its textbook formula, the surface against a loop over outputs and points."""

from types import SimpleNamespace

import numpy as np
import pytest

from ffrobot.mbs.quantities import stress
from ffrobot.mbs.quantities.stress import body_stress, mode_displacement, von_mises


def textbook(s):
    """Timoshenko, Strength of Materials II, §82."""
    xx, yy, zz, yz, xz, xy = s
    normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return np.sqrt(normal / 2 + 3 * (yz**2 + xz**2 + xy**2))


def test_von_mises():
    samples = np.random.default_rng(0).normal(size=(50, 6))
    np.testing.assert_allclose(von_mises(samples), [textbook(s) for s in samples], rtol=1e-13)
    np.testing.assert_allclose(von_mises(np.array([5.0, 5, 5, 0, 0, 0])), 0.0, atol=1e-14)
    assert von_mises(np.array([7.0, 0, 0, 0, 0, 0])) == pytest.approx(7.0)
    assert von_mises(np.array([0, 0, 0, 0, 2.0, 0])) == pytest.approx(2 * np.sqrt(3))


def part(points, modes=4):
    """What stresses need of a modal body, with random modal stresses at so many points of its surface."""
    rng = np.random.default_rng(5)
    return SimpleNamespace(
        stress={}, surface_stress=rng.normal(size=(points, 6, modes)), surface_static=None, stress_loads=(),
        mesh=SimpleNamespace(points=rng.normal(size=(points, 3))),
    )  # fmt: skip


P = np.random.default_rng(2).normal(size=(23, 4))


@pytest.mark.parametrize("chunk", [1.0, 1e3, 1e9])
def test_surface_whatever_the_chunks(chunk, monkeypatch):
    monkeypatch.setattr(stress, "CHUNK_BYTES", chunk)
    body = part(31)
    surface = body_stress(body, mode_displacement(P)).surface
    for t in range(len(P)):
        everywhere = [textbook(modal @ P[t]) for modal in body.surface_stress]
        assert surface.von_mises_max[t] == pytest.approx(max(everywhere))
        np.testing.assert_array_equal(surface.position_of_max[t], body.mesh.points[np.argmax(everywhere)])
