"""Histories of an analysis as a Dataset of xarray: dimensions, coordinates, units."""

from collections.abc import Sequence
from typing import Any

from xarray import Dataset

from ..common.meanings import LABELS, meaning
from .joints import unit_of

Results = Any  # of `results.file`, which calls this
TIME, SAMPLES = "time", "control/time"


def labelled(results: Results, analysis: str, histories: Sequence[str]) -> Dataset:
    """All `histories` of an analysis, and the samples of a closed loop; see `Results.to_xarray`."""
    names = [name for name in histories if name != TIME and not name.startswith("control/")]
    if is_sampled := results.has(f"{analysis}/{SAMPLES}"):
        names += [f"control/{name}" for name in results.histories(f"{analysis}/control") if name != TIME]
    coordinates, variables = dict[str, Any](), dict[str, Any]()
    for name in names:
        values = results[f"{analysis}/{name}"]
        dimensions = [SAMPLES if name.startswith("control/") else TIME]
        if values.ndim == 2:
            dimension, labels = _columns(results, analysis, name, values.shape[1])
            if dimension in coordinates and list(coordinates[dimension][1]) != labels:
                dimension = f"{dimension}, {name}"  # the same dimension with other labels
            coordinates[dimension] = (dimension, labels)
            dimensions.append(dimension)
        else:
            dimensions += [f"{name} {k}" for k in range(1, values.ndim)]
        known = meaning(name)
        of_name = {} if known is None else {"units": unit_of(results.scene, name), "long_name": known.what}
        variables[name] = (dimensions, values, of_name)
    for name in (TIME, SAMPLES) if is_sampled else (TIME,):
        coordinates[name] = (name, results[f"{analysis}/{name}"], {"units": "s"})
    about = {
        key: "\n".join(of) if getattr(of, "dtype", 0) == "O" else of
        for key, of in results.attributes(analysis).items()
        if not isinstance(of, bytes)
    }
    return Dataset(variables, coordinates, {"scene": results.name, "analysis": analysis} | about)


def _columns(results: Results, analysis: str, name: str, count: int) -> tuple[str, Sequence[Any]]:
    part = [*name.split("/"), name][1]
    columns = getattr(meaning(name), "columns", "") or f"{name} 1"
    dimension, labels = columns.format(part), list(LABELS.get(columns, ())[:count])
    if name.startswith("trajectories/"):
        labels = [str(one) for one in results.attributes(f"{analysis}/trajectories/{part}")["components"]]
    return dimension, labels if len(labels) == count else list(range(1, count + 1))
