"""What `ffrobot smooth` prints: the stream, its faults, a table of joints, and what it is in words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rich.console import Console

from ..present.lines import print_table
from .diagnosis import Diagnosis
from .smoothing import Smoothed

MOTIONS = ("motion", "duration (s)", "settled (s)", "vibration (mm)", "off the path (rad)", "of a limit")
COLUMNS = ("joint", "from", "to", "speed", "acceleration", "jerk", "vibration by it alone (mm)")


def print_smooth(found: Smoothed, console: Console) -> None:
    """Lines on the motion as it is, faults, a table of joints, the verdict."""
    before, servo = found.before, found.robot.servo
    bandwidth = " ".join(dict.fromkeys(f"{omega / (2 * np.pi):.3g}" for omega in servo.omega))
    lines = [
        ("motion", f"{len(before.recording.times)} set points of {len(before.recording.joints)} joints over"
         f" {before.recording.times[-1]:.4g} s, every {1e3 * before.recording.step:.3g} ms"),
        ("servo", f"{bandwidth} Hz, damping ratio {servo.ratio:.3g}"),
        *(("frequency", f"{of.min():.3g} to {of.max():.3g} Hz along the motion") for of in before.frequencies.T),
        *(("note", remark) for remark in before.recording.remarks),
        *(("fault", f"{fault.kind}: {fault.text}") for fault in before.faults),
        ("settling", settling_in_words(before)),
    ]  # fmt: skip
    for name, text in lines:
        console.print(f"{name:<10} {text}", soft_wrap=True, markup=False)
    print_table(console, COLUMNS, _rows(before))
    console.print(f"verdict    {found.verdict}", soft_wrap=True, markup=False)
    if found.candidates:
        console.print()
        print_table(console, MOTIONS, _motions(found))


def settling_in_words(of: Diagnosis) -> str:
    """How far the point swings, and when it stays within the tolerance."""
    settling = of.ride.settling
    if settling is None:
        return "no place of rest"
    limit, whole = 1e3 * settling.tolerance, of.ride.times[-1] - settling.path_end
    until = f"never within {whole:.2g} s" if np.isnan(settling.time_to) else f"{settling.time_to:.3g} s"
    return (
        f"within {limit:.3g} mm: {until} after the last set point; residual vibration {1e3 * of.residual:.3g} mm peak"
        " to peak"
    )


def _motions(found: Smoothed) -> Iterator[tuple[str, ...]]:
    """The record, and candidates from the best to the worst."""
    before = found.before
    last, settling = float(before.recording.times[-1]), before.ride.settling
    assert settling is not None
    yield "as it is", f"{last:.4g}", _time(last + settling.time_to), f"{1e3 * before.residual:.3g}", "0", ""
    for one in found.candidates:
        limit = f"{100 * one.excess:.3g} %" if one.excess else ""
        numbers = (f"{1e3 * one.residual:.3g}", f"{one.off_path:.2g}", limit)
        yield one.name, f"{one.times[-1]:.4g}", _time(one.settled), *numbers


def _time(value: float) -> str:
    return f"{value:.4g}" if np.isfinite(value) else "no"


def _rows(of: Diagnosis) -> Iterator[tuple[str, ...]]:
    values = of.recording.values
    for k, joint in enumerate(of.recording.joints):
        numbers = (values[0, k], values[-1, k], *of.peaks[:, k], 1e3 * of.alone[k])
        yield joint, *(f"{number:.3g}" for number in numbers)
