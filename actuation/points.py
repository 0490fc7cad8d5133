"""Actuation points (Shabana 2022, Eqs. 5–10): generalized driving forces of a body as forces at points of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import TypeVar

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError
from ..common.plane import rotated
from ..common.validation import Record, did_you_mean, quoted
from ..fe_models.modal_body import Interface, ModalBody
from ..mbs import _core
from ..mbs.analysis.planar_outcome import PlanarOutcome
from ..mbs.analysis.replay import PointActuator
from ..mbs.fields.field_types import Name
from ..mbs.fields.references import Reference
from ..mbs.model.planar_body import PlanarBody, PlanarPoint
from ..mbs.model.spatial_body import SpatialBody, SpatialPoint

DEPENDENT = 1e-10  # ratio of singular values of L_a below which components count as saying the same
AXES = {"axial": (1.0, 0.0), "transverse": (0.0, 1.0)}


P = TypeVar("P", PlanarPoint, SpatialPoint)

Place = float | Name
"""Where on a link: the distance from its root (m), or the name of one of its points."""


class ActuationPoints(Record):
    """Components of force on one body, equivalent to its generalized driving forces (Shabana 2022, sec. 4).

    `axial` and `transverse` list the points of components along x or y of the body's frame. Without both, ffrobot
    chooses as many components as the body has coordinates.
    """

    body: str
    """Body with these forces."""
    axial: tuple[Place, ...] = ()
    """Points (m from the root, or a name) at which a force along the body's x axis acts."""
    transverse: tuple[Place, ...] = ()
    """Points at which a force along the body's y axis acts."""

    @property
    def is_automatic(self) -> bool:
        """Whether the components are left to the program."""
        return not (self.axial or self.transverse)

    def references(self) -> Iterator[Reference]:
        """The body, and the places on it that are named."""
        yield Reference("body", self.body)
        for place in (*self.axial, *self.transverse):
            if isinstance(place, str):
                yield Reference("", f"{self.body}.{place}")


@dataclass(frozen=True)
class PointSet:
    """Components of force at points of one body.

    Attributes:
        body: its name.
        names: of the points, one for each component.
        axes: "axial" or "transverse", likewise.
        points: likewise, in the coordinates of the `PlanarBody`.
        scale: (3 + n) factors that make the rows of L_a forces in N: 1, 1, 1/length, √mass …
    """

    body: str
    names: tuple[str, ...]
    axes: tuple[str, ...]
    points: tuple[PlanarPoint, ...]
    scale: Array

    @property
    def direction(self) -> Array:
        """(2, c) unit vectors in body axes."""
        return np.array([AXES[axis] for axis in self.axes]).T

    def equations(self) -> _core.ActuationPoints:
        """L_a F_a = Q_a as the core solves it."""
        position = np.array([point.position for point in self.points]).T
        return _core.ActuationPoints(
            self.direction, position, np.vstack([p.translation for p in self.points]), self.scale
        )

    def actuator(self) -> PointActuator:
        """What acts in a forward run."""
        return PointActuator(self.names, self.equations())


def with_factors(points: PointSet, factors: Array) -> PointSet:
    """The points on a body in coordinates p' = factors · p, factors (n,): see `mbs.model.raised_mass`."""
    if np.all(factors == 1.0):
        return points
    moved = (PlanarPoint(p.position, p.translation / factors, p.rotation / factors) for p in points.points)
    return replace(points, points=tuple(moved), scale=points.scale * np.concatenate([np.ones(3), factors]))


@dataclass(frozen=True)
class PointForces:
    """Forces at the actuation points of one body over time.

    Attributes:
        force: (T, c) N along each component, body axes.
        unmet: (T, 3 + n) Q_a − L_a F_a on (R, θ, p), R in global axes: N, N·m, N/√kg.
        residual: (T,) its norm with the scale of the set, N.
        rank: least rank of the scaled L_a.
        condition_number: largest of the scaled L_a.
    """

    force: Array
    unmet: Array
    residual: Array
    rank: int
    condition_number: float


def point_set(scene_path: Path, layout: ActuationPoints, body: ModalBody | None, planar: PlanarBody) -> PointSet:
    """The components that the scene asks for, or as many well-conditioned ones as the body has coordinates.

    Raises `InputError` for places that the body has not, for more components than coordinates, and for components that
    do the same to the body.
    """
    key = f'{scene_path}: actuation_points "{layout.body}"'
    if layout.is_automatic:
        return _automatic(key, layout.body, body, planar)
    places = [("axial", place) for place in layout.axial] + [("transverse", place) for place in layout.transverse]
    coordinates = 3 + planar.n_modes
    if len(places) > coordinates:
        raise InputError(
            f"{key}: expected at most as many components as the body has coordinates ({coordinates}), found"
            f" {len(places)}"
        )
    points = [_point(key, place, body, planar) for _, place in places]
    axes = tuple(axis for axis, _ in places)
    near = 1e-9 * (planar.length or 0.0)
    for k, (axis, point) in enumerate(zip(axes, points, strict=True)):
        for earlier in range(k):
            if axis == axes[earlier] and np.allclose(point.position, points[earlier].position, rtol=0, atol=near):
                raise InputError(
                    f"{key}: {axis}: expected points apart from each other, found two at {places[earlier][1]} and"
                    f" {places[k][1]} that coincide"
                )
    chosen = _named(layout.body, axes, points, planar)
    _check_rank(key, chosen)
    return chosen


def with_points(planar: PlanarBody, chosen: PointSet) -> PlanarBody:
    """The body with the actuation points among its points, where forces can act."""
    own = dict(zip(chosen.names, chosen.points, strict=True))
    return replace(planar, points=MappingProxyType({**planar.points, **own}))


def solve_point_forces(chosen: PointSet, outcome: PlanarOutcome) -> PointForces:
    """L_a F_a = Q_a at every output time."""
    Q_a = driving_forces(outcome, chosen.body)
    q = outcome.q[:, outcome.coordinates(chosen.body)]
    equations = chosen.equations()
    force = np.array([equations.solve(x[2], x[3:], Q) for x, Q in zip(q, Q_a, strict=True)])
    L_a = np.array([equations.L_a(x[3:]) for x in q])
    unmet = Q_a - _to_global(q[:, 2], np.einsum("tik,tk->ti", L_a, force))
    sizes = np.linalg.svd(chosen.scale[:, None] * L_a, compute_uv=False)
    rank = int(np.count_nonzero(sizes > DEPENDENT * sizes[:, :1], axis=1).min())
    condition = float((sizes[:, 0] / sizes[:, -1]).max())
    return PointForces(force, unmet, np.linalg.norm(unmet * chosen.scale, axis=1), rank, condition)


def driving_forces(outcome: PlanarOutcome, body: str) -> Array:
    """Q_a = −C_sqᵀ λ_s, less λ_p where p is prescribed: (T, 3 + n) on (R, θ, p) of a body, R in global axes."""
    assembly, columns = outcome.assembly, outcome.coordinates(body)
    C_q = assembly.system.constraint_jacobians(outcome.q)[:, assembly.is_trajectory][:, :, columns]
    Q_a: Array = -np.einsum("trk,tr->tk", C_q, outcome.lambda_[:, assembly.is_trajectory])
    if outcome.details.shape_force is not None:
        Q_a[:, 3:] += outcome.details.shape_force[:, outcome.modal_columns(body)]
    return Q_a


def _to_global(theta: Array, Q: Array) -> Array:
    """Forces Q (T, 3 + n) on (R, θ, p) of a body whose R part is in body axes, with it in global axes; θ (T,)."""
    return np.hstack([rotated(theta, Q[:, :2]), Q[:, 2:]])


def _automatic(key: str, name: str, body: ModalBody | None, planar: PlanarBody) -> PointSet:
    """Out of both components at every station, those that QR with column pivoting takes first: far from dependent."""
    from scipy.linalg import qr

    points = [_point(key, place, body, planar) for place in candidate_places(key, body, planar.points)]
    candidates = _named(name, ("axial",) * len(points) + ("transverse",) * len(points), points * 2, planar)
    _, R, order = qr(_scaled(candidates), mode="economic", pivoting=True)
    coordinates = 3 + planar.n_modes
    sizes = np.abs(np.diag(R))
    rank = int(np.count_nonzero(sizes > DEPENDENT * sizes[0]))
    if rank < coordinates:
        raise InputError(
            f"{key}: expected points that carry all {coordinates} generalized forces of the body, found {rank}"
            " independent components among all its stations"
        )
    kept = sorted(order[:coordinates])
    return _named(name, tuple(candidates.axes[k] for k in kept), [candidates.points[k] for k in kept], planar)


def _named(name: str, axes: tuple[str, ...], points: list[PlanarPoint], planar: PlanarBody) -> PointSet:
    scale = np.concatenate([[1.0, 1.0, 1.0 / length_of(planar)], np.full(planar.n_modes, np.sqrt(planar.mass))])
    return PointSet(name, point_names(len(points)), axes, tuple(points), scale)


def _point(key: str, place: Place, body: ModalBody | None, planar: PlanarBody) -> PlanarPoint:
    T = planar.modal_transform
    return point_at(
        key, place, body, planar.points,
        lambda at: PlanarPoint(at.position[:2], at.translation[:2] @ T, at.rotation[2] @ T),
    )  # fmt: skip


def point_names(count: int) -> tuple[str, ...]:
    """What the points of so many components are called in results."""
    return tuple(f"actuation{k}" for k in range(1, count + 1))


def length_of(body: PlanarBody | SpatialBody) -> float:
    """By which moments on a body are measured against forces, m."""
    return body.length or max(float(np.linalg.norm(point.position)) for point in body.points.values()) or 1.0


def candidate_places(key: str, body: ModalBody | None, points: Mapping[str, P]) -> list[Place]:
    """Where components may be put: the stations of a link, the points of a rigid body.

    Raises `InputError` where there are none.
    """
    if body is not None:
        return [float(x) for x in np.unique(body.stations.position[:, 0])]
    if not points:
        raise InputError(f"{key}: expected a rigid body with points, found none")
    return list(points)


def point_at(
    key: str, place: Place, body: ModalBody | None, points: Mapping[str, P], made: Callable[[Interface], P]
) -> P:
    """One of the `points` of a body by its name, or the one `made` of the section at a distance from its link's root.

    Raises `InputError` for a place that the body has not.
    """
    if isinstance(place, str):
        if place not in points:
            raise InputError(
                f'{key}: expected a point of the body ({quoted(points)}), found "{place}"' + did_you_mean(place, points)
            )
        return points[place]
    if body is None:
        raise InputError(f"{key}: expected points of the rigid body by name ({quoted(points)}), found {place:g}")
    slack = 1e-9 * body.length
    if not -slack <= place <= body.length + slack:
        raise InputError(f"{key}: expected places within the link, 0 … {body.length:g} m, found {place:g} m")
    return made(body.interpolate(place))


def _scaled(chosen: PointSet) -> Array:
    """The scaled L_a of the undeformed body."""
    n = len(chosen.scale) - 3
    L_a: Array = chosen.equations().L_a(np.zeros(n))
    return chosen.scale[:, None] * L_a


def _check_rank(key: str, chosen: PointSet) -> None:
    sizes = np.linalg.svd(_scaled(chosen), compute_uv=False)
    rank = int(np.count_nonzero(sizes > DEPENDENT * sizes[0]))
    if rank < len(chosen.names):
        raise InputError(
            f"{key}: expected components that differ in what they do to the body, found {len(chosen.names)} of which"
            f" only {rank} are independent: axial ones coincide where no mode moves along the link, and it has"
            f" {len(chosen.scale)} coordinates"
        )
