"""An arm whose links come from STEP files with lightening holes."""

import subprocess
import sys

import gmsh
import numpy as np
import pytest
from checkpoints import CASES

from ffrobot.fe_models.modal_body_file import read_modal_body
from ffrobot.mesh.gmsh_session import gmsh_session

pytestmark = pytest.mark.nightly  # half a minute of solids from STEP: tests/mesh/test_step_files.py has small ones
DENSITY, WIDTHS = 2700.0, {"upper_arm": 0.012, "forearm": 0.008}
# make_parts.py: lengths, heights at root and tip in m, numbers of holes.
MEASURES = {"upper_arm": (0.5, 0.060, 0.044, 7), "forearm": (0.4, 0.044, 0.030, 6)}


def plate(name):
    """Area in m² and first moment about the root in m³ of a link's plate, holes taken out."""
    length, root, tip, count = MEASURES[name]
    x = length / (count + 1) * np.arange(1, count + 1)
    holes = np.pi * (0.3 * (root + (tip - root) * x / length)) ** 2
    area = length * (root + tip) / 2 - holes.sum()
    return area, length**2 * (root / 2 + (tip - root) / 3) - holes @ x


@pytest.fixture(scope="module")
def bodies(ffrobot, case_copy_of_module):
    folder = case_copy_of_module("lightened_arm").parent
    for name in MEASURES:
        ffrobot.ok("link", folder / f"{name}.toml")
    return {name: read_modal_body(folder / f"{name}.h5") for name in MEASURES}


@pytest.mark.parametrize("name", MEASURES)
def test_mass_is_that_of_the_drawing(bodies, name):
    """Plane areas in closed form; twelve quadratic elements around leave 2e-4 of a round hole's area out."""
    area, first = plate(name)
    mass = DENSITY * WIDTHS[name] * area
    assert bodies[name].mass == pytest.approx(mass, rel=1e-4)
    np.testing.assert_allclose(
        bodies[name].first_moment, [DENSITY * WIDTHS[name] * first, 0, 0], rtol=0, atol=1e-4 * mass * 0.5
    )


def test_the_script_draws_the_parts(tmp_path):
    """make_parts.py, and the parts beside it, have the volumes of the drawing, mm³."""
    case = CASES / "lightened_arm"
    script = tmp_path / "make_parts.py"
    script.write_bytes((case / script.name).read_bytes())
    subprocess.run([sys.executable, script], check=True, capture_output=True)
    for path in [folder / f"{name}.step" for name in MEASURES for folder in (tmp_path, case)]:
        with gmsh_session():
            gmsh.model.occ.importShapes(str(path))
            (solid,) = gmsh.model.occ.getEntities(3)
            assert gmsh.model.occ.getMass(*solid) == pytest.approx(
                1e9 * WIDTHS[path.stem] * plate(path.stem)[0], rel=1e-6
            )


def test_stress_is_that_of_bending_beside_a_hole(solved):
    """Motors alone, at rest: the forearm bends under the load; beside a hole the net section carries more.

    Nominal stress M (h/2) / I of the net section at the hole where it is largest, times 1 to 1.5: the edge of a hole in
    bending is no sharp notch (Peterson's Stress Concentration Factors, section 4.6: K_tn about 1 for d/h = 0.6).
    """
    group = solved("lightened_arm").file["motors_alone"]
    angle = group["bodies/forearm/angle"][-1]
    length, root, tip, count = MEASURES["forearm"]
    x = length / (count + 1) * np.arange(1, count + 1)
    height = root + (tip - root) * x / length
    moment = 1.0 * 9.81 * np.cos(angle) * (length - x)
    nominal = moment * height / 2 / (WIDTHS["forearm"] * height**3 * (1 - 0.6**3) / 12)
    found = group["stress/forearm/surface/von_mises_max"][-1]
    assert nominal.max() < found < 2 * nominal.max()
