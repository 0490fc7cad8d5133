"""An undamped solid that swings from rest: true vibrations of its attachment modes, or their quasi-static shape.

    .venv/bin/python tools/bench/quasi_static.py

A modal damping ratio of 1 on the attachment modes alone makes them follow their loads without vibration. Printed are
steps, and differences from the true vibrations as parts of their peaks.
"""

import os
import shutil
import tempfile
from pathlib import Path

import h5py
import numpy as np

import ffrobot

LINK = """
name = "bar"
material = { youngs_modulus = 7.06e10, poissons_ratio = 0.329, density = 2790.0 }
geometry = { kind = "solid", length = 0.3, section = { shape = "rectangle", height = 0.024, width = 0.032 } }
mesh = { order = 2, cell = "hexahedron", divisions = [24, 2, 2] }
reference = { condition = "cantilever" }
modes = { count = 10, family = "all" }
"""
QUANTITIES = ("points/bar.tip/position", "points/bar.tip/deflection", "joints/J/reaction", "joints/J/reaction_moment")


def swing(modal: str) -> ffrobot.Results:
    """0.8 s about a slanted axis from an undeformed start, whose loads jump."""
    return ffrobot.solve(
        ffrobot.make_scene(
            name=Path(modal).stem,
            space="spatial",
            gravity=[3.1, -8.7, -4.4],
            body=[{"name": "bar", "modal": modal}],
            joint=[{"name": "J", "type": "revolute", "between": ["ground", "bar.root"], "axis": [0.2, 0.3, 0.93]}],
            initial={"state": "undeformed"},
            analysis=[{"name": "run", "kind": "forward", "end": 0.8, "output_step": 0.005, "tolerance": 1e-4}],
        )
    )


def main() -> None:
    """Print both runs."""
    os.chdir(tempfile.mkdtemp())
    Path("bar.toml").write_text(LINK)
    ffrobot.make_link("bar.toml")
    shutil.copy("bar.h5", "quasi_static.h5")
    with h5py.File("quasi_static.h5", "a") as file:
        ratios, residual = file["modes/damping_ratio"][()], file["modes/residual"][()].astype(bool)
        file["modes/damping_ratio"][...] = np.where(residual, 1.0, ratios)
        del file.attrs["checksum"]
        frequencies = file["modes/frequency"][()]
        highest = (frequencies[~residual].max(), frequencies[residual].max())
        print("highest eigenmode and attachment mode: {:.0f}, {:.0f} Hz".format(*highest))
    true, quasi_static = swing("bar.h5"), swing("quasi_static.h5")
    print("steps", *(results.attributes("run")["steps"] for results in (true, quasi_static)))
    for quantity in QUANTITIES:
        ours, theirs = (np.asarray(results[f"run/{quantity}"]) for results in (quasi_static, true))
        print(f"{quantity}: {np.abs(ours - theirs).max() / np.abs(theirs).max():.2g}")


if __name__ == "__main__":
    main()
