"""`mpirun -n 2 ffrobot link` makes the file that one process makes."""

import subprocess

import h5py
import numpy as np
import pytest
from datasets import datasets
from solids import write_solid


@pytest.fixture
def link_on_two(ffrobot, mpirun):
    return lambda *arguments: subprocess.run(
        [*mpirun, ffrobot.path, "link", *map(str, arguments)],
        env=ffrobot.environment,
        capture_output=True,
        text=True,
        timeout=300,
    )


def arrays(path):
    with h5py.File(path) as file:
        return {name: item[()] for name, item in datasets(file).items() if item.dtype == np.float64}


ALL_THAT_CELLS_ARE_SUMMED_FOR = """
[stress]
surface = true
points = { inside = [0.1, 0.004, 0.006], corner = [0.3, 0.0075, 0.0125] }
[[interface]]
name = "grip"
position = [0.2, 0.0, 0.0125]
normal = [0.0, 0.0, 1.0]
coupling = "mean"
[surface_patch]
centers = [0.075, 0.15]
length = 0.05
width = 0.02
"""


@pytest.mark.parametrize("condition", ["cantilever", pytest.param("simply-supported", marks=pytest.mark.nightly)])
def test_two_processes_make_the_same_file(ffrobot, link_on_two, tmp_path, condition):
    """Also sections, faces, patches and stresses, to which cells of both contribute."""
    link = write_solid(tmp_path, length=0.3, condition=condition, order=2, count=4, more=ALL_THAT_CELLS_ARE_SUMMED_FOR)
    link.write_text(link.read_text().replace("divisions = [36, 1, 1]", "size = 0.03"))
    one, two = tmp_path / "one.h5", tmp_path / "two.h5"
    assert ffrobot("link", link, "-o", one).returncode == 0
    done = link_on_two(link, "-o", two)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("computed in") == 1
    alone, together = arrays(one), arrays(two)
    assert alone.keys() == together.keys()
    for name, array in alone.items():
        # Two processes add in another order. A slender bar's stiffness has a condition number above 1e6, so that shapes
        # agree to some 1e-10; which digit is the last differs from one processor type to the next.
        tolerance = 1e-9 * largest_alike(name, alone)
        np.testing.assert_allclose(together[name], array, rtol=0, atol=tolerance, err_msg=name)


def largest_alike(name, arrays):
    """The largest number among the arrays of the same quantity: what is zero in one is not in others.

    Prestress of bending cancels over each section: what is left of it is exact to the size of what cancelled, which is
    more than the stiffness of the unit forces along the axis.
    """
    first, last = name.split("/")[0], name.split("/")[-1]
    alike = [n for n in arrays if (n.startswith(first) if first == "geometric_stiffness" else n.endswith(last))]
    return max(np.abs(arrays[n]).max(initial=0.0) for n in alike)


def test_first_process_alone_computes_beams(ffrobot, link_on_two, tmp_path):
    link = write_solid(tmp_path)
    text = link.read_text().replace('"solid"', '"beam"').replace('cell = "tetrahedron"\norder = 3\n', "")
    link.write_text(text.replace("divisions = [36, 1, 1]", "elements = 10"))
    done = link_on_two(link, "-o", tmp_path / "beam.h5")
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("computed in") == 1
    assert ffrobot("link", link, "-o", tmp_path / "one.h5").returncode == 0
    assert (tmp_path / "beam.h5").read_bytes() == (tmp_path / "one.h5").read_bytes()


def test_one_error_for_all(link_on_two, tmp_path):
    link = write_solid(tmp_path, cell="hexahedron", order=1, divisions=(4, 1, 1), family="all", count=100)
    done = link_on_two(link)
    assert done.returncode == 2
    assert done.stderr.count("modes.count") == 1
