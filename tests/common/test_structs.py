"""Classes that hold values."""

from dataclasses import field

from ffrobot.common.structs import struct


@struct
class Point:
    x: float
    label: str = field(default="", repr=False)


@struct
class Mark(Point):
    def __repr__(self) -> str:
        return f"mark at {self.x}"


def test_values_are_shown_and_not_compared():
    assert repr(Point(0.5, "tip")) == "Point(x=0.5)"
    assert repr(Mark(0.5)) == "mark at 0.5"
    assert Point(0.5) != Point(0.5)
    assert len({Point(0.5), Point(0.5)}) == 2
