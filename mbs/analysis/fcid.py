"""Fully constrained inverse dynamics (Shabana 2022, sec. 5.1): p(t) is prescribed too, and everything is algebraic."""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal, Self

import numpy as np
from pydantic import model_validator

from ...common.arrays import Array, Indices
from ...common.errors import InputError, SolveError
from .. import _core
from .._core import TimeFunction
from ..fields.field_types import Expression, Name
from ..fields.waypoints import spline
from ..linear.statics import modal_sizes, static_shapes
from ..model.body import Body
from ..model.gears import refuse_prescribed_motors
from ..model.model import Model
from ..model.system import MultibodySystem, driven_mechanism, fastest_mechanism
from ..posture.posture import check_smooth, misfits, shape_in_redundant_loops
from ..posture.prescribed import PrescribedMotion, left_slopes, prescribed_motion
from ..run.context import Context
from ..run.record import Prescription, Run, Statistics
from ..scene.analysis import Check, TimedAnalysis

ZERO = TimeFunction.constant(0.0)
FEWEST_NODES = 201  # of the spline through a shape; half as many as outputs where that is more
DOUBLINGS = 7  # of them
ROUGH = 3e-3  # of the largest acceleration, by trapezoids

Bodies = Sequence[Body]

Shape = list[list[TimeFunction]]
"""p_k(t) of each body, in the coordinates of its `Body`."""


class Fcid(TimedAnalysis):
    """Forces that move the robot along its trajectories while the modal coordinates p(t) follow a prescribed shape."""

    kind: Literal["fcid"]
    shape: Literal["zero", "static", "given"]
    """Prescribed deflection: none, the static equilibrium at every instant, or `modal`."""
    modal: dict[Name, tuple[Expression, ...]] | None = None
    """Expressions in t for the first modal coordinates by body (m·√kg); the others are 0."""
    check: Check = None
    """Forward simulation under the result with twice the modes ("finer")."""

    starts_on_path = True
    is_algebraic = True
    allocates_patches = True
    applicable = ("joints", "joints+pzt", "points")
    refers_to = (("modal", "body"), ("modal", "flexible body"))

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.modal is not None and self.shape != "given":
            raise ValueError(f'expected the key "modal" only in shape = "given", found shape = "{self.shape}"')
        if self.modal is None and self.shape == "given":
            raise ValueError('expected the key "modal" in shape = "given", found none')
        return self

    def prescribed(self) -> Iterator[tuple[str, TimeFunction, int]]:
        """Yield key, function and number of derivatives (2) of each modal coordinate of the given shape."""
        for body, functions in (self.modal or {}).items():
            for k, function in enumerate(functions):
                yield f"modal.{body}[{k}]", function, 2

    def run(self, context: Context) -> Run:
        """Motion and forces for the trajectories and the prescribed shape.

        Raises `InputError` where the trajectories do not fix the motion of the mechanism, `SolveError` where no
        posture, or no static shape, is found.
        """
        refuse_prescribed_motors(context.model, self)
        given = ((f'analysis "{self.name}": {key}', function) for key, function, _ in self.prescribed())
        check_smooth(context.model, self.end, given)
        path = context.path
        assert path is not None
        model, q, freedom = path.model, path.state.q, path.mobility.freedom
        rows = int(np.count_nonzero(~model.loop_rows))
        if rows != freedom:
            raise InputError(
                f"kind: expected as many trajectory components as the"
                f' mechanism has degrees of freedom ({freedom}) for "fcid"',
                rows,
            )

        began = time.perf_counter()
        has_motors = len(model.motor_columns) == freedom
        mechanism = fastest_mechanism(model, has_motors=has_motors)
        if isinstance(mechanism, _core.PlanarDriven):
            motion: PrescribedMotion = _core.PlanarPrescribedMotion(mechanism, q)
        else:
            motion = _core.SpatialPrescribedMotion(mechanism, q)

        def at(times: Array) -> Run:
            states = prescribed_motion(model, motion, sampled(shape, times), times, q[None])._asdict()
            prescribed = Prescription(lambda: _core.SpatialPrescribedMotion(driven_mechanism(model), q), shape, q)
            how = Statistics(warnings=path.warnings)
            return Run(analysis=self, model=model, time=times, **states, statistics=how, prescribed=prescribed)

        try:
            shape = _shape(context, self, model, motion, q)
            run = at(self.times)
        except SolveError as error:
            cause = shape_in_redundant_loops(model, q, MultibodySystem(model).integrated.rows)
            if not cause:
                raise
            raise SolveError(f"{error}; {cause}") from None
        statistics = replace(run.statistics, wall_seconds=time.perf_counter() - began)
        return replace(run, statistics=statistics).with_look(at)


def _shape(context: Context, analysis: Fcid, model: Model, motion: PrescribedMotion, posture: Array) -> Shape:
    """p(t) of all bodies with its derivatives, from `posture` (n_q,) at the start; expressions are of whole links."""
    path, whole = context.model.scene.path, context.whole
    bodies = [node.body for node in context.model.tree.nodes]
    if analysis.shape == "given" and whole is not None:
        links = [node.body for node in whole.model.tree.nodes]
        counts = {body.name: body.n_modes for body in bodies}
        shape = dict(zip((link.name for link in links), given_shape(path, links, analysis), strict=True))
        for name, link in whole.divided.items():
            of_pieces = iter(_sums(analysis, link.spread, shape[name]))
            shape |= {piece: [next(of_pieces) for _ in range(counts[piece])] for piece in link.bodies}
        return [shape[body.name] for body in bodies]
    if analysis.shape == "given":
        return given_shape(path, bodies, analysis)
    if analysis.shape == "static" and not model.tree.is_rigid:
        return _static(model, bodies, analysis, motion, posture)
    return [[ZERO] * body.n_modes for body in bodies]


def _nodes(analysis: Fcid, functions: Sequence[TimeFunction]) -> Array:
    """Times (T,), s, that resolve accelerations of `functions`; the fewest where these jump."""
    fewest = max(FEWEST_NODES, len(analysis.times) // 2 + 1)
    for k in range(DOUBLINGS):
        nodes = np.linspace(0.0, analysis.end, (fewest - 1) * 2**k + 1)
        if all(misfits(of, nodes, 1).max() <= ROUGH * nodes[1] * np.abs(of.sample(nodes)[2]).max() for of in functions):
            return nodes
    return np.linspace(0.0, analysis.end, fewest)


def sampled(shape: Shape, times: Array) -> Array:
    """p, ṗ and p̈ (3, T, n), √kg·m and s, of the n modes of all bodies at `times` (T,), s."""
    functions = [function for of_body in shape for function in of_body]
    samples = np.array([function.sample(times) for function in functions]).reshape(len(functions), 3, len(times))
    return np.ascontiguousarray(np.moveaxis(samples, 0, -1))


def given_shape(scene_path: Path, bodies: Bodies, analysis: Fcid) -> Shape:
    """p(t) of each body, √kg·m, by the scene's expressions; as splines where payloads or patches changed the modes."""
    given: Mapping[str, tuple[TimeFunction, ...]] = analysis.modal or {}
    shape: Shape = []
    for body in bodies:
        functions = list(given.get(body.name, ()))
        in_file = len(body.modal_transform)
        if len(functions) > in_file:
            raise InputError(
                f'{scene_path}: analysis "{analysis.name}": modal.{body.name}: expected at most {in_file} expressions,'
                " one for each mode",
                len(functions),
            )
        functions += [ZERO] * (in_file - len(functions))
        selected = np.argmax(body.modal_transform, axis=0) if body.n_modes else np.zeros(0, dtype=int)
        if np.array_equal(body.modal_transform, np.eye(in_file)[:, selected]):
            shape.append([functions[k] for k in selected])
        else:
            shape.append(_sums(analysis, np.linalg.pinv(body.modal_transform), functions))
    return shape


def _sums(analysis: Fcid, weights: Array, functions: list[TimeFunction]) -> list[TimeFunction]:
    """Splines through sums of `functions` (n,) by `weights` (k, n)."""
    nodes = _nodes(analysis, functions)
    return spline(nodes, sampled([functions], nodes)[0] @ weights.T)


def _static(model: Model, bodies: Bodies, analysis: Fcid, motion: PrescribedMotion, posture: Array) -> Shape:
    """A spline through static shapes: p is prescribed, so p, ṗ and p̈ only have to go with each other exactly."""
    paths = (target for path in model.scene.trajectory for _, target in path.targets)
    nodes = _nodes(analysis, [*paths, *model.scene.load_functions])
    near: Array = np.empty((0, len(posture)))

    def forces(p: Array, at: Indices) -> Array:
        nonlocal near
        first = near[at] if len(near) else posture[None]  # from there one after the other
        q, left = motion.left_on_modes(nodes[at].tolist(), p, 0 * p, 0 * p, first)
        near = near if len(near) else q
        near[at] = q
        return left

    def stiffness(p: Array, at: Indices) -> Array:
        return left_slopes(model, motion, (p, 0 * p, 0 * p), nodes[at], near[at])[2][:, : p.shape[1]]

    omega = np.sqrt(np.concatenate([body.stiffness for body in bodies]))
    p, is_met = static_shapes(omega, modal_sizes(bodies), forces, stiffness, len(nodes))
    if not is_met.all():
        raise SolveError(
            f"no static shape was found at t = {nodes[is_met.argmin()]:g} s: the links are too soft for their loads"
            " there"
        )
    functions = iter(spline(nodes, p))
    return [[next(functions) for _ in range(body.n_modes)] for body in bodies]
