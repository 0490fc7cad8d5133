"""Modulus and damping of the measured beam from decay 1, which begins at rest, as an FRF.

    .venv/bin/python cases/piezo_beam_measured/fit_decay.py

A force F that ends at t = 0 leaves x(t) with H(ω)/H(0) = 1 − iω X(ω)/x(0) (Laplace transform of the decay). The records
have no force: H(0) is that of the model, and the instant of the release makes the phase at the peak −90°.
"""

import tempfile
import tomllib
from pathlib import Path

import numpy as np
import tomli_w
from compare import HERE, record
from rich.console import Console

import ffrobot
from ffrobot.fit.fitting import print_fit

BAND = np.arange(7.6, 8.85, 0.05)  # Hz, about the lowest mode: a decay of 14 s distinguishes 0.07 Hz
HELD = -0.07  # s, of the last sample at rest
KEYS = ["links.beam.material.youngs_modulus", "links.beam.damping.rayleigh.1"]


def response() -> np.ndarray:
    """H(ω)/H(0) (F,) of decay 1 about the lowest mode."""
    t, y = record("free_decay_1")
    free, w = t > HELD, 2 * np.pi * BAND
    still, t, y = y[~free].mean(), t[free], y[free]
    X = np.exp(-1j * w[:, None] * t) @ y * 0.01
    begins = np.linspace(HELD, 0.0, 701)
    H = 1.0 - 1j * w[:, None] * X[:, None] * np.exp(1j * w[:, None] * begins) / still
    peak = int(np.abs(X * w).argmax())
    return H[:, np.abs(np.angle(1j * H[peak])).argmin()]


def main() -> None:
    """Write the FRF and a scene beside it, and fit."""
    scene = tomllib.loads((HERE / "scene.toml").read_text())
    scene["analysis"] = [{"name": "rest", "kind": "static"}]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "link.toml").write_text((HERE / "link.toml").read_text())
        (folder / "scene.toml").write_text(tomli_w.dumps(scene))
        with ffrobot.solve(folder / "scene.toml") as results:
            static = results["rest/joints_locked/compliance/beam.tip"][0, 1, 1]  # m/N
        rows = ["frequency,force,response,real,imaginary"]
        rows += [f"{f},beam.tip/y,beam.tip/y,{h.real},{h.imag}" for f, h in zip(BAND, static * response(), strict=True)]
        (folder / "decay.csv").write_text("\n".join(rows))
        (folder / "tests.toml").write_text('[[test]]\nname = "decay 1"\nfile = "decay.csv"\nunit = "m/N"\n')
        print_fit(ffrobot.fit_responses(folder / "scene.toml", folder / "tests.toml", KEYS), Console(width=140))


if __name__ == "__main__":
    main()
