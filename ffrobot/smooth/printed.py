"""What `ffrobot smooth` prints, and its page: the stream, its faults, a table of joints, and what it is in words."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

import numpy as np
from rich.console import Console

from ..common.files import write_atomically
from ..pictures.report.page import Table, page_of
from ..present.lines import print_table
from ..results.verdict import Settled
from .diagnosis import Diagnosis
from .drawn import picture
from .smoothing import Smoothed

MOTIONS = ("motion", "duration (s)", "settled (s)", "vibration (mm)")
STUBBORN = "controllers have zeros that decay too slowly for inversion"
COLUMNS = ("joint", "from", "to", "speed", "acceleration", "jerk", "at most, by it alone (mm)", "share")


def print_smooth(found: Smoothed, console: Console) -> None:
    """Lines on the motion as it is, faults, a table of joints, the verdict."""
    for name, text in _lines(found):
        console.print(f"{name:<10} {text}", soft_wrap=True, markup=False)
    joints, *motions = _tables(found)
    print_table(console, *joints)
    console.print(f"verdict    {found.verdict}", soft_wrap=True, markup=False)
    for table in motions:
        console.print()
        print_table(console, *table)


def write_page(found: Smoothed, motion: Path | None, path: Path) -> None:
    """One HTML file: the verdict, faults, tables, the picture."""
    used = [found.robot.file, *([motion] if motion else [])]
    part = {
        "title": f"{found.robot.file.name}: {motion.name if motion else 'trajectories of the scene'}",
        "mood": "bad" if found.before.residual > found.robot.tolerance else "good",
        "study": {
            "headline": found.verdict,
            "facts": [f"{name}: {text}" for name, text in sorted(_lines(found), key=lambda line: line[0] != "fault")],
            "tables": _tables(found),
        },
        "pictures": [("the motion before and after", b64encode(picture(found, "svg")).decode())],
    }
    origins = [(str(file), sha256(file.read_bytes()).hexdigest() if file.is_file() else "") for file in used]
    content = {
        "title": "Residual vibration", "heading": "Vibration", "solved": False, "charts": "{}", "studies": [part],
        "origins": Table(("file", "SHA-256"), origins),
        "scenes": [(used[0].name, used[0].read_text(encoding="utf-8"))],
    }  # fmt: skip
    write_atomically(path, page_of(content).encode(), "report")


def _tables(found: Smoothed) -> list[Table]:
    """Of joints, and of motions where there are new ones."""
    joints = Table(COLUMNS, list(_rows(found.before)))
    columns = (*MOTIONS, f"off the path ({found.robot.units()})", "of a limit", "torque")
    return [joints, *([Table(columns, list(_motions(found)))] if found.candidates else [])]


def _lines(found: Smoothed) -> list[tuple[str, str]]:
    before, joints = found.before, len(found.before.recording.joints)
    words = [axis.words for axis in found.robot.servo.axes]
    each = [f"{joint}: {of}" for joint, of in zip(found.robot.joints, words, strict=True)]
    return [
        ("motion", f"{len(before.recording.times)} set points of {joints} joint{'s' * (joints > 1)} over"
         f" {before.recording.times[-1]:.4g} s, every {1e3 * before.recording.step:.3g} ms"),
        *(("servo", of) for of in (each if len(set(words)) > 1 else words[:1])),
        *(("frequency", f"{of.min():.3g} to {of.max():.3g} Hz along the motion") for of in before.frequencies.T),
        *(("note", remark) for remark in before.recording.remarks),
        *(("fault", f"{fault.kind}: {fault.text}") for fault in before.faults),
        *([("settling", _settling(found))] if before.frequencies.size else []),
        *([] if found.robot.servo.is_invertible else [("note", STUBBORN)]),
    ]  # fmt: skip


def _settling(found: Smoothed) -> str:
    if (of := found.before.ride.settling) is None:
        return "no place of rest"
    return Settled(found.robot.point, found.before.residual, of.frequency, of.time_to, of.tolerance).in_words


def _motions(found: Smoothed) -> Iterator[tuple[str, ...]]:
    """The record, and candidates from the best to the worst."""
    before = found.before
    last, settling = float(before.recording.times[-1]), before.ride.settling
    assert settling is not None
    yield (
        "as it is",
        f"{last:.4g}",
        _time(last + settling.time_to),
        f"{1e3 * before.residual:.3g}",
        "0",
        _part(found.excess),
        _part(found.torque),
    )
    for one in found.candidates:
        numbers = (f"{1e3 * one.residual:.3g}", f"{one.off_path:.2g}", _part(one.excess), _part(one.torque))
        yield one.name, f"{one.times[-1]:.4g}", _time(one.settled), *numbers


def _part(of_limit: float) -> str:
    return f"{100 * of_limit:.3g} %" if of_limit else ""


def _time(value: float) -> str:
    return f"{value:.4g}" if np.isfinite(value) else "no"


def _rows(of: Diagnosis) -> Iterator[tuple[str, ...]]:
    values = of.recording.values
    for k, joint in enumerate(of.recording.joints):
        numbers = (values[0, k], values[-1, k], *of.peaks[:, k], 1e3 * of.alone[k])
        yield joint, *(f"{number:.3g}" for number in numbers), f"{100 * of.shares[k]:.0f} %"
