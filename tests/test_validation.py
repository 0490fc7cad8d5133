"""Input files: what a wrong key is told."""

from pathlib import Path
from typing import Annotated, Literal

import pytest
from pydantic import Field

from ffrobot.common.errors import InputError, did_you_mean
from ffrobot.common.toml_files import load_toml
from ffrobot.common.validation import InputFile, Record, validate


class Circle(Record):
    shape: Literal["circle"]
    diameter: Annotated[float, Field(gt=0)]


class Rectangle(Record):
    shape: Literal["rectangle"]
    height: float
    width: float


class Part(Record):
    name: str
    section: Annotated[Circle | Rectangle, Field(discriminator="shape")] | None = None
    ratio: float | tuple[float, ...] = 0.0
    position: tuple[float, float] = (0.0, 0.0)
    mesh: InputFile | None = None
    count: int = 1


class Drawing(Record):
    title: str
    part: tuple[Part, ...] = ()


FILE = "drawing.toml"


def read(folder, text):
    path = folder / FILE
    path.write_text(text)
    return validate(Drawing, load_toml(path, "drawing"), path)


def message(folder, text):
    with pytest.raises(InputError) as caught:
        read(folder, text)
    assert caught.value.exit_code == 2
    return str(caught.value).replace(str(folder / FILE), FILE).splitlines()


def test_lists_and_paths_are_read_strictly(tmp_path):
    (tmp_path / "a.msh").touch()
    text = 'title = "d"\n[[part]]\nname = "p"\nposition = [1, 2.5]\nratio = [0.1]\nmesh = "a.msh"\n'
    part = read(tmp_path, text).part[0]
    assert part.position == (1.0, 2.5)
    assert part.ratio == (0.1,)
    assert part.mesh == tmp_path / "a.msh"


PART = 'title = "d"\n[[part]]\nname = "p"\n'


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "title: expected a value, since this key is required, found none"),
        (PART + "count = 1.5", 'part "p": count: expected a whole number, found 1.5'),
        (PART + 'ratio = "x"', 'part "p": ratio: expected a number or a list, found "x"'),
        (PART + "position = [1, 2, 3]", 'part "p": position: expected at most 2 entries, found [1, 2, 3]'),
        (PART + "position = []", 'part "p": position: expected a list of 2 entries, found []'),
        (PART + 'position = [1, "2"]', 'part "p": position[1]: expected a number, found "2"'),
        ('title = "d"\npart = 3', "part: expected a list, found 3"),
        ('title = "d"\n[[part]]\n', "part no. 1: name: expected a value, since this key is required, found none"),
        (PART + "section = { shape = 'circle', diameter = -1.0 }",
         'part "p": section.diameter: expected a number greater than 0, found -1.0'),
        (PART + "section = { shape = 'circle', diametre = 1.0, diameter = 1.0 }",
         'part "p": section.diametre: expected one of the keys shape, diameter, found an unknown key'
         ' (did you mean "diameter"?)'),
        (PART + "section = { shape = 'circel' }",
         'part "p": section.shape: expected "circle" or "rectangle", found "circel" (did you mean "circle"?)'),
        (PART + "section = { diameter = 1.0 }",
         'part "p": section.shape: expected a value, since this key is required, found none'),
        (PART + "widht = 1\n", 'part "p": widht: expected one of the keys name, section, ratio, position, mesh, count,'
         " found an unknown key"),
    ],
)  # fmt: skip
def test_one_line_names_key_expected_and_found(tmp_path, text, expected):
    assert message(tmp_path, text) == [f"{FILE}: {expected}"]


def test_every_wrong_key_is_listed(tmp_path):
    assert len(message(tmp_path, PART + "count = 1.5\nposition = 0\ncolour = 1\n")) == 3


def test_missing_file_is_named_with_the_closest(tmp_path):
    (tmp_path / "wheel.msh").touch()
    (line,) = message(tmp_path, PART + 'mesh = "whel.msh"')
    assert f'{FILE}: part "p": mesh: expected an existing file, found "whel.msh"' in line
    assert 'did you mean "wheel.msh"' in line


def test_unreadable_toml(tmp_path):
    with pytest.raises(InputError, match="drawing not found"):
        load_toml(Path(tmp_path / "none.toml"), "drawing")
    with pytest.raises(InputError, match="cannot read the drawing"):
        load_toml(tmp_path, "drawing")
    (tmp_path / FILE).write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="line 1: expected a drawing in UTF-8, found the byte 0xff"):
        load_toml(tmp_path / FILE, "drawing")
    (tmp_path / FILE).write_text("a = \n")
    with pytest.raises(InputError, match=r"not a valid TOML drawing.*line 1"):
        load_toml(tmp_path / FILE, "drawing")


def test_beginning_of_a_key_is_enough_for_a_suggestion():
    known = ["name", "gear_ratio", "rotor_inertia"]
    assert did_you_mean("gear", known) == ' (did you mean "gear_ratio"?)'
    assert did_you_mean("gear_ratoi", known) == ' (did you mean "gear_ratio"?)'
    assert did_you_mean("ger", known) == did_you_mean("spring", known) == ""


@pytest.mark.parametrize(
    ("word", "meant"),
    [("inverse", "pcid"), ("inverse_dynamics", "pcid"), ("simulation", "forward"), ("modal", "linear"),
     ("Control", "closed-loop"), ("trackin", "tracking")],
)  # fmt: skip
def test_kinds_of_analysis_by_the_names_of_other_programs(word, meant):
    from ffrobot.scene.kinds import KINDS

    assert did_you_mean(word, KINDS.modules) == f' (did you mean "{meant}"?)'


def test_least_torque_is_spelled_as_redundancy_has_it():
    from ffrobot.mbs.tracking.tracking import Tracking

    keys = {"name": "a", "kind": "tracking", "end": 1.0, "output_step": 0.1}
    for objective in ("least-torque", "least-moment"):
        assert validate(Tracking, keys | {"objective": objective}, Path("scene.toml")).objective == objective
