"""How far one run is from another, by kind of quantity."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..common.arrays import Array
from ..results.file import Results

KINDS = ("displacement", "force", "moment", "voltage")

# Dataset of a results file, as (group, dataset), to the kind of quantity it counts as.
_KIND_OF = {
    ("points", "deflection"): "displacement",
    ("trajectories", "force"): "force",
    ("joints", "reaction"): "force",
    ("joints", "moment"): "moment",
    ("pzt", "required_voltage"): "voltage",
}
_WITHOUT_DEFLECTION = {("points", "position"): "displacement"}  # of scenes in which nothing bends

# Histories whose peak is below this part of the largest of their kind are rounding: deflections at supports.
NEGLIGIBLE_PEAK = 1e-6


def histories(results: Results, analysis: str) -> dict[str, dict[str, Array]]:
    """What errors are taken of: by kind of quantity and dataset name, an array (T,) or (T, columns) each."""
    found = _datasets(results, analysis, _KIND_OF)
    if "displacement" not in found:
        found |= _datasets(results, analysis, _WITHOUT_DEFLECTION)
    return found


def _datasets(results: Results, analysis: str, kinds: Mapping[tuple[str, str], str]) -> dict[str, dict[str, Array]]:
    found: dict[str, dict[str, Array]] = {}
    for (group, dataset), kind in kinds.items():
        for member in results.names(f"{analysis}/{group}"):
            name = f"{group}/{member}/{dataset}"
            if results.has(f"{analysis}/{name}"):
                found.setdefault(kind, {})[name] = results[f"{analysis}/{name}"]
    notable = {kind: _without_rounding(datasets) for kind, datasets in found.items()}
    return {kind: datasets for kind, datasets in notable.items() if datasets}


def _without_rounding(datasets: Mapping[str, Array]) -> dict[str, Array]:
    peaks = {name: float(np.abs(values).max(initial=0.0)) for name, values in datasets.items()}
    largest = max(peaks.values())
    return {name: values for name, values in datasets.items() if peaks[name] > NEGLIGIBLE_PEAK * largest}


def errors(found: Mapping[str, Mapping[str, Array]], reference: Mapping[str, Mapping[str, Array]]) -> dict[str, float]:
    """By kind: the largest difference at any output of any dataset, relative to that dataset's peak in `reference`.

    Kinds that the reference does not have are left out, and datasets that only one of them has.
    """
    result = {}
    for kind, datasets in reference.items():
        common = datasets.keys() & found.get(kind, {}).keys()
        if common:
            result[kind] = max(relative(found[kind][name], datasets[name]) for name in common)
    return result


def relative(values: Array, reference: Array) -> float:
    """Largest difference over the peak of `reference`."""
    return float(np.abs(values - reference).max() / np.abs(reference).max())
