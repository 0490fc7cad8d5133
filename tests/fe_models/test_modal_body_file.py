"""Modal body files: what is written is read again, what is damaged is refused, files of earlier versions are read."""

from dataclasses import replace

import h5py
import numpy as np
import pytest

from ffrobot.common.checksum import seal
from ffrobot.common.errors import InputError
from ffrobot.fe_models.link import make_link
from ffrobot.fe_models.modal_body import OutlinedPatches, StressPoint
from ffrobot.fe_models.modal_body_file import keep_modal_body, read_modal_body, write_modal_body
from ffrobot.present.info import describe

N = 12
LOADS = ("t_y", "force/grip/x", "moment/tip/z")


@pytest.fixture
def outcome(link_file):
    """With attachment modes."""
    more = '[[interface]]\nname = "grip"\nposition = 0.3\n'
    return make_link(link_file(family="all", count=N, more=more))


def same(left, right):
    if isinstance(left, np.ndarray):
        np.testing.assert_array_equal(left, right)
    elif hasattr(left, "items"):
        assert set(left) == set(right)
        for name in left:
            same(left[name], right[name])
    elif hasattr(left, "__dataclass_fields__"):
        same(vars(left), vars(right))
    else:
        assert left == right


def full(body, static=True):
    """With what only some bodies have: stress points, stresses of the surface, outlined patches, static stresses."""
    rng, p = np.random.default_rng(0), len(body.mesh.points)
    shapes = [(3,), (6, N), (6, N), *([(6, len(LOADS))] if static else [])]
    added = {"stress": {name: StressPoint(*(rng.normal(size=shape) for shape in shapes)) for name in ("a", "b")}}
    added["surface_stress"] = rng.normal(size=(p, 6, N))
    edges = np.array([[0.1, 0.2], [0.4, 0.5]])
    added["surface_patches"] = OutlinedPatches(edges, 0.02, bottom=rng.normal(size=(2, N)))
    if static:
        added |= {"stress_loads": LOADS, "surface_static": rng.normal(size=(p, 6, len(LOADS)))}
    return replace(body, **added)


def test_round_trip_is_exact(outcome, tmp_path):
    same(outcome.body, read_modal_body(outcome.path))
    assert set(outcome.body.interfaces) == {"root", "tip", "grip"}
    assert "force/grip/x" in outcome.body.geometric_stiffness
    for static in (True, False):
        body = full(outcome.body, static)
        write_modal_body(tmp_path / "full.h5", body)
        same(body, read_modal_body(tmp_path / "full.h5"))
        told = describe(tmp_path / "full.h5")
        kind = "modal and static" if static else "modal"
        assert f"{kind} stresses on the surface, at {len(body.mesh.points)} points" in told
        assert "patches outlined in the mesh, bottom, 0.02 m wide: 0.1 … 0.2, 0.4 … 0.5 m" in told


POINT = StressPoint(np.zeros(3), np.zeros((6, 11)), np.zeros((6, N)))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"stress": {"a": POINT}}, "stress/points/a/stress"),
        (
            {"stress_loads": ("x", *LOADS[1:])},
            "stress/loads: expected unit loads of the link and its interfaces, found x",
        ),
        (
            {"stress_loads": LOADS[:2], "surface_stress": None, "surface_static": None},
            r"stress/points/a/static: expected shape \(6, 2\)",
        ),
        ({"surface_stress": np.zeros((3, 6, N))}, r"stress/surface: expected shape \(\d+, 6, 12\)"),
        ({"surface_stress": np.full((61, 6, N), np.nan)}, "stress/surface: expected finite numbers"),
        ({"surface_patches": OutlinedPatches(np.zeros((2, 2)), 0.02, np.zeros((1, N)))}, "surface_patches/top"),
        ({"h_spin": None}, "h_spin: expected together with J_spin, S_spin, found none"),
        ({"J_spin": -1.0}, "J_spin: expected a number not below 0, found -1"),
        ({"J_spin": 0.0}, "S_spin, less h_spin.* expected no negative eigenvalue"),
        ({"h_spin": np.ones(N)}, "S_spin, less h_spin.* expected no negative eigenvalue"),
        ({"S_spin": 2 * np.eye(N)}, r"S_bar_kl\[k, k\], less S_bar and S_spin: expected no negative eigenvalue"),
        ({"S_spin": np.triu(np.ones((N, N)))}, "S_spin: expected symmetric"),
    ],
)
def test_what_cannot_be_is_refused(outcome, changes, message):
    with pytest.raises(InputError, match=message):
        replace(full(outcome.body), **changes)


def edited(path, edit):
    with h5py.File(path, "a") as file:
        edit(file)
    seal(path)


def test_files_of_earlier_versions(link_file):
    """Without spin inertia and marks of attachment modes."""
    outcome = make_link(link_file(replace={"attachment_modes = false\n": ""}))
    assert read_modal_body(outcome.path).residual.tolist() == [0] * 10 + [1] * 2

    def older(file):
        for name in ("invariants/J_spin", "invariants/h_spin", "invariants/S_spin", "modes/residual"):
            del file[name]

    edited(outcome.path, older)
    read = read_modal_body(outcome.path)
    assert read.J_spin is read.h_spin is read.S_spin is None
    assert not read.residual.any()


def test_other_files(outcome, tmp_path):
    with pytest.raises(InputError, match=r"nothing\.h5: modal body file not found"):
        read_modal_body(tmp_path / "nothing.h5")
    text, other = tmp_path / "text.h5", tmp_path / "other.h5"
    text.write_text("not HDF5 at all")
    with pytest.raises(InputError, match=r"text\.h5: not a modal body file"):
        read_modal_body(text)
    with h5py.File(other, "w") as file:
        file["mass"] = 1.0
    with pytest.raises(InputError, match=r'other\.h5: expected format "ffrobot-modal-body", found'):
        read_modal_body(other)
    edited(outcome.path, lambda file: file.attrs.__setitem__("format_version", 99))
    with pytest.raises(InputError, match=r"newer ffrobot.*format_version: expected at most 1, found 99"):
        read_modal_body(outcome.path)


def not_a_number(values):
    values.flat[0] = np.nan
    return values


@pytest.mark.parametrize(
    ("name", "change"),
    [
        *((name, not_a_number) for name in ("invariants/S_bar", "modes/frequency", "interfaces/tip/position")),
        *((name, None) for name in ("mass", "modes/family", "stations", "interfaces/root", "mesh/cells")),
        *(("modes/stiffness", lambda _, value=value: value) for value in ("text", np.ones(3), np.ones((7, 7)))),
    ],
)
def test_wrong_and_missing_datasets(outcome, name, change):
    def edit(file):
        new = change and change(file[name][()])
        del file[name]
        if change:
            file[name] = new

    edited(outcome.path, edit)
    said = rf".*{name.split('/')[-1]}: expected finite numbers" if change is not_a_number else ""
    with pytest.raises(InputError, match=rf"link1\.h5: {said}"):
        read_modal_body(outcome.path)


def test_a_body_is_kept_until_its_file_changes(outcome, tmp_path):
    path = tmp_path / "kept.h5"
    write_modal_body(path, outcome.body)
    assert read_modal_body(path) is not read_modal_body(path)
    keep_modal_body(path)
    assert read_modal_body(path) is read_modal_body(path)
    write_modal_body(path, replace(outcome.body, mass=2.0 * outcome.body.mass))
    assert read_modal_body(path).mass == 2.0 * outcome.body.mass
    path.unlink()
    with pytest.raises(InputError, match="not found"):
        read_modal_body(path)
