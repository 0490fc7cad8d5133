"""The integrators of the core, and which one a scene asks for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import _core
from .analysis_records import Analysis
from .initial_state import State
from .model import Array, Assembly
from .vibration import ringing, vibrations

METHODS = {
    "dopri5": _core.MethodKind.dopri5,
    "dop853": _core.MethodKind.dop853,
    "radau": _core.MethodKind.radau,
    "generalized-alpha": _core.MethodKind.generalized_alpha,
}

# What the rule is made of, measured on the two-link case (26 coordinates; tests/benchmarks): step size times frequency
# at which DOP853 is stable, and at which both resolve a vibration to a tolerance of 1e-4; time of a step of Radau IIA
# in steps of DOP853; part of the tolerance below which a vibration need not be resolved.
STABLE = 4.2
RESOLVED_DOP853, RESOLVED_RADAU = 1.25, 0.34
COST_OF_RADAU = 1.9
NEGLIGIBLE = 0.1

MOST_COORDINATES = 600  # beyond them the eigenproblem takes longer than many a run
MANY_PERIODS = 1e5


@dataclass(frozen=True)
class Choice:
    """An integrator by its name in scenes, and why it was chosen."""

    name: str
    reason: str


NOT_INTEGRATED = Choice("none", "nothing to integrate")


def choose_integrator(assembly: Assembly, analysis: Analysis, start: State, source: Choice | None = None) -> Choice:
    """The integrator for an analysis from `start`; `source` is that of the analysis whose actuation is replayed.

    Explicit steps are held by the highest frequency whether it is excited or not, implicit ones by the highest that
    rings above the tolerance. The rule estimates the number of steps of both; a wrong guess costs time, not accuracy.
    """
    if analysis.integrator != "auto":
        return Choice(analysis.integrator, "asked for")
    if len(analysis.times) == 1:
        return Choice("dop853", "nothing to integrate")
    if assembly.model.gears:
        return Choice("dop853", "springs in joints are not among the stiff forces of implicit integrators")
    if source is not None and source.name not in METHODS:
        return Choice("dop853", f"the actuation of {analysis.actuation} is solved anew at every stage")
    if source is not None:
        name = "dop853" if source.name == "generalized-alpha" else source.name
        return Choice(name, f"like the inverse analysis {analysis.actuation}")
    highest = max((float(np.sqrt(body.stiffness.max(initial=0.0))) for body in assembly.model.bodies), default=0.0)
    if highest == 0.0:
        return Choice("dop853", "nothing vibrates")
    if len(start.q) > MOST_COORDINATES:
        name = "radau" if highest * analysis.end > MANY_PERIODS else "dop853"
        return Choice(name, f"links vibrate at up to {highest:.3g} rad/s (more coordinates than are looked at closely)")
    modes = vibrations(assembly, start)
    if not len(modes.frequency):
        return Choice("dop853", "nothing vibrates")
    excited = ringing(assembly, start, modes)
    top, ringing_phase = modes.frequency[-1], _ringing_phase(modes.frequency, modes.damping_ratio, excited, analysis)
    scale = analysis.tolerance / 1e-4
    explicit = max(analysis.end * top / STABLE, ringing_phase / (RESOLVED_DOP853 * scale ** (1 / 8)))
    implicit = max(len(analysis.times), ringing_phase / (RESOLVED_RADAU * scale ** (1 / 5)))
    rings = excited > NEGLIGIBLE * analysis.tolerance
    felt = f"{modes.frequency[rings].max():.3g} rad/s" if rings.any() else "no frequency"
    reason = f"vibrations up to {top:.3g} rad/s, ringing above the tolerance up to {felt}"
    return Choice("radau" if COST_OF_RADAU * implicit < explicit else "dop853", reason)


def _ringing_phase(omega: Array, damping_ratio: Array, excited: Array, analysis: Analysis) -> float:
    """∫ ω dt (rad) over the run, ω the highest frequency that still rings above the tolerance."""
    phase, covered = 0.0, 0.0
    threshold = NEGLIGIBLE * analysis.tolerance
    for i in np.flatnonzero(excited > threshold)[::-1]:
        decay = damping_ratio[i] * omega[i]
        lasts = analysis.end if decay <= 0 else min(analysis.end, float(np.log(excited[i] / threshold)) / decay)
        phase += float(omega[i]) * max(0.0, lasts - covered)
        covered = max(covered, lasts)
    return phase
