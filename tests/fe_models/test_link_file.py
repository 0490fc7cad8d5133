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
NU = "poissons_ratio = 0.3\n"


def test_a_stepped_link_reads(link_file):
    link = read_link(link_file(more=SEGMENTS % "1.0", replace={RECTANGLE: "", NU: ""}))
    assert link.geometry.breakpoints == [0.0, 0.4, 1.0]
    assert [section.height for section in link.sections] == [0.03, 0.015]
    assert link.material.poissons_ratio is None  # thin beams that bend need none


SOLID = {'kind = "beam"': 'kind = "solid"', "elements = 20": ""}
HOLE = "[[geometry.hole]]\ndiameter = 0.02\nposition = "


# Words of the message, and what is replaced in the link or added to it. Types, ranges and unknown keys of any record:
# tests/test_validation.py.
WRONG = [
    ("material.density | expected", {"density = 7850.0": ""}, ""),
    ("geometry.length | 0.0", {"length = 1.0": "length = 0.0"}, ""),
    ("geometry.kind | shell", {'kind = "beam"': 'kind = "shell"'}, ""),
    ("mesh.elements | 20.5", {"elements = 20": "elements = 20.5"}, ""),
    ("mesh | found neither", {"elements = 20": ""}, ""),
    ("mesh | found both", {"elements = 20": "elements = 20\nnodes = [0.0, 1.0]"}, ""),
    ("mesh.nodes | ascending", {"elements = 20": "nodes = [0.0, 0.5, 0.5, 1.0]"}, ""),
    ("mesh.nodes | 1.0", {"elements = 20": "nodes = [0.0, 0.5]"}, ""),
    ("mesch | mesh", {"[mesh]": "[mesch]"}, ""),
    ("reference.condition | cantilever", {'condition = "simply-supported"': 'condition = "free"'}, ""),
    ("modes | found neither", {"count = 10": ""}, ""),
    ("modes.indices | ascending", {"count = 10": "indices = [2, 1]"}, ""),
    ("modes.indices | 0", {"count = 10": "indices = [0]"}, ""),
    ("modes.indices | at least 1", {"count = 10": "indices = []"}, ""),
    ("modes.family | in-plane-bending", {'"in-plane-bending"': '"inplane"'}, ""),
    ("geometry | found neither", {RECTANGLE: ""}, ""),
    ("section.inner | 0.02", {RECTANGLE: 'section = { shape = "tube", outer = 0.02, inner = 0.03 }'}, ""),
    ("poissons_ratio | 0.5", {"poissons_ratio = 0.3": "poissons_ratio = 0.5"}, ""),
    ("material.poissons_ratio | torsion", {NU: "", '"in-plane-bending"': '"torsion"'}, ""),
    ("material.poissons_ratio | expected", {NU: ""}, '[model]\ntheory = "timoshenko"'),
    ("geometry | found both", {}, SEGMENTS % "1.0"),
    ("geometry.segment | ascending", {RECTANGLE: ""}, SEGMENTS % "0.3"),
    ("geometry.segment | 1.0", {RECTANGLE: ""}, SEGMENTS % "0.9"),
    ("mesh.nodes | 0.4", {RECTANGLE: "", "elements = 20": "nodes = [0.0, 0.5, 1.0]"}, SEGMENTS % "1.0"),
    (
        "mesh.elements | per segment, 2, found 1",
        {RECTANGLE: "", "elements = 20": "elements = 1"},
        SEGMENTS % "1.0",
    ),
    ("damping.ratio | found 2", {}, "[damping]\nratio = [0.1, 0.2]"),
    ("damping | found both", {}, "[damping]\nratio = 0.1\nrayleigh = [1.0, 2.0]"),
    ("interface.name | mid", {}, '[[interface]]\nname = "mid"\nposition = 0.5'),
    ("interface | a.b", {}, '[[interface]]\nname = "a.b"\nposition = 0.5'),
    ("interface.position of grip | 1.5", {}, '[[interface]]\nname = "grip"\nposition = 1.5'),
    ("interface.name | besides a, mid, found a", {}, '[[interface]]\nname = "a"\nposition = 0.5\n' * 2),
    ("geometry.hole.position: expected holes within the length, 0 … 1 m, found 0.985 … 1.005", SOLID, HOLE + "0.995"),
    ("geometry.hole.diameter: expected holes within ±0.0075 m of the axis, found -0.01 … 0.01", SOLID, HOLE + "0.5"),
    ("stress.surface: expected points, not a surface, on a beam, found true", {}, "[stress]\nsurface = true\n"),
    ("poissons_ratio: expected a value, for strains", {NU: ""}, "[stress]\npoints = { a = [0.5, 0.0, 0.0] }\n"),
]


@pytest.mark.parametrize(("words", "replaced", "more"), WRONG, ids=[case[0] for case in WRONG])
def test_mistakes_are_told(link_file, words, replaced, more):
    path = link_file(replace=replaced, more=more)
    with pytest.raises(InputError) as caught:
        read_link(path)
    for part in (str(path), *words.split(" | ")):
        assert part in str(caught.value)
