"""Wrong input: one message that names file, key, expected and found; exit code 2; nothing written, nothing lost."""

import h5py
import pytest
import tomli_w
from beam_links import beam_link, tube
from mistakes import MISTAKES, PAGE, row, without_folder


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistake_in_a_file(two_link_copy, refused, mistake):
    file, edits, named = MISTAKES[mistake]
    folder = two_link_copy({file: edits})
    with h5py.File(folder / "scene.results.h5", "w") as earlier:  # must survive
        earlier.attrs["format"] = "ffrobot-results"
        earlier["kept"] = 1.0
    message = refused(folder, "solve", "scene.toml")
    for text in named:
        assert text in message
    said = without_folder(message.removeprefix("ffrobot: "), folder)
    assert row(mistake, said) in PAGE.read_text(encoding="utf-8")  # mistakes.py writes it


@pytest.mark.parametrize("link", ["link1.toml", "link2.toml"])
def test_mistake_in_a_link_of_its_own(two_link_copy, refused, link):
    folder = two_link_copy({link: {"youngs_modulus = 2.068427e11": 'youngs_modulus = "steel"'}})
    assert f'{link}: material.youngs_modulus: expected a number, found "steel"' in refused(folder, "link", link)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("solve", "nowhere.toml"), "nowhere.toml: scene file not found"),
        (("solve", "."), ": cannot read the scene file: Is a directory"),
        (("solve", "folder"), "folder: cannot read the scene file: Is a directory"),
        (("solve", "latin1.toml"), "latin1.toml: line 1: expected a scene file in UTF-8, found the byte 0xfc"),
        (("link", "nowhere.toml"), "nowhere.toml: link file not found"),
        (("info", "nowhere.h5"), "nowhere.h5: expected a modal body file or a results file, found no such file"),
        (("info", "folder"), "folder: expected a modal body file or a results file, found a folder"),
        (("info", "scene.toml"), "scene.toml: expected a modal body file or a results file, found not"),
        (("info", "other.h5"), "other.h5: expected a modal body file or a results file, found format None"),
        (("plot", "nowhere.h5"), "nowhere.h5: expected a results file, found no such file"),
        (("plot", "scene.toml"), "scene.toml: expected a results file, found a scene or link file: solve it first"),
        (("plot", "other.h5"), "other.h5: expected a results file"),
        (("report", "other.h5"), "other.h5: expected a results file"),
        (("report", "other.h5", "-o", "scene.toml"), 'scene.toml: output: expected a name that ends in ".html"'),
    ],
)
def test_files_that_are_not_what_they_should_be(two_link_copy, refused, arguments, named):
    folder = two_link_copy()
    (folder / "folder").mkdir()
    (folder / "latin1.toml").write_bytes('name = "Gelenk für zwei"'.encode("latin-1"))
    with h5py.File(folder / "other.h5", "w") as file:
        file["temperature"] = [1.0, 2.0]
    message = refused(folder, *arguments)
    assert named in message
    assert len(message.splitlines()) == 1


@pytest.mark.parametrize(
    "arguments", [("solve",), ("sovle", "scene.toml"), ("solve", "scene.toml", "--no-such-option")]
)
def test_wrong_command_line(ffrobot, tmp_path, arguments):
    done = ffrobot(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert "Usage: ffrobot" in done.stderr
    assert "Traceback" not in done.stderr


FITTED = beam_link(0.6, tube(0.02, 0.016), 10, nu=None, name="arm", modes={"count": 4, "family": "in-plane-bending"})


@pytest.mark.parametrize(
    ("measured", "key", "options", "message"),
    [
        ("nowhere.csv", "material.density", (), "nowhere.csv: table of measured"),
        ("modes.csv", "material.dnsity", (), "arm.toml: --vary: expected a number at material.dnsity, found none (did"),
        ("modes.csv", "name", (), "a number at name, found 'arm'"),
        ("modes.csv", "material.density", ("--motors", "locked"), "--motors: expected a scene file"),
        ("many.csv", "material.density", (), "line 2: expected modes that the model has (4 of them), found mode 9"),
        ("modes.csv", "material.density", ("-o", "arm.toml"), "output: expected another file than the input"),
        ("modes.csv", "material.density", ("-o", "sub/a.toml"), "output: expected a file next to arm.toml"),
        ("half.csv", "material.density", (), "uncertainty: expected it of all frequencies or of none, found 1"),
    ],
)
def test_wrong_input_of_fit(tmp_path, refused, measured, key, options, message):
    (tmp_path / "arm.toml").write_text(tomli_w.dumps(FITTED))
    (tmp_path / "modes.csv").write_text("mode,frequency\n1,49\n2,307\n")
    (tmp_path / "many.csv").write_text("mode,frequency\n9,1e4\n")
    (tmp_path / "half.csv").write_text("mode,frequency,uncertainty\n1,49,0.1\n2,307,\n")
    assert message in refused(tmp_path, "fit", "arm.toml", "--measured", measured, "--vary", key, *options)
