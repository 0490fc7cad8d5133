"""What results files have of a single kind of analysis: how it is written, and what the verdict says of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from ..common.structs import struct
from .actuators import write_placement, write_tracking
from .linear import write_joint_conditions, write_linear, write_loop, write_zero_dynamics
from .verdict import millimeters

if TYPE_CHECKING:
    from ..mbs.run.record import Run

About = Mapping[str, Any]


def _nothing(*_: object) -> str:
    return ""


@struct
class OwnResults:
    """Results of one kind of analysis alone. Functions of `About` get the attributes of the group `part`.

    Attributes:
        part: name of that group in the group of the analysis; empty without one.
        is_controlled: whether a controller keeps it on its path.
        write: writes the details of a run to the group of its analysis.
        answer: answer in words, in place of whether motors and patches can do it.
        least: text after "motors and patches can do it", from the group of the analysis.
        margins: gain and delay margins in words.
        advice: what to try next, by whether it is known what motors and patches can do.
    """

    part: str = ""
    is_controlled: bool = False
    write: Callable[[h5py.Group, Run, Any], object] = _nothing
    answer: Callable[[About], str] = _nothing
    least: Callable[[h5py.Group], str] = _nothing
    margins: Callable[[About], str] = _nothing
    advice: Callable[[About, bool], Iterable[str]] = _nothing

    def about(self, group: h5py.Group) -> About:
        """Attributes of `part` of an analysis; none where it has no such part."""
        return group[self.part].attrs if self.part in group else {}


def _least_voltage(group: h5py.Group) -> str:
    about = group["tracking"].attrs
    off = about.get("without_patches", np.nan)
    alone = f"; torques alone are off by {1e3 * off:.3g} mm" if np.isfinite(off) else ""
    limits = [np.ravel(one.attrs["limit"]) for one in group["pzt"].values() if "limit" in one.attrs]
    is_one = not limits or np.ptp(np.concatenate(limits)) == 0.0
    is_one &= not any("range" in one.attrs for one in group["pzt"].values())
    size = f"{about['least_voltage']:.3g} V" if is_one else f"{100 * about['least_share']:.3g} % of limits"
    if np.isfinite(price := about.get("tolerance_price", np.nan)):
        less = f" with path_tolerance, {1e-3 * price:.3g} V less per mm of it"
        size += less if about["least_voltage"] else ": torques alone stay within path_tolerance"
    return f"; least voltage {size}{alone}"


def _needless_patches(about: About, is_judged: bool) -> Iterator[str]:
    if is_judged and not about.get("is_needed", True):
        of = "path_tolerance" if about.get("path_tolerance") else "the tolerance, relative to its length"
        yield f"patches are not needed: torques alone stay on the path within {of}"


def _first_gains(about: About, is_judged: bool) -> Iterator[str]:
    if text := about.get("advice", ""):
        yield str(text)


def _loop_verdict(about: About) -> str:
    at_limits = f", {100 * about['saturated']:.3g} % of the samples saturated" if about["saturated"] else ""
    most, rms = (millimeters(about[f"tip_error_{key}"]) for key in ("max", "rms"))
    is_settled = about["verdict"] == "stable" and np.isfinite(about["settling_time"])
    alone = "" if "spectral_radius" in about else ", by the run alone"
    verdict = "settled" if is_settled else about["verdict"]
    return f"loop {verdict}{alone}: tip off by {most} at most, {rms} RMS{at_limits}"


def _loop_margins(about: About) -> str:
    if "gain_margin" not in about:
        return ""
    if about["delay_margin"] == 0.0:
        return f"margins (linear model): none, spectral radius of the sampled loop {about['spectral_radius']:.6g}"
    gain, delay = float(about["gain_margin"]), float(about["delay_margin"])
    if np.isnan(gain):
        return "margins (linear model): not computed for a delay of so many samples"
    texts = (
        f"gains may grow {gain:.3g}-fold" if np.isfinite(gain) else "gains may grow freely",
        f"the delay by {1e3 * delay:.3g} ms" if np.isfinite(delay) else "the delay by 50 sample times or more",
    )
    return f"margins (linear model): {', '.join(texts)}"


def _loop_advice(about: About, is_judged: bool) -> Iterator[str]:
    yield from map(str, texts := about.get("advice", ()))
    if not len(texts) and about["verdict"] not in ("stable", "not settled"):
        yield "smaller gains, a shorter sample_time, or rotor_inertia in the joints"


OF_KIND: Mapping[str, OwnResults] = {
    "static": OwnResults(write=write_joint_conditions),
    "linear": OwnResults("linear", write=write_linear, advice=_first_gains),
    "placement": OwnResults(write=write_placement),
    "motors-only": OwnResults(write=write_zero_dynamics),
    "tracking": OwnResults("tracking", write=write_tracking, least=_least_voltage, advice=_needless_patches),
    "closed-loop": OwnResults(
        "control",
        is_controlled=True,
        write=write_loop,
        answer=_loop_verdict,
        margins=_loop_margins,
        advice=_loop_advice,
    ),
}
"""Results of single kinds; those that are not here have none of their own."""


def own_results(group: h5py.Group) -> OwnResults:
    """The results of its kind alone, of the group of an analysis."""
    return OF_KIND.get(str(group.attrs["kind"]), OwnResults())
