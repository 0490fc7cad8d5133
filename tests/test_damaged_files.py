"""Damaged and doctored files: one message each, never other numbers; older files without a checksum are still read."""

import random
import shutil

import h5py
import numpy as np
import pytest

import ffrobot
from ffrobot.common import checksum
from ffrobot.common.errors import InputError
from ffrobot.common.hdf5 import blaming, reading
from ffrobot.fe_models.modal_body_file import read_modal_body
from ffrobot.present.info import describe
from ffrobot.results.file import Results
from ffrobot.results.kinds import read_motors, read_unsupplied


@pytest.fixture
def modal(two_link, tmp_path):
    with Results(two_link.folder / "scene.results.h5") as results:
        return shutil.copy(results.modal_files["link1"].path, tmp_path / "link1.h5")


@pytest.fixture
def results(two_link, tmp_path):
    return shutil.copy(two_link.folder / "scene.results.h5", tmp_path / "r.h5")


def damaged(content, kind, chance):
    """One or four bits flipped, 64 bytes zero, all zero from some byte on, or cut off there."""
    content = bytearray(content)
    if kind == "truncated":
        return bytes(content[: chance.randrange(len(content) - 1)])
    if kind == "zeros":
        first = chance.randrange(len(content) - 64)
        content[first : first + 64] = bytes(64)
    if kind == "lost end":  # as after a loss of power
        last = int(len(content) ** chance.random())
        content[-last:] = bytes(last)
    for _ in range({"bit": 1, "bits": 4}.get(kind, 0)):
        content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
    return bytes(content)


@pytest.mark.parametrize("kind", ["bit", "bits", "zeros", "lost end", "truncated"])
@pytest.mark.parametrize("file", ["modal", "results"])
def test_random_damage(request, file, kind):
    path = request.getfixturevalue(file)
    content, chance = path.read_bytes(), random.Random(f"{file} {kind}")
    for _ in range(40):
        path.write_bytes(changed := damaged(content, kind, chance))
        if changed != content:
            with pytest.raises(InputError, match=rf"{path.name}: "):
                read_modal_body(path) if file == "modal" else Results(path)


def test_changes_by_other_programs_are_noticed(modal):
    with h5py.File(modal, "r+") as file:
        file["interfaces/tip/rotation"][...] *= 2
    with pytest.raises(InputError, match="damaged file: its content is not what its checksum was made of"):
        read_modal_body(modal)
    checksum.seal(modal)
    with pytest.raises(InputError, match="interfaces/tip/rotation: expected what stations say"):
        read_modal_body(modal)


def test_files_without_checksums_are_read(modal):
    expected = read_modal_body(modal)
    with h5py.File(modal, "r+") as file:
        del file.attrs[checksum.MARK]
    assert checksum.state(modal) == "none"
    np.testing.assert_array_equal(read_modal_body(modal).S_bar, expected.S_bar)


VIRTUAL = h5py.VirtualLayout(shape=(3, 3), dtype="f8")
VIRTUAL[:] = h5py.VirtualSource("elsewhere.h5", "x", shape=(3, 3))


@pytest.mark.parametrize(
    ("name", "item", "named"),
    [
        ("mass", h5py.ExternalLink("elsewhere.h5", "mass"), "found a link at mass"),
        ("mass", h5py.SoftLink("/length"), "found a link at mass"),
        ("second_moment", VIRTUAL, "found a virtual or external dataset"),
        ("second_moment", {"shape": (3, 3), "dtype": "f8", "external": [("elsewhere", 0, 72)]}, "or external dataset"),
        ("mesh/points", {"shape": (10**7, 10**6), "dtype": "f8"}, "expected 8e"),
        ("second_moment", -np.eye(3), "second_moment, as inertia about the center of mass: expected no"),
        ("invariants/S_bar", np.full((3, 10), 9.0), "modal_mass, less S_bar and I_bar: expected no negative"),
        ("invariants/I_bar", np.arange(90.0).reshape(3, 3, 10), "modal_mass, less S_bar and I_bar: expected no"),
    ],
)
def test_doctored_modal_bodies(modal, name, item, named):
    with h5py.File(modal, "r+") as file:
        del file[name]
        if isinstance(item, dict):
            file.create_dataset(name, **item)
        elif item is VIRTUAL:
            file.create_virtual_dataset(name, item)
        else:
            file[name] = item
    checksum.seal(modal)
    with pytest.raises(InputError, match=named):
        read_modal_body(modal)


SCENE = """
name = "arm"
gravity = [0.0, -9.81]
body = [{ name = "arm", rigid = { mass = 1.0, inertia = 0.1, center = [0.5, 0.0], points = { root = [0.0, 0.0] } } }]
joint = [{ name = "shoulder", type = "revolute", between = ["ground", "arm.root"] }]
trajectory = [{ name = "turn", joint = "shoulder", value = "sin(9*t)" }]
analysis = [
    { name = "inverse", kind = "pcid", end = 1.0, output_step = 0.01, tolerance = 1e-9, max_steps = 4 },
    { name = "forward", kind = "forward", actuation = "inverse", apply = "joints" },
]
"""


def test_a_changed_file_is_not_resumed(tmp_path):
    """The core takes the numbers of a file that ffrobot has written as they are."""
    scene, path = tmp_path / "scene.toml", tmp_path / "r.h5"
    scene.write_text(SCENE, encoding="utf-8")
    with pytest.raises(ffrobot.SolveError, match="too many steps"):
        ffrobot.solve(scene, path)
    with h5py.File(path, "r+") as file:
        file["inverse/resume/q"][:] = 0.0
    checksum.seal(path)
    with pytest.raises(ffrobot.InputError, match=r"r\.h5: resume: .* found that the file itself has changed"):
        ffrobot.solve(scene, path, resume=True)


@pytest.fixture(scope="module")
def members(two_link):
    """Every dataset, group and attribute of a results file: kind, name, attribute."""
    found = [("attribute", "/", name) for name in two_link.file.attrs if name != checksum.MARK]

    def collect(name, item):
        found.append(("member", name, ""))
        found.extend(("attribute", name, key) for key in item.attrs)

    two_link.file.visititems(collect)
    return found


def spoil(path, member, chance):
    """One member gone, of another type or shape, or not a number; the file sealed as one changed on purpose."""
    kind, name, key = member
    how = chance.choice(["gone", "text", "other"])
    with h5py.File(path, "r+") as file:
        if kind == "attribute":
            del file[name].attrs[key]
            if how != "gone":
                file[name].attrs[key] = "text" if how == "text" else float("nan")
        else:
            values = None if isinstance(file[name], h5py.Group) else file[name][()]
            del file[name]
            if values is not None and how != "gone":
                file[name] = "text" if how == "text" else np.zeros(2)
    checksum.seal(path)
    return f"{member}, {how}"


@pytest.mark.parametrize("command", ["info", "linear", "report"])
def test_results_that_lack_something(results, members, tmp_path, command):
    """Changed on purpose, sealed again: a message, or all is well."""

    def linear(path):
        with Results(path) as opened:
            opened.export_linear(None, tmp_path / "model.npz")

    run = {
        "info": describe,
        "linear": linear,
        "report": lambda path: ffrobot.write_report(path, tmp_path / "page.html"),
    }[command]
    content, chance, refused = results.read_bytes(), random.Random(command), 0
    for member in chance.sample(members, 2 if command == "report" else 40):
        results.write_bytes(content)
        label = spoil(results, member, chance)
        try:
            with reading(results):
                run(results)
        except InputError as error:
            message = str(error)
        else:
            message = ""
        refused += bool(message)
        assert not message or message.startswith(f"{results}"), label
    assert refused or command != "linear"


@pytest.mark.parametrize("of", ["motor", "unsupplied", "layers"])
def test_records_that_lack_a_field(tmp_path, of):
    """Each that is read from results: a message with what is missing, and no program fault."""
    path, nothing = tmp_path / "r.h5", np.zeros((1, 1))
    with h5py.File(path, "w") as file:
        file.update({"joints/A": nothing, "unsupplied": nothing})
        file.attrs["scene"] = ""
        file.update({"a/bodies/arm/modal": nothing, "a/stress/arm/modal": nothing, "a/stress/arm/loads": nothing})
        file["a/stress/arm/loads"].attrs["columns"] = ["force/tip/x"]
        file["a/stress/arm"].attrs["method"] = "static"
        file.create_group("a/stress/arm/layers")
        file.flush()
        results = Results.from_image(file.id.get_file_image(), path)
        read, lacking = {
            "motor": (lambda: read_motors(file, ["A"]), 'attribute "moment"'),
            "unsupplied": (lambda: read_unsupplied(file), 'attribute "bodies"'),
            "layers": (lambda: results.stress_recovery("a", "arm"), 'dataset or group "edges"'),
        }[of]
        expected = rf"r\.h5: damaged file, .*: expected the {lacking}, found none"
        with pytest.raises(InputError, match=expected), blaming(path):
            read()
