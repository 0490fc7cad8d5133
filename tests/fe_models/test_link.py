"""Stage 1 as a command: computed once, not again; what is in the way is not lost."""

import signal
import subprocess
import sys

import h5py
import pytest
from solids import write_solid

from ffrobot.common.errors import InputError
from ffrobot.fe_models.link import make_link


def test_up_to_date_links_are_not_computed_again(link_file):
    path = link_file()
    first = make_link(path)
    assert first.computed
    assert first.path == path.with_suffix(".h5")
    assert not make_link(path).computed
    path.write_text("# another comment\n" + path.read_text().replace("length = 1.0", "length = 1"))
    assert not make_link(path).computed
    assert make_link(path, force=True).computed
    path.write_text(path.read_text().replace("count = 10", "count = 9"))
    assert make_link(path).computed
    assert len(make_link(path).body.frequency) == 9


@pytest.mark.parametrize("missing", ["dolfinx", "petsc4py"])
def test_without_the_finite_element_libraries(tmp_path, missing):
    path = write_solid(tmp_path, divisions=(2, 1, 1))
    code = f"""
import sys
from pathlib import Path
from ffrobot.common.errors import SolveError
from ffrobot.fe_models.link import make_link
sys.modules[{missing!r}] = None  # as if not installed
try:
    make_link(Path({str(path)!r}))
except SolveError as error:
    print(error)
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert f"link1.toml: computing this link needs the finite element libraries, and {missing}" in result.stdout


def test_a_run_prints_nothing_and_repeats_bit_for_bit(link_file, tmp_path):
    path = link_file(family="all", count=20)
    make_link(path)
    code = f"""
from pathlib import Path
from ffrobot.fe_models.link import make_link
make_link(Path({str(path)!r}), Path({str(tmp_path / "again.h5")!r}), force=True)
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (result.stdout, result.stderr) == ("", "")
    assert (tmp_path / "again.h5").read_bytes() == path.with_suffix(".h5").read_bytes()


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
    path = link_file()
    thesis = tmp_path / "thesis.h5"
    thesis.write_text("three years of work")
    with pytest.raises(InputError, match=r"thesis\.h5: output: .*another kind"):
        make_link(path, thesis)
    results = tmp_path / "results.h5"
    with h5py.File(results, "w") as file:
        file.attrs["format"] = "something else"
    with pytest.raises(InputError, match=r"results\.h5: output"):
        make_link(path, results)
    with pytest.raises(InputError, match=r"link1\.toml: output"):
        make_link(path, path)
    assert thesis.read_text() == "three years of work"
    with pytest.raises(InputError, match=r"thesis\.h5: output"):
        make_link(path, thesis, force=True)


def test_a_truncated_output_is_made_again(link_file):
    path = link_file()
    output = make_link(path).path
    output.write_bytes(output.read_bytes()[:3000])
    assert make_link(path).computed
    assert not make_link(path).computed
