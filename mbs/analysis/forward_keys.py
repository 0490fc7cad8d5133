"""Keys of forward dynamics."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, Self

from pydantic import model_validator

from ...common.validation import either
from ..scene.analysis import ActuatedAnalysis, Analysis, Need


class ForwardKeys(ActuatedAnalysis):
    """Of `Forward`."""

    kind: Literal["forward"]
    apply: Literal["joints", "joints+pzt", "trajectory", "points"] | None = None
    """Inputs taken from `actuation`: motor torques, torques and voltages, forces along the trajectories, or at the
    actuation points."""
    limits: bool = False
    """Saturation of motors and patches at their limits."""

    follows_trajectories = False
    is_resumable = True

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.actuation is None) != (self.apply is None):
            raise ValueError(
                'expected the keys "actuation" and "apply" together, found only '
                + ('"apply"' if self.actuation is None else '"actuation"')
            )
        if self.limits and self.apply not in ("joints", "joints+pzt"):
            raise ValueError(
                f'expected limits = true only with apply = "joints" or "joints+pzt", found apply = "{self.apply}"'
            )
        return self

    def needs(self) -> Iterator[Need]:
        """Patches or points for what is applied by them."""
        table = {"joints+pzt": "pzt", "points": "actuation_points"}.get(self.apply or "")
        if self.apply is not None and table is not None:
            yield Need("apply", self.apply, table)

    def replay_problems(self, source: Analysis) -> Iterator[str]:
        """Whether `source` found what is to be applied."""
        if source.applicable and self.apply not in source.applicable:
            more = f': "{source.name}" takes more than the forces on its trajectories'
            why = more if self.apply == "trajectory" else ""
            yield (
                f'apply: expected {either(source.applicable)} with an analysis of kind "{source.kind}", found'
                f' "{self.apply}"{why}'
            )
