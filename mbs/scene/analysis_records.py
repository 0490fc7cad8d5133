"""The analyses of a scene file, key by key. Times in s."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from ...common.arrays import Array
from ..fields.field_types import Expression, Name, NotNegative, PointReference, Positive
from .control_records import Placement
from .loop_records import ClosedLoopKeys

MAX_OUTPUTS = 10_000_000
UNTIMED = ("static", "linear", "placement")  # kinds without an end
STATIC = "static"  # instead of an analysis' name: about the static equilibrium
TIGHTEST_TOLERANCE = 1e-10  # rounding in the forces of stiff links is not far below


class Analysis(ClosedLoopKeys):
    """One run, with outputs at 0, output_step, …, end (s).

    Both are 0 where the file does not give them: in static analyses (t = 0 only), and in forward analyses that take
    over the times of their actuation, which `load_scene` fills in. `shape` of FCID says which p(t) is prescribed,
    `modal` gives it: expressions for the first modes of a body, as its modal file numbers them; all others are 0.
    `limits` keeps the actuators of a forward run within their limits.

    `integrator`: see `integrators.choose_integrator` for "auto"; `spectral_radius` is what a step of generalized-alpha
    leaves of vibrations far above one over its size.

    Of kind "motors-only": `output` "tip" has the path's own points follow it, "redefined" where they would be with
    `factor` times the vibration (nine tenths of the largest that is minimum phase where none is given).
    `pre_actuation` and `post_actuation` (s) are how long motors act before and after the path, which is held there;
    where they are not given, as long as the zero dynamics asks for.

    Linear models and placements are `about` the static equilibrium (None, or "static") or an earlier analysis at
    `times`; `points` are those whose motion and disturbance a linear model knows.
    """

    name: Name
    kind: Literal["pcid", "fcid", "forward", "static", "linear", "placement", "motors-only", "closed-loop"]
    end: Positive = 0.0
    output_step: Positive = 0.0
    tolerance: Annotated[float, Field(ge=TIGHTEST_TOLERANCE, lt=1.0)] = 1e-6
    actuation: str | None = None
    apply: Literal["joints", "joints+pzt", "trajectory", "points"] | None = None
    limits: bool = False
    shape: Literal["zero", "static", "given"] | None = None
    modal: dict[Name, tuple[Expression, ...]] | None = None
    integrator: Literal["auto", "dopri5", "dop853", "radau", "generalized-alpha"] = "auto"
    spectral_radius: Annotated[float, Field(ge=0.0, le=1.0)] = 0.8  # of generalized-alpha at infinite frequency
    output: Literal["tip", "redefined"] = "tip"
    factor: Annotated[float, Field(ge=0.0, lt=1.0)] | None = None
    pre_actuation: NotNegative | None = None
    post_actuation: NotNegative | None = None
    max_steps: Annotated[int, Field(gt=0)] = 5_000_000
    about: str | None = None
    instants: tuple[NotNegative, ...] | None = Field(default=None, alias="times", min_length=1)
    points: tuple[PointReference, ...] | None = None
    placement: Placement | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Analysis:
        for key in ("end", "output_step"):
            given = key in self.model_fields_set
            if self.kind in UNTIMED and given:
                raise ValueError(f'expected no key "{key}" in kind = "{self.kind}", found {getattr(self, key):g}')
            if self.kind not in UNTIMED and self.actuation is None and not given:
                raise ValueError(f'expected the key "{key}" in kind = "{self.kind}", found none')
        if self.end and self.output_step:
            check_steps(self.end, self.output_step)
        self._check_linear_keys()
        if self.kind != "closed-loop" and (self.actuation is None) != (self.apply is None):
            raise ValueError(
                'expected the keys "actuation" and "apply" together, found only '
                + ('"apply"' if self.actuation is None else '"actuation"')
            )
        if self.actuation is not None and self.kind not in ("forward", "closed-loop"):
            raise ValueError(
                f'expected the key "actuation" only in kind = "forward" or "closed-loop", found kind = "{self.kind}"'
            )
        if self.apply is not None and self.kind == "closed-loop":
            raise ValueError('expected the key "feed_forward" in kind = "closed-loop", found "apply"')
        if "spectral_radius" in self.model_fields_set and self.integrator != "generalized-alpha":
            raise ValueError(
                'expected the key "spectral_radius" only with integrator = "generalized-alpha", found integrator ='
                f' "{self.integrator}"'
            )
        if self.shape is not None and self.kind != "fcid":
            raise ValueError(f'expected the key "shape" only in kind = "fcid", found kind = "{self.kind}"')
        if self.shape is None and self.kind == "fcid":
            raise ValueError('expected the key "shape" in kind = "fcid", found none')
        if self.modal is not None and self.shape != "given":
            raise ValueError(f'expected the key "modal" only in shape = "given", found shape = "{self.shape}"')
        if self.modal is None and self.shape == "given":
            raise ValueError('expected the key "modal" in shape = "given", found none')
        if self.limits and self.apply not in ("joints", "joints+pzt"):
            raise ValueError(
                f'expected limits = true only beside apply = "joints" or "joints+pzt", found apply = "{self.apply}"'
            )
        self._check_motors_only()
        return self

    def _check_linear_keys(self) -> None:
        allowed = {"linear": ("about", "times", "points"), "placement": ("about", "times", "placement")}
        for key, value in (
            ("about", self.about), ("times", self.instants), ("points", self.points), ("placement", self.placement)
        ):  # fmt: skip
            if value is not None and key not in allowed.get(self.kind, ()):
                raise ValueError(f'expected no key "{key}" in kind = "{self.kind}", found one')
        if self.kind == "placement" and self.placement is None:
            raise ValueError('expected the table "placement" in kind = "placement", found none')

    @property
    def source(self) -> str | None:
        """Name of the earlier analysis that a linear model or a placement is about; None for the equilibrium."""
        return None if self.about == STATIC else self.about

    @property
    def integrated(self) -> bool:
        """Whether the motion comes from an integration over time."""
        return self.kind in ("pcid", "forward", "motors-only", "closed-loop")

    def _check_motors_only(self) -> None:
        for key in ("output", "factor", "pre_actuation", "post_actuation"):
            if self.kind != "motors-only" and key in self.model_fields_set:
                raise ValueError(f'expected the key "{key}" only in kind = "motors-only", found kind = "{self.kind}"')
        if self.factor is not None and self.output != "redefined":
            raise ValueError(f'expected the key "factor" only with output = "redefined", found "{self.output}"')

    @property
    def times(self) -> Array:
        """Output times (T,), in s: exact multiples of the output step; `end` is one of them, exactly.

        From 0 to `end`, and the pre- and post-actuation besides where they are known.
        """
        if self.instants is not None:
            return np.array(self.instants)
        if not (self.end and self.output_step):
            return np.zeros(1)
        before, after = (round((x or 0.0) / self.output_step) for x in (self.pre_actuation, self.post_actuation))
        count = round(self.end / self.output_step)
        times = np.arange(-before, count + after + 1) * self.output_step
        times[before + count] = self.end
        return times


def check_steps(end: float, step: float) -> None:
    """Raise `ValueError` unless the outputs 0, step, 2 step, … end exactly at `end`."""
    ratio = end / step
    if ratio > MAX_OUTPUTS:
        raise ValueError(f"expected at most {MAX_OUTPUTS} outputs, found output_step = {step:g} up to end = {end:g}")
    count = round(ratio)
    # 0.1/0.001 is not whole in binary; anything beyond rounding is meant otherwise.
    if count < 1 or abs(ratio - count) > 1e-9 * ratio:
        near = end / max(1, count)
        raise ValueError(
            f"expected an output_step that divides end = {end:g} into equal steps, found {step:g} (such as {near:.9g})"
        )
