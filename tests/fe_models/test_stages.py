"""Of stage 1 only that part is done again which depends on what changed; what is in the way, and signals."""

import signal
import subprocess
import sys
from dataclasses import replace

import h5py
import numpy as np
import pytest
from solids import write_solid

from ffrobot.common.checksum import seal
from ffrobot.common.errors import InputError
from ffrobot.common.version import digest_of_code
from ffrobot.fe_models.link import cached_modal_body, make_link, restated
from ffrobot.fe_models.link_file import read_link
from ffrobot.mesh.kept_parts import kept_part, kept_path

FINITE_ELEMENTS = ("dolfinx", "gmsh", "petsc4py", "slepc4py", "mpi4py", "basix", "ufl")

SOLID = """
name = "bar"
material = { youngs_modulus = 70e9, poissons_ratio = 0.33, density = 2700.0 }
geometry = { kind = "solid", length = 0.2, section = { shape = "circle", diameter = 0.02 } }
mesh = { size = 0.02, order = 1 }
reference = { condition = "cantilever" }
modes = { count = 3 }
damping = { ratio = 0.01 }
stress = { points = { top = [0.1, 0.005, 0.0], root = [0.01, 0.0, 0.0] } }
"""


@pytest.fixture
def solid(tmp_path):
    path = tmp_path / "bar.toml"
    path.write_text(SOLID)

    def change(old, new):
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new))
        return path

    return path, change


def told(path):
    """What stage 1 says it does, and the outcome."""
    lines = []
    return lines, make_link(path, progress=lines.append)


@pytest.mark.parametrize(
    "change",
    [
        {"[reference]": "[stress]\npoints = { middle = [0.5, 0.004, 0.0] }\n[reference]"},
        {'"link1"': '"arm"'},
        {"[reference]": "[damping]\nrayleigh = [0.5, 1e-5]\n[reference]"},
    ],
    ids=["stress points", "name", "damping"],
)
def test_what_follows_from_the_modes_needs_no_eigenproblem(link_file, cache, change):
    """Beams: the same numbers as from scratch, without any finite element library."""
    make_link(link_file())
    path = link_file(replace=change)
    code = f"""
import sys
from pathlib import Path
from ffrobot.fe_models.link import make_link
outcome = make_link(Path({str(path)!r}))
print(outcome.computed, outcome.reused, [m for m in {FINITE_ELEMENTS} if m in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "True modes []\n"
    quick = path.with_suffix(".h5").read_bytes()
    assert not make_link(path).computed
    assert make_link(path, force=True).reused == ""
    assert path.with_suffix(".h5").read_bytes() == quick


@pytest.mark.parametrize(
    "change",
    [{"count = 10": "count = 11"}, {'"simply-supported"': '"cantilever"'}, {"length = 1.0": "length = 1.0000000001"}],
    ids=["count", "reference", "length"],
)
def test_modes_are_made_again_where_they_change(link_file, cache, change):
    first = make_link(link_file())
    again = make_link(link_file(replace=change))
    assert (again.computed, again.reused) == (True, "")
    assert again.body.modes_hash != first.body.modes_hash


def test_the_cache_gives_modes_to_every_link_that_has_the_same(link_file, cache):
    cached_modal_body(link_file())
    other = cached_modal_body(link_file(name="link2"))
    assert (other.computed, other.reused, other.body.name) == (True, "modes", "link2")
    assert not cached_modal_body(link_file(name="link2")).computed
    assert other.path.is_relative_to(cache / "ffrobot")
    other.path.write_bytes(b"damaged")
    assert cached_modal_body(link_file(name="link2")).computed
    made = make_link(link_file(name="link2"))  # an up-to-date file beside the link comes first
    assert cached_modal_body(link_file(name="link2")).path == made.path
    made.path.write_bytes(b"damaged")
    assert cached_modal_body(link_file(name="link2")).path == other.path
    assert made.path.read_bytes() == b"damaged"


def test_files_without_the_hash_of_their_modes_are_still_read(link_file, cache):
    path = link_file()
    made = make_link(path).path
    with h5py.File(made, "r+") as file:
        del file.attrs["modes_hash"]
    seal(made)
    assert not make_link(path).computed
    assert make_link(link_file(replace={'"link1"': '"arm"'}), path.with_suffix(".h5")).reused == ""


def test_what_another_state_of_the_program_made_is_not_up_to_date(link_file, cache, tmp_path, monkeypatch):
    """Modes of links in mm were once read from the cache that the program, since mended, had made too few of."""
    code = tmp_path / "code" / "beam"
    code.mkdir(parents=True)
    (code / "beam.py").write_text("TOLERANCE = 1e-10\n")
    before = digest_of_code(code.parent)
    (code / "beam.py").write_text("TOLERANCE = 1e-9\n")
    digest_of_code.cache_clear()
    assert digest_of_code(code.parent) != before

    cached_modal_body(link_file())
    assert not cached_modal_body(link_file()).computed
    monkeypatch.setattr("ffrobot.fe_models.link.digest_of_code", lambda _: before)
    again = cached_modal_body(link_file())
    assert (again.computed, again.reused) == (True, "")


def test_solids_keep_their_mesh_and_their_modes(solid, cache):
    path, change = solid
    lines, first = told(path)
    assert "meshing" in lines
    assert first.reused == ""
    for old, new in (("count = 3", "count = 4"), ('"cantilever"', '"simply-supported"')):
        lines, outcome = told(change(old, new))
        assert "meshing" not in lines
        assert "bar: solving for the modes" in lines
        assert outcome.reused == "mesh"
    before = outcome.body
    lines, outcome = told(change("root = [", "low = ["))
    assert lines == []
    assert outcome.reused == "modes"
    np.testing.assert_array_equal(outcome.body.stress["low"].stress, before.stress["root"].stress)
    assert outcome.body.stress_loads == before.stress_loads
    plain = {name: replace(point, static=None) for name, point in before.stress.items()}
    assert restated(replace(before, stress=plain, stress_loads=()), read_link(path)) is None  # of an earlier version
    lines, outcome = told(change("0.1, 0.005", "0.11, 0.005"))  # the stress there is not known
    assert "bar: solving for the modes" in lines
    lines, outcome = told(change("size = 0.02", "size = 0.021"))
    assert "meshing" in lines
    lines = []
    assert make_link(path, force=True, progress=lines.append).reused == ""
    assert "meshing" in lines


@pytest.mark.nightly
def test_a_kept_mesh_gives_the_same_modal_body_and_a_damaged_one_is_made_again(solid, cache):
    path, change = solid
    make_link(path)
    link = read_link(change("count = 3", "count = 2"))
    kept = kept_path(link.part(path))
    assert kept_part(kept).faces.keys() >= {"root", "tip"}
    quick = told(path)[1].path.read_bytes()
    kept.write_bytes(kept.read_bytes()[:999])
    assert kept_part(kept) is None
    path.with_suffix(".h5").unlink()
    lines, outcome = told(path)
    assert "meshing" in lines
    assert kept_part(kept) is not None
    assert outcome.path.read_bytes() == quick


def test_signals_end_the_process_as_ever(tmp_path):
    """PETSc installs handlers that print pages and exit with its own code, unless told not to."""
    path = write_solid(tmp_path, divisions=(2, 1, 1), family="all", count=1)
    code = f"""
import os, signal
from pathlib import Path
from ffrobot.fe_models.link import make_link
make_link(Path({str(path)!r}), force=True)
os.kill(os.getpid(), signal.SIGTERM)
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert result.returncode == -signal.SIGTERM
    assert result.stderr == ""


def test_another_file_in_the_way_is_kept(link_file, tmp_path):
    """Of another kind than those of tests/cli/test_inputs_kept.py."""
    with h5py.File(tmp_path / "results.h5", "w") as file:
        file.attrs["format"] = "something else"
    with pytest.raises(InputError, match=r"results\.h5: output"):
        make_link(link_file(), tmp_path / "results.h5")


def test_a_truncated_output_is_made_again(link_file):
    path = link_file()
    output = make_link(path).path
    output.write_bytes(output.read_bytes()[:3000])
    assert make_link(path).computed
    assert not make_link(path).computed
