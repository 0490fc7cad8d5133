"""Modal body files: what is written is read again, what is damaged is refused, what fails leaves nothing behind."""

import subprocess
import sys
from dataclasses import replace

import h5py
import numpy as np
import pytest

from ffrobot.common.checksum import seal
from ffrobot.common.errors import InputError
from ffrobot.fe_models.link import make_link
from ffrobot.fe_models.modal_body import OutlinedPatches, StressPoint
from ffrobot.fe_models.modal_body_file import read_modal_body, write_modal_body
from ffrobot.present.info import describe


@pytest.fixture
def outcome(link_file):
    return make_link(link_file(family="all", count=12, more='[[interface]]\nname = "grip"\nposition = 0.3\n'))


def test_round_trip_is_exact(outcome):
    read = read_modal_body(outcome.path)

    def compare(left, right):
        if isinstance(left, np.ndarray):
            np.testing.assert_array_equal(left, right)
        elif hasattr(left, "items"):
            assert set(left) == set(right)
            for name in left:
                compare(left[name], right[name])
        elif hasattr(left, "__dataclass_fields__"):
            compare(vars(left), vars(right))
        else:
            assert left == right

    compare(outcome.body, read)
    assert isinstance(read.mass, float)
    assert set(read.interfaces) == {"root", "tip", "grip"}
    assert "force/grip/x" in read.geometric_stiffness


def test_what_only_some_bodies_have(outcome, tmp_path):
    n, p = 12, len(outcome.body.mesh.points)
    rng = np.random.default_rng(0)
    points = {name: StressPoint(*(rng.normal(size=shape) for shape in ((3,), (6, n), (6, n)))) for name in ("a", "b")}
    patches = OutlinedPatches(np.array([[0.1, 0.2], [0.4, 0.5]]), 0.02, bottom=rng.normal(size=(2, n)))
    surface = rng.normal(size=(p, 6, n))
    body = replace(outcome.body, stress=points, surface_stress=surface, surface_patches=patches)
    path = tmp_path / "full.h5"
    write_modal_body(path, body)
    read = read_modal_body(path)
    assert set(read.stress) == {"a", "b"}
    np.testing.assert_array_equal(read.stress["b"].strain, points["b"].strain)
    np.testing.assert_array_equal(read.surface_stress, surface)
    np.testing.assert_array_equal(read.surface_patches.edges, patches.edges)
    np.testing.assert_array_equal(read.surface_patches.bottom, patches.bottom)
    assert (read.stress_loads, read.surface_static, read.stress["a"].static) == ((), None, None)
    assert read.surface_patches.top is None
    assert read.surface_patches.width == 0.02
    told = describe(path)
    assert f"modal stresses on the surface, at {p} points" in told
    assert "patches outlined in the mesh, bottom, 0.02 m wide: 0.1 … 0.2, 0.4 … 0.5 m" in told
    plain = read_modal_body(outcome.path)
    assert (plain.stress, plain.surface_stress, plain.surface_patches) == ({}, None, None)


def test_static_stresses_of_unit_loads(outcome, tmp_path):
    n, p, rng = 12, len(outcome.body.mesh.points), np.random.default_rng(1)
    loads = ("t_y", "force/grip/x", "moment/tip/z")
    point = StressPoint(*(rng.normal(size=shape) for shape in ((3,), (6, n), (6, n), (6, 3))))
    surface = {"surface_stress": rng.normal(size=(p, 6, n)), "surface_static": rng.normal(size=(p, 6, 3))}
    write_modal_body(tmp_path / "full.h5", replace(outcome.body, stress={"a": point}, stress_loads=loads, **surface))
    read = read_modal_body(tmp_path / "full.h5")
    assert read.stress_loads == loads
    np.testing.assert_array_equal(read.stress["a"].static, point.static)
    np.testing.assert_array_equal(read.surface_static, surface["surface_static"])
    assert f"modal and static stresses on the surface, at {p} points" in describe(tmp_path / "full.h5")
    with pytest.raises(InputError, match=r"stress/loads: expected unit loads of the link and its interfaces, found x"):
        replace(outcome.body, stress_loads=("x",))
    with pytest.raises(InputError, match=r"stress/points/a/static: expected shape \(6, 2\)"):
        replace(outcome.body, stress={"a": point}, stress_loads=loads[:2])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"stress": {"a": StressPoint(np.zeros(3), np.zeros((6, 11)), np.zeros((6, 12)))}}, "stress/points/a/stress"),
        ({"surface_stress": np.zeros((3, 6, 12))}, r"stress/surface: expected shape \(61, 6, 12\)"),
        ({"surface_patches": OutlinedPatches(np.zeros((2, 2)), 0.02, np.zeros((1, 12)))}, "surface_patches/top"),
        ({"surface_stress": np.full((61, 6, 12), np.nan)}, "stress/surface: expected finite numbers"),
    ],
)
def test_shapes_of_what_only_some_bodies_have(link_file, changes, message):
    body = make_link(link_file(family="all", count=12)).body
    with pytest.raises(InputError, match=message):
        replace(body, **changes)


def test_datasets_of_the_interface(outcome):
    n = 12
    with h5py.File(outcome.path) as file:
        assert file.attrs["format"] == "ffrobot-modal-body"
        for name in ("format_version", "name", "kind", "reference_condition", "ffrobot_version", "input_hash"):
            assert name in file.attrs
        shapes = {
            "mass": (),
            "first_moment": (3,),
            "second_moment": (3, 3),
            "modes/frequency": (n,),
            "modes/stiffness": (n, n),
            "modes/mass": (n, n),
            "modes/damping_ratio": (n,),
            "modes/family": (n,),
            "invariants/S_bar": (3, n),
            "invariants/I_bar": (3, 3, n),
            "invariants/S_bar_kl": (3, 3, n, n),
            "invariants/J_spin": (),
            "invariants/h_spin": (n,),
            "invariants/S_spin": (n, n),
            "geometric_stiffness/omega_zz": (n, n),
            "interfaces/tip/position": (3,),
            "interfaces/tip/translation": (3, n),
            "interfaces/tip/rotation": (3, n),
        }
        k = file["stations/position"].shape[0]
        shapes |= {"stations/translation": (k, 3, n), "stations/rotation": (k, 3, n), "stations/height": (k,)}
        for name, shape in shapes.items():
            assert file[name].shape == shape, name


def test_files_of_earlier_versions_have_no_spin_inertia(outcome):
    with h5py.File(outcome.path, "r+") as file:
        for name in ("J_spin", "h_spin", "S_spin"):
            del file[f"invariants/{name}"]
    seal(outcome.path)
    read = read_modal_body(outcome.path)
    assert read.J_spin is None
    assert read.h_spin is None
    assert read.S_spin is None


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"h_spin": None}, "h_spin: expected together with J_spin, S_spin, found none"),
        ({"J_spin": -1.0}, "J_spin: expected a number not below 0, found -1"),
        ({"J_spin": 0.0}, "S_spin, less h_spin.* expected no negative eigenvalue"),
        ({"h_spin": np.ones(12)}, "S_spin, less h_spin.* expected no negative eigenvalue"),
        ({"S_spin": 2 * np.eye(12)}, r"S_bar_kl\[2, 2\], less S_spin: expected no negative eigenvalue"),
        ({"S_spin": np.triu(np.ones((12, 12)))}, "S_spin: expected symmetric"),
    ],
)
def test_spin_inertia_that_cannot_be_is_refused(outcome, changes, message):
    with pytest.raises(InputError, match=message):
        replace(outcome.body, **changes)


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match=r"nothing\.h5: modal body file not found"):
        read_modal_body(tmp_path / "nothing.h5")


@pytest.mark.parametrize("kept", [0, 7, 100, 5000, -1])
def test_truncated_file(outcome, kept):
    outcome.path.write_bytes(outcome.path.read_bytes()[:kept])
    with pytest.raises(InputError, match=r"link1\.h5: (not a modal body file, or a )?damaged"):
        read_modal_body(outcome.path)


def test_foreign_files(tmp_path):
    text = tmp_path / "text.h5"
    text.write_text("not HDF5 at all")
    with pytest.raises(InputError, match=r"text\.h5: not a modal body file"):
        read_modal_body(text)
    other = tmp_path / "other.h5"
    with h5py.File(other, "w") as file:
        file["mass"] = 1.0
    with pytest.raises(InputError, match=r'other\.h5: expected format "ffrobot-modal-body", found'):
        read_modal_body(other)


def test_newer_version(outcome):
    with h5py.File(outcome.path, "a") as file:
        file.attrs["format_version"] = 99
    seal(outcome.path)
    with pytest.raises(InputError, match=r"newer ffrobot.*format_version: expected at most 1, found 99"):
        read_modal_body(outcome.path)


@pytest.mark.parametrize(
    "name", ["invariants/S_bar", "modes/frequency", "stations/rotation", "interfaces/tip/position"]
)
def test_nan_is_refused(outcome, name):
    with h5py.File(outcome.path, "a") as file:
        values = file[name][()]
        values.flat[0] = np.nan
        file[name][...] = values
    seal(outcome.path)
    with pytest.raises(InputError, match=rf"link1\.h5: .*{name.split('/')[-1]}: expected finite numbers"):
        read_modal_body(outcome.path)


@pytest.mark.parametrize(
    "name", ["mass", "modes/family", "stations", "interfaces/root", "mesh/cells", "invariants/I_bar"]
)
def test_missing_dataset(outcome, name):
    with h5py.File(outcome.path, "a") as file:
        del file[name]
    seal(outcome.path)
    with pytest.raises(InputError, match=r"link1\.h5: "):
        read_modal_body(outcome.path)


@pytest.mark.parametrize("value", ["text", np.ones(3), np.ones((7, 7))])
def test_wrong_dataset(outcome, value):
    with h5py.File(outcome.path, "a") as file:
        del file["modes/stiffness"]
        file["modes/stiffness"] = value
    seal(outcome.path)
    with pytest.raises(InputError, match=r"link1\.h5: "):
        read_modal_body(outcome.path)


def test_reading_needs_no_finite_elements(outcome):
    code = f"""
import sys
from pathlib import Path
from ffrobot.fe_models.modal_body_file import read_modal_body
read_modal_body(Path({str(outcome.path)!r}))
print([m for m in ("dolfinx", "gmsh", "petsc4py", "mpi4py", "scipy", "pydantic") if m in sys.modules])
"""
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
