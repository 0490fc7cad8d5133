"""Steps of an integration that another one takes again: where they end, and with which method they were made.

Runs that choose their own steps differ by as much as these err, however small a change of the scene. With the same
steps the discrete motion is a smooth function of every number in the scene, and differences of runs have no noise but
round-off: internal numerical differentiation (H. G. Bock, Springer Series in Chemical Physics 18, 1981, p. 102).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError

DATASET = "step_ends"
"""Of an analysis in a results file; its attribute `METHOD` is the integrator's name."""
METHOD = "integrator"


@dataclass(frozen=True)
class Steps:
    """Steps of an analysis in the results file at `path`: `method`, and times (N,), s, at which steps ended."""

    path: Path
    method: str
    ends: Array = field(repr=False, compare=False)


def load_steps(path: Path, analysis: str) -> Steps:
    """The steps of the analysis of that name in a results file. Raises `InputError` where it has none."""
    from ...common.hdf5 import numbers, open_checked  # few scenes have steps, and h5py takes longer than reading one

    try:
        with open_checked(path) as file:
            dataset = file.get(f"{analysis}/{DATASET}")
            if dataset is None:
                raise InputError(
                    f'{path}: expected the steps of an analysis "{analysis}"',
                    "none: they are there of a run with keep_steps = true that one explicit integrator has made as a"
                    " whole",
                )
            ends, method = numbers(dataset, f"{path}: {analysis}/{DATASET}"), str(dataset.attrs.get(METHOD, ""))
    except OSError:
        raise InputError(f"{path}: expected a results file of ffrobot", "something else") from None
    if ends.ndim != 1 or not len(ends) or not np.all(np.diff(ends) > 0.0):
        raise InputError(f"{path}: {analysis}/{DATASET}: expected times that ascend", "others")
    return Steps(path, method, ends)
