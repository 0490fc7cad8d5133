"""A URDF with one attribute or element changed: imported, or refused with a message that names the file."""

import random
from pathlib import Path
from xml.etree import ElementTree

import pytest

from ffrobot import FfrobotError
from ffrobot.exchange.urdf.import_urdf import import_urdf

TEXT = (Path(__file__).parent / "robots" / "z1.urdf").read_text(encoding="utf-8")
VALUES = (
    "", " ", "nan", "inf", "1e400", "-1", "0", "0 0 0", "1 2", "1 2 3 4", "1e-320", "1e300 0 0", "1e31", "-1e29",
    "18446744073709551616", "0x10", "1_0", "-0.0", "x", "é/\n.", "base", "ground", "origin", "fixed", "true",
)  # fmt: skip
CHANGES = 400


def changed(draw):
    """The text of the Z1 with one change, and what it is."""
    root = ElementTree.fromstring(TEXT)
    parents = {child: parent for parent in root.iter() for child in parent}
    element = draw.choice(list(parents))
    kind = draw.choice(("value", "value", "value", "drop", "double", "rename", "attribute"))
    if kind == "value" and element.attrib:
        key = draw.choice(list(element.attrib))
        element.set(key, draw.choice(VALUES))
    elif kind == "drop":
        parents[element].remove(element)
    elif kind == "double":
        parents[element].append(element)
    elif kind == "rename":
        element.tag = draw.choice(("link", "joint", "inertial", "mimic", "limit", "x"))
    elif element.attrib:
        del element.attrib[draw.choice(list(element.attrib))]
    return ElementTree.tostring(root, encoding="unicode"), f"{kind} {element.tag} {element.attrib}"


@pytest.mark.parametrize("seed", range(4))
def test_one_change(seed, tmp_path):
    draw, messages = random.Random(seed), []
    for number in range(CHANGES // 4):
        text, what = changed(draw)
        urdf = tmp_path / "robot.urdf"
        urdf.write_text(text, encoding="utf-8")
        try:
            imported = import_urdf(urdf, tmp_path / str(number), {})
        except FfrobotError as error:
            messages.append((str(error), what))
        else:
            assert imported.scene["body"], what
    assert 0 < len(messages) < CHANGES // 4
    for message, what in messages:
        assert message.startswith(str(urdf)), what
        assert "expected" in message, what
