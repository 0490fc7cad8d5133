"""What it takes to import the package and to ask the program for help.

Bounds are the aims of the project on a quiet machine; where the machine is busy the bare interpreter is slow as well.
"""

import re
import statistics
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ffrobot.scene.kinds import KINDS

HEAVY = ("numpy", "scipy", "h5py", "pydantic", "rich", "dolfinx", "matplotlib", "plotly")
IMPORT_AIM, HELP_AIM = 0.05, 0.2  # s


def seconds(*command, runs=5):
    """Median time of a command."""
    taken = []
    for _ in range(runs):
        began = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        taken.append(time.perf_counter() - began)
    return statistics.median(taken)


def busy():
    """How much slower than on a quiet machine (0.03 s) the interpreter starts."""
    return max(1.0, seconds(sys.executable, "-c", "pass") / 0.03)


def loaded(program):
    done = subprocess.run([sys.executable, "-c", f"import sys\n{program}\nprint(*sys.modules)"],
                          capture_output=True, text=True, check=True)  # fmt: skip
    return set(done.stdout.split())


@pytest.mark.alone
def test_import_takes_a_few_milliseconds():
    def cost():
        done = subprocess.run([sys.executable, "-X", "importtime", "-c", "import ffrobot"],
                              capture_output=True, text=True, check=True)  # fmt: skip
        return float(re.search(r"\|\s*(\d+) \| ffrobot$", done.stderr, flags=re.MULTILINE)[1]) * 1e-6

    assert statistics.median(cost() for _ in range(5)) < IMPORT_AIM * busy()


def test_import_loads_nothing_heavy():
    assert not loaded("import ffrobot") & set(HEAVY)


@pytest.mark.alone
def test_help_comes_at_once(ffrobot):
    assert seconds(ffrobot.path, "--help") < HELP_AIM * busy()


def test_help_loads_nothing_heavy():
    assert not loaded("import ffrobot.cli") & set(HEAVY)


RIGID = """
name = "arm"
space = "spatial"
gravity = [0.0, 0.0, -9.81]
joint = [{ name = "s", type = "revolute", between = ["ground", "arm.root"], axis = [0.0, 1.0, 0.0] }]
analysis = [{ name = "driven", kind = "forward", end = 0.01, output_step = 0.005, tolerance = 1e-6 }]
[[body]]
name = "arm"
rigid = { mass = 1.0, center = [0.1, 0.0, 0.0], inertia = [0.01, 0.01, 0.01], points = { root = [0.0, 0.0, 0.0] } }
"""


def test_a_solve_loads_what_its_scene_needs(ffrobot, tmp_path):
    """Records of the kinds that it has, and nothing that draws, prints tables or comes with SciPy."""
    scene = tmp_path / "scene.toml"
    scene.write_text(RIGID)
    found = loaded(f"sys.argv = ['ffrobot', 'solve', {str(scene)!r}]\nfrom ffrobot.cli import main\nmain()")
    assert "ffrobot.mbs.analysis.forward" in found
    kinds = {place.partition(":")[0] for place in KINDS.modules.values()}
    assert kinds & found == {"ffrobot.mbs.analysis.forward"}
    assert not {"rich", "scipy", "matplotlib", "ffrobot.present.details"} & found
    of_others = ("actuation.patches.link_patches", "actuation.feasibility", "actuation.control.linear_model",
                 "mbs.inversion.stable_inversion", "mesh.part_mesh")  # fmt: skip
    assert not {f"ffrobot.{module}" for module in of_others} & found
    results = scene.with_suffix(".results.h5")
    shown = loaded(f"sys.argv = ['ffrobot', 'info', {str(results)!r}]\nfrom ffrobot.cli import main\nmain()")
    assert not {"pydantic", "ffrobot.mbs._core"} & shown


def test_a_link_loads_nothing_of_scenes(tmp_path):
    link = Path(__file__).parents[1] / "cases" / "two_link" / "link1.toml"
    argv = ["ffrobot", "link", str(link), "-o", str(tmp_path / "link1.h5")]
    found = loaded(f"sys.argv = {argv}\nfrom ffrobot.cli import main\nmain()")
    assert "ffrobot.fe_models.remarks" in found
    assert not [name for name in found if name.startswith(("ffrobot.mbs", "ffrobot.scene", "ffrobot.actuation"))]


def test_warnings_stay_warnings_where_links_are_computed():
    """FFCx of Debian hands all to the log, where nobody who records warnings finds them."""
    lines = ("import warnings", "shown = warnings.showwarning", "import ffrobot.mesh.compat")
    assert "dolfinx" in loaded("\n".join([*lines, "assert warnings.showwarning is shown"]))
