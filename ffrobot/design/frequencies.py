"""Derivatives of links' frequencies that are exact: by their modes, without runs.

Of beams by Rayleigh's quotient (`fe_models.beam.rayleigh`), whose dependence on a key is a rational function that
differences with `differences` give to rounding. By keys that no link knows of they are 0. Of solids, whose mesh
changes with their shape, and of links with measured frequencies, runs give them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..common.errors import InputError
from ..fe_models.link import fixed_mode_frequencies
from ..fe_models.link_records import BeamLink
from ..sweep.files import LINKS
from .derivatives import SIZES, Base, Entry, Exact
from .differences import derivative
from .goals import Frequency
from .readings import Reading
from .scenes import link_with

FINE = 0.1  # of the steps of runs: there is no noise but rounding


def exact_entries(path: Path, base: Base) -> Exact:
    """Entries of the scene at `path` that are known without runs, by numbers of goal and key."""
    found: dict[tuple[int, int], Entry] = {}
    for g, (goal, reading) in enumerate(zip(base.goals, base.readings, strict=True)):
        if not isinstance(goal, Frequency):
            continue
        for k, key in enumerate(base.keys):
            if key[0] not in (LINKS, "body") or (key[0] == LINKS and key[1] != goal.body):
                found[g, k] = Entry(0.0, 0.0, 0.0, "exact")
            elif key[0] == LINKS and (entry := _of_beam(path, base, k, goal, reading)):
                found[g, k] = entry
    return found


def _of_beam(path: Path, base: Base, k: int, goal: Frequency, reading: Reading) -> Entry | None:
    """By a key of the link itself; None where it is no beam, or the mode is not alone."""
    steps = FINE * base.steps[k] * np.array(SIZES)
    offsets = np.array([0.0, *steps, *-steps])
    links = []
    try:
        for offset in offsets:
            link = link_with(path, goal.body, {**base.changes, base.keys[k]: base.point[k] + float(offset)})
            if not isinstance(link, BeamLink) or link.measured or link.reference.condition == "craig-bampton":
                return None
            links.append(link)
    except InputError:  # on one side no value is allowed
        return None
    family, number = reading.mode.rsplit(" ", 1)
    frequencies = fixed_mode_frequencies(links, next(one for one in links[0].families if one == family), int(number))
    if frequencies is None:
        return None
    found = derivative(offsets, frequencies)
    return Entry(*found, "exact")
