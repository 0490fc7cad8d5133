"""Deflections that an analysis prescribes: its keys, and p(t) of every body."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Literal, Self

import numpy as np
from pydantic import model_validator

from ...common.arrays import Array, as_floats
from ...common.errors import InputError, SolveError
from .._core import TimeFunction
from ..fields.field_types import Expression, Name
from ..fields.references import Reference
from ..fields.waypoints import spline
from ..model.divided_link import DividedLink
from ..model.model import ZERO
from ..model.planar_body import PlanarBody
from ..model.spatial_body import SpatialBody
from ..scene.analysis import Check, Need, TimedAnalysis
from ..solve.quasi_static import PrescribedMotion, quasi_static_shape

FEWEST_NODES = 201  # of the spline through a static shape; half as many as outputs where that is more

Bodies = Sequence[PlanarBody | SpatialBody]

Shape = list[list[TimeFunction]]
"""p_k(t) of each body, in the coordinates of its `PlanarBody`."""


class FcidKeys(TimedAnalysis):
    """Of `Fcid`."""

    kind: Literal["fcid"]
    shape: Literal["zero", "static", "given"]
    """Prescribed deflection: none, the static equilibrium at every instant, or `modal`."""
    modal: dict[Name, tuple[Expression, ...]] | None = None
    """Expressions in t for the first modal coordinates by body (m·√kg); the others are 0."""
    check: Check = None
    """Forward simulation under the result with twice the modes ("finer")."""

    is_algebraic = True
    allocates_patches = True
    applicable = ("joints", "joints+pzt", "points")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.modal is not None and self.shape != "given":
            raise ValueError(f'expected the key "modal" only in shape = "given", found shape = "{self.shape}"')
        if self.modal is None and self.shape == "given":
            raise ValueError('expected the key "modal" in shape = "given", found none')
        return self

    def needs(self) -> Iterator[Need]:
        """Something to follow."""
        yield Need("kind", self.kind, "trajectory")

    def references(self) -> Iterator[Reference]:
        """The links whose shape is given."""
        for body in self.modal or ():
            yield Reference("modal", body)
            yield Reference("modal", body, "flexible body")

    def prescribed(self) -> Iterator[tuple[str, TimeFunction, int]]:
        """The given shape."""
        for body, functions in (self.modal or {}).items():
            for k, function in enumerate(functions):
                yield f"modal.{body}[{k}]", function, 2


def shape_nodes(analysis: FcidKeys) -> Array:
    """Times (T,), s, between which shapes are splines."""
    return as_floats(np.linspace(0.0, analysis.end, max(FEWEST_NODES, len(analysis.times) // 2 + 1)))


def sampled(shape: Shape, times: Array) -> Array:
    """p, ṗ and p̈ (3, T, n) of all bodies."""
    functions = [function for of_body in shape for function in of_body]
    samples = np.array([function.sample(times) for function in functions]).reshape(len(functions), 3, len(times))
    return np.ascontiguousarray(np.moveaxis(samples, 0, -1))


def given_shape(scene_path: Path, bodies: Bodies, analysis: FcidKeys) -> Shape:
    """The expressions of the scene; by way of a spline where the modes were made anew (payloads, patches)."""
    given: Mapping[str, tuple[TimeFunction, ...]] = analysis.modal or {}
    shape: Shape = []
    for body in bodies:
        functions = list(given.get(body.name, ()))
        in_file = len(body.modal_transform)
        if len(functions) > in_file:
            raise InputError(
                f'{scene_path}: analysis "{analysis.name}": modal.{body.name}: expected at most {in_file}'
                f" expressions, one for each mode, found {len(functions)}"
            )
        functions += [ZERO] * (in_file - len(functions))
        selected = np.argmax(body.modal_transform, axis=0) if body.n_modes else np.zeros(0, dtype=int)
        if np.array_equal(body.modal_transform, np.eye(in_file)[:, selected]):
            shape.append([functions[k] for k in selected])
        else:
            nodes = shape_nodes(analysis)
            p = np.column_stack([function.sample(nodes)[0] for function in functions])
            shape.append(spline(nodes, np.linalg.lstsq(body.modal_transform, p.T, rcond=None)[0].T))
    return shape


def given_shape_of_pieces(
    scene_path: Path, bodies: Bodies, analysis: FcidKeys, links: Bodies, divided: Mapping[str, DividedLink]
) -> Shape:
    """`given_shape` of the whole `links`, in the coordinates of `bodies`, which have pieces of the divided ones."""
    nodes, counts = shape_nodes(analysis), {body.name: body.n_modes for body in bodies}
    shape = dict(zip((link.name for link in links), given_shape(scene_path, links, analysis), strict=True))
    for name, link in divided.items():
        p = np.column_stack([function.sample(nodes)[0] for function in shape[name]])
        of_pieces = iter(spline(nodes, p @ link.spread.T))
        shape |= {piece: [next(of_pieces) for _ in range(counts[piece])] for piece in link.bodies}
    return [shape[body.name] for body in bodies]


def prescribed_shape(
    scene_path: Path, bodies: Bodies, analysis: FcidKeys, motion: PrescribedMotion, posture: Array
) -> Shape:
    """p(t) of every body, with its derivatives; `posture` (n_q,) of the tree at the start.

    Raises `SolveError` where no posture, or no static shape, is found.
    """
    if analysis.shape == "given":
        return given_shape(scene_path, bodies, analysis)
    if analysis.shape == "static":
        return _static(scene_path, bodies, analysis, motion, posture)
    return [[ZERO] * body.n_modes for body in bodies]


def _static(scene_path: Path, bodies: Bodies, analysis: FcidKeys, motion: PrescribedMotion, posture: Array) -> Shape:
    """A spline through static shapes: p is prescribed, so p, ṗ and p̈ only have to go with each other exactly."""
    nodes, stiffness = shape_nodes(analysis), np.concatenate([body.stiffness for body in bodies])
    p = quasi_static_shape(motion, stiffness, nodes, posture)
    is_found = np.isfinite(p).all(axis=1)
    if not is_found.all():
        raise SolveError(
            f'{scene_path}: analysis "{analysis.name}": no static shape was found at'
            f" t = {nodes[is_found.argmin()]:g} s: the links are too soft for their loads there"
        )
    functions = iter(spline(nodes, p))
    return [[next(functions) for _ in range(body.n_modes)] for body in bodies]
