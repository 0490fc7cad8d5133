"""The tolerance at every output in 3D, also of what joints hand on that are no constraint rows.

Many more robots, others each time: tests/campaigns/tolerance.py --space.
"""

import h5py
import pytest
from checkpoint_scene_files import write_scene
from judging import largest_errors
from tolerance import histories, scales

# Reactions that were outside before they were judged, by that many tolerances
OUTSIDE = {"stanford, radau": ("stanford", 1e-6, "radau"),  # 3.4
           "stanford, dopri5": ("stanford", 1e-5, "dopri5"),  # 1.9
           "slider-crank, dopri5": ("slider_crank_3d", 1e-3, "dopri5")}  # 6  # fmt: skip


@pytest.mark.parametrize(
    ("name", "tolerance", "integrator"),
    [
        pytest.param(*of, id=name, marks=[pytest.mark.nightly] * (name == "stanford, radau"))
        for name, of in OUTSIDE.items()
    ],
)
def test_reactions_of_joints_of_the_tree(name, tolerance, integrator, tmp_path, ffrobot):
    scene = write_scene(name, tmp_path)
    head, tail = scene.read_text().split("[[analysis]]")
    exact = tail.replace('name = "inverse"', 'name = "exact"\noutput_step = 1e-3\ntolerance = 1e-10', 1)
    exact = "\n".join(line for k, line in enumerate(exact.splitlines()) if k < 4 or not line.startswith(("out", "tol")))
    found = exact.replace('"exact"', '"found"').replace("1e-10", f'{tolerance}\nintegrator = "{integrator}"')
    scene.write_text(f"{head}[[analysis]]{exact}\n[[analysis]]{found}\n")
    ffrobot.ok("solve", scene)
    with h5py.File(scene.with_suffix(".results.h5")) as file:
        expected = histories(file, "exact")
        scale = scales(file, expected, file["exact/time"][-1])
        worst = largest_errors(histories(file, "found"), expected, scale)
    assert max(worst.values())[0] <= tolerance, worst
