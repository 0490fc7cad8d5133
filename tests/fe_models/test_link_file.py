"""Wrong link files: one clear error that names file, key, what was expected and what was found."""

import pytest

from ffrobot.common.errors import InputError
from ffrobot.fe_models.link_file import read_link

SEGMENTS = """
[[geometry.segment]]
until = 0.4
section = { shape = "rectangle", height = 0.03, width = 0.025 }
[[geometry.segment]]
until = %s
section = { shape = "circle", diameter = 0.015 }
"""

RECTANGLE = 'section = { shape = "rectangle", height = 0.015, width = 0.025 }'


def test_the_papers_link_reads(link_file):
    link = read_link(link_file())
    assert link.name == "link1"
    assert link.families == ("in-plane-bending",)
    assert link.geometry.breakpoints == [0.0, 1.0]
    assert link.sections[0].height == 0.015


def test_a_stepped_link_reads(link_file):
    link = read_link(link_file(more=SEGMENTS % "1.0", replace={RECTANGLE: ""}))
    assert link.geometry.breakpoints == [0.0, 0.4, 1.0]
    assert [section.height for section in link.sections] == [0.03, 0.015]


def test_poissons_ratio_is_not_needed_for_thin_beams_bending(link_file):
    path = link_file(replace={"poissons_ratio = 0.3\n": ""})
    assert read_link(path).material.poissons_ratio is None


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        ("density = 7850.0", "density = -7850.0", "material.density", "-7850"),
        ("density = 7850.0", 'density = "7850"', "material.density", "7850"),
        ("density = 7850.0", "density = nan", "material.density", "finite"),
        ("density = 7850.0", "", "material.density", "expected"),
        ("density = 7850.0", "densty = 7850.0", "densty", "density"),
        ("length = 1.0", "length = 0.0", "geometry.length", "0.0"),
        ("length = 1.0", "length = -1.0", "geometry.length", "-1.0"),
        ('kind = "beam"', 'kind = "shell"', "geometry.kind", "shell"),
        ('kind = "beam"', "kind = 3", "geometry.kind", "3"),
        ('shape = "rectangle"', 'shape = "rectangel"', "shape", "rectangle"),
        ("height = 0.015", "height = 0", "height", "0"),
        ("elements = 20", "elements = 0", "mesh.elements", "0"),
        ("elements = 20", "elements = 20.5", "mesh.elements", "20.5"),
        ("elements = 20", "", "mesh", "found neither"),
        ("elements = 20", "elements = 20\nnodes = [0.0, 1.0]", "mesh", "found both"),
        ("elements = 20", "nodes = [0.0, 0.5, 0.5, 1.0]", "mesh.nodes", "ascending"),
        ("elements = 20", "nodes = [0.0, 0.5]", "mesh.nodes", "1.0"),
        ("elements = 20", "nodes = [0.0]", "mesh.nodes", "at least 2"),
        ("[mesh]", "[mesch]", "mesch", "mesh"),
        ('condition = "simply-supported"', 'condition = "free"', "reference.condition", "cantilever"),
        ("count = 10", "count = 0", "modes.count", "0"),
        ("count = 10", "count = true", "modes.count", "true"),
        ("count = 10", "", "modes", "found neither"),
        ("count = 10", "indices = [2, 1]", "modes.indices", "ascending"),
        ("count = 10", "indices = [1, 1]", "modes.indices", "ascending"),
        ("count = 10", "indices = [0]", "modes.indices", "0"),
        ("count = 10", "indices = []", "modes.indices", "at least 1"),
        ('"in-plane-bending"', '"inplane"', "modes.family", "in-plane-bending"),
        (RECTANGLE, "", "geometry", "found neither"),
        (RECTANGLE, 'section = { shape = "tube", outer = 0.02, inner = 0.03 }', "geometry.section.inner", "0.02"),
        ("poissons_ratio = 0.3", "poissons_ratio = 0.5", "material.poissons_ratio", "0.5"),
    ],
)
def test_wrong_values(link_file, old, new, key, words):
    path = link_file(replace={old: new})
    with pytest.raises(InputError) as caught:
        read_link(path)
    message = str(caught.value)
    assert str(path) in message
    assert key in message
    assert words in message
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(
    ("more", "key", "words"),
    [
        (SEGMENTS % "1.0", "geometry", "found both"),
        ("[damping]\nratio = -0.1", "damping.ratio", "-0.1"),
        ("[damping]\nratio = [0.1, 0.2]", "damping.ratio", "found 2"),
        ("[damping]\nratio = 0.1\nrayleigh = [1.0, 2.0]", "damping", "found both"),
        ("[damping]\nrayleigh = [1.0]", "damping.rayleigh", "expected"),
        ('[[interface]]\nname = "mid"\nposition = 0.5', "interface.name", "mid"),
        ('[[interface]]\nname = "a.b"\nposition = 0.5', "interface", "a.b"),
        ('[[interface]]\nname = "grip"\nposition = 1.5', "interface.position of grip", "1.5"),
        ('[[interface]]\nname = "a"\nposition = 0.5\n[[interface]]\nname = "a"\nposition = 0.6', "interface.name", "a"),
        ('[model]\ntheory = "reissner"', "model.theory", "timoshenko"),
    ],
)
def test_wrong_additions(link_file, more, key, words):
    path = link_file(more=more)
    with pytest.raises(InputError) as caught:
        read_link(path)
    for part in (str(path), key, words):
        assert part in str(caught.value)


@pytest.mark.parametrize(
    ("until", "words"), [("0.3", "ascending"), ("0.9", "1.0")], ids=["not ascending", "short of the tip"]
)
def test_wrong_segments(link_file, until, words):
    path = link_file(more=SEGMENTS % until, replace={RECTANGLE: ""})
    with pytest.raises(InputError, match=r"geometry\.segment") as caught:
        read_link(path)
    assert words in str(caught.value)


def test_nodes_must_meet_the_steps_of_the_section(link_file):
    path = link_file(more=SEGMENTS % "1.0", replace={RECTANGLE: "", "elements = 20": "nodes = [0.0, 0.5, 1.0]"})
    with pytest.raises(InputError, match=r"mesh\.nodes.*0\.4"):
        read_link(path)


def test_fewer_elements_than_segments(link_file):
    path = link_file(more=SEGMENTS % "1.0", replace={RECTANGLE: "", "elements = 20": "elements = 1"})
    with pytest.raises(InputError, match=r"mesh\.elements.*at least one per segment, 2, found 1"):
        read_link(path)


@pytest.mark.parametrize(("family", "theory"), [("torsion", "euler-bernoulli"), ("in-plane-bending", "timoshenko")])
def test_poissons_ratio_is_needed_for_shear_and_torsion(link_file, family, theory):
    path = link_file(family=family, more=f'[model]\ntheory = "{theory}"', replace={"poissons_ratio = 0.3\n": ""})
    with pytest.raises(InputError, match=r"material\.poissons_ratio"):
        read_link(path)


def test_missing_and_unreadable_files(tmp_path):
    with pytest.raises(InputError, match=r"nowhere\.toml: link file not found"):
        read_link(tmp_path / "nowhere.toml")
    (tmp_path / "broken.toml").write_text("name = ")
    with pytest.raises(InputError, match=r"broken\.toml: not a valid TOML"):
        read_link(tmp_path / "broken.toml")
