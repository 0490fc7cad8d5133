"""Covariance of fitted parameters in a file, and resulting deviations of stable depths of cut over a map."""

from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Self

import numpy as np
import tomli_w
from pydantic import Field, model_validator

from ..common.arrays import Array
from ..common.errors import InputError, SolveError
from ..common.files import write_atomically
from ..common.toml_files import load_toml
from ..common.validation import Record, validate
from ..map.pose_map import PoseMap
from ..mbs.fields.field_types import NotNegative
from ..mbs.linear.poses import PoseEvaluator
from ..milling.process import stable_depths
from ..run.prepare import prepare_scene
from .fitting import RobotTarget, VariedKeys
from .least_squares import Parameters


class Covariance(Record):
    """Errors of fitted parameters, relative to them."""

    keys: Annotated[tuple[str, ...], Field(min_length=1)]
    """Keys of the scene; "KEY=KEY" have a common factor."""
    deviation: tuple[NotNegative, ...]
    """Relative standard deviations."""
    correlation: tuple[tuple[float, ...], ...]
    """Correlations of the errors: a list for each key."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        sizes = {len(self.deviation), len(self.correlation), *map(len, self.correlation)}
        if sizes != {len(self.keys)}:
            raise ValueError(f"expected a deviation and a list of correlations for each of {len(self.keys)} keys")
        R = np.array(self.correlation)
        # keys that hardly differ, or few digits, leave as much round-off
        if np.abs(np.append(R - R.T, R.diagonal() - 1.0)).max() > 1e-3:
            raise ValueError("correlation: expected a symmetric matrix with 1 on its diagonal, found another")
        return self

    @property
    def steps(self) -> Array:
        """Rows (n, n), no unit: independent changes of ln θ of n parameters θ, whose covariance is Σ rowᵀ row."""
        values, vectors = np.linalg.eigh(np.array(self.correlation))
        if values[0] < -1e-9 * len(values):
            raise InputError("correlation: expected one without negative eigenvalues", "others")
        return (vectors * np.sqrt(values.clip(min=0.0))).T * np.array(self.deviation)


def write_covariance(fit: Parameters, path: Path) -> None:
    """Write keys, deviations and correlations of a fit to a TOML file."""
    tables = {
        "keys": list(fit.keys),
        "deviation": fit.relative_deviation.tolist(),
        "correlation": fit.correlation.tolist(),
    }
    write_atomically(path, tomli_w.dumps(tables).encode(), "covariance of the fit")


def read_covariance(path: Path) -> Covariance:
    """Read the covariance in the TOML file at `path`. Raises `InputError` for wrong keys."""
    return validate(Covariance, load_toml(path, "covariance of a fit"), path)


def with_deviations(poses: PoseMap, covariance: Covariance) -> PoseMap:
    """Return a map of P poses with `milling_deviation` (P,), m: standard deviations of `milling_depth`.

    σ² = Σ ((a₊ − a₋)/2)² of depths a with parameters changed by ± each of `covariance.steps`; NaN where a changed
    robot has no equilibrium, or no limit. Raises `InputError` for keys that the scene has not.
    """
    target = RobotTarget(poses.plan.scene, "locked")
    varied, variances = VariedKeys(poses.plan.scene, target, covariance.keys, None), dict[str, Array]()
    for step in covariance.steps:
        ahead, behind = (_depths(poses, target, varied, varied.start * np.exp(sign * step)) for sign in (1, -1))
        for name, depth in ahead.items():
            with np.errstate(invalid="ignore"):
                variances[name] = variances.get(name, 0.0) + ((depth - behind[name]) / 2) ** 2
    named = {name.replace("_depth", "_deviation"): np.sqrt(values) for name, values in variances.items()}
    return replace(poses, values={**poses.values, **named})


def _depths(poses: PoseMap, target: RobotTarget, varied: VariedKeys, values: Array) -> dict[str, Array]:
    """Stable depths (P,), m, in all poses with other values of the parameters, by name; NaN without one."""
    with varied.named(values):
        model = prepare_scene(target.scene(varied.changes(values), "static")).model
    depths = {name: np.full(len(poses.q), np.nan) for name in poses.values if name.endswith("/milling_depth")}
    good, milling = np.flatnonzero(poses.status == 0), poses.plan.milling
    judge = None if milling is None else partial(stable_depths, milling.model_copy(update={"speeds": ()}))
    evaluator = PoseEvaluator(model, poses.q[good[0]], poses.plan.point, judge=judge)
    for pose in good:
        with suppress(SolveError):
            found = evaluator.at(poses.q[pose])
            for name in depths:
                depths[name][pose] = found[name]
    return depths
