"""What a scene does not need is not computed, not imported, not stored, and the summary says so."""

import subprocess
import sys
from io import BytesIO

import h5py
import pytest
import tomli_w
from beam_links import link_keys, rectangle
from tables_3d import pin, planar

from ffrobot import make_scene
from ffrobot.fe_models.link import make_link
from ffrobot.results.write import results_image
from ffrobot.run.solve import prepare_scene, solve_scene

STICK = {"mass": 0.4, "inertia": 0.01, "center": [0.25, 0.0], "points": {"root": [0.0, 0.0], "tip": [0.5, 0.0]}}
FAR = ("dolfinx", "gmsh", "petsc4py", "slepc4py", "mpi4py", "basix", "ufl", "matplotlib", "plotly", "pandas", "sphinx")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Beams with modes in all directions and with bending alone, and a solid."""
    folder = tmp_path_factory.mktemp("links")
    beam, solid = {"elements": 12}, {"cell": "hexahedron", "order": 1, "divisions": [12, 2, 2]}
    for name, kind, mesh, family, count in (
        ("all", "beam", beam, "all", 14),
        ("bending", "beam", beam, "in-plane-bending", 8),
        ("solid", "solid", solid, "in-plane-bending", 8),
    ):
        modes = {"count": count, "family": family, "attachment_modes": False}
        keys = link_keys(kind, 0.5, rectangle(0.01, 0.014), mesh, nu=0.3, name=name, modes=modes)
        path = folder / f"{name}.toml"
        path.write_text(tomli_w.dumps(keys))
        make_link(path)
    return folder


def arm(folder, link, **keys):
    """A rigid stick, and a link at its end whose tip goes from rest to rest."""
    path = {"name": "path", "point": "arm.tip", "x": "0.7-0.1*(10*t**3-15*t**4+6*t**5)", "y": "0.5"}
    tables = planar(
        [{"name": "stick", "rigid": STICK}, {"name": "arm", "link": f"{link}.toml"}],
        [pin("O", "ground", "stick.root"), pin("A", "stick.tip", "arm.root")],
        {"name": "run", "kind": "pcid", "end": 0.1, "output_step": 0.01, "tolerance": 1e-4},
        initial={"state": "static", "angles": {"stick": 0.1, "arm": 1.2}},
        trajectory=[path],
    )
    return make_scene(folder=folder, **tables | keys)


def test_planar_scenes_have_no_coordinates_out_of_their_plane(folder):
    """Two joints and the modes that move in the plane; the others are named."""
    solution = solve_scene(arm(folder, "all"))
    families = solution.bodies["arm"].modal.family
    in_plane = sum(family in ("in-plane-bending", "axial") for family in families)
    assert families.count("in-plane-bending") < in_plane < len(families) == 14
    assert solution.outcomes["run"].q.shape[1] == 2 + in_plane
    line = next(line for line in solution.omissions if "without in-plane motion" in line)
    assert line.startswith(f"arm: {14 - in_plane} of 14 modes")
    assert f"{families.count('out-of-plane-bending')} out-of-plane-bending" in line
    assert "out-of-plane motion" in solution.omissions
    assert not any("axial deformation" in line for line in solution.omissions)  # it has axial modes
    with h5py.File(BytesIO(results_image(solution))) as file:
        assert file["run/bodies/arm/modal"].shape == (11, in_plane)
        assert file["run/bodies/arm/modal_transform"].shape == (14, in_plane)


def test_terms_that_vanish_are_named(folder):
    """Bending alone has S̃ = 0 and j = 0, axial modes beside it have not."""
    bending, both = (prepare_scene(arm(folder, link)).omissions for link in ("bending", "all"))
    for symbol in ("inertia between rotation and pairs of modes", "change of inertia to first order in deflections"):
        assert f"{symbol}, which is zero" in bending
        assert f"{symbol}, which is zero" not in both
    assert "damping, which is zero" in bending


def test_no_analysis_loads_finite_elements_or_plotting(folder):
    """Every kind, links given as .toml and up to date, results written."""
    analyses = [
        {"name": "rest", "kind": "static"},
        {"name": "stiff", "kind": "fcid", "shape": "static", "end": 0.02, "output_step": 0.01},
        {"name": "run", "kind": "pcid", "end": 0.02, "output_step": 0.01, "tolerance": 1e-3},
        {"name": "back", "kind": "forward", "actuation": "run", "apply": "joints"},
    ]
    body = [{"name": "stick", "rigid": STICK}, {"name": "arm", "link": "solid.toml", "modes": "auto"}]
    (folder / "scene.toml").write_text(arm(folder, "solid", body=body, analysis=analyses).text)
    code = f"""
import sys
sys.argv = ["ffrobot", "solve", {str(folder / "scene.toml")!r}, "--verbose"]
from ffrobot.cli import main
main()
print("loaded", [name for name in {FAR} if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "loaded []"
    assert "arm: stage 1, up to date" in " ".join(done.stdout.split())


def test_another_layout_of_patches_needs_nothing_of_stage_1(folder):
    """The file is read as it is: neither computed nor written."""
    patches = {"body": "arm", "length": 0.02, "width": 0.01, "thickness": 1e-3, "modulus": 63e9, "d31": 1.1e-10}
    before = (folder / "bending.h5").stat().st_mtime_ns
    for count in (9, 12):
        solution = prepare_scene(arm(folder, "bending", pzt=[patches | {"count": count}]))
        assert not solution.bodies["arm"].computed
        assert solution.bodies["arm"].path == folder / "bending.h5"
    assert (folder / "bending.h5").stat().st_mtime_ns == before
