"""Actuation points (Shabana 2022, Eqs. 5–10): generalized driving forces of a body as forces along x, y, z. SI units.

Forces F_a at points of a body are generalized forces L_a F_a, with a column [e; u × e; Φᵀe] for a unit force along e at
u = x + Φp: on R and on the rotation, both in axes of the body, and on its modes. Q_a are the generalized forces of
trajectories and of prescribed shapes.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import combinations
from types import MappingProxyType
from typing import Annotated

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError, check_known, quoted
from ..common.libraries import scipy
from ..common.structs import struct
from ..common.validation import Record
from ..fe_models.modal_body import ModalBody
from ..mbs.fields.field_types import Name, Reference
from ..mbs.fields.spelling import IN_PLANE, IN_SPACE
from ..mbs.model.body import Body, BodyPoint
from ..mbs.model.system import path_forces, path_forces_on_bodies
from ..mbs.run.record import Run
from ..mbs.scene.space import SPACES, Space

DEPENDENT = 1e-10  # ratio of singular values of L_a below which components are dependent
AXES = "xyz"
ALONG = {"x": "x", "axial": "x", "y": "y", "transverse": "y", "z": "z"}
"""The axis along which forces act at the places of a key."""

Place = float | Name
"""Where on a link: the distance from its root (m), or the name of one of its points."""


class ActuationPoints(Record):
    """Components of force on one body, equivalent to its generalized driving forces (Shabana 2022, sec. 4).

    Without points, ffrobot chooses as many independent components as possible.
    """

    body: str
    """Body with these forces."""
    x: Annotated[tuple[Place, ...], IN_SPACE] = ()
    """Points (m from the root, or a name) at which a force along the body's x axis acts."""
    y: Annotated[tuple[Place, ...], IN_SPACE] = ()
    """Points at which a force along the body's y axis acts."""
    z: Annotated[tuple[Place, ...], IN_SPACE] = ()
    """Points at which a force along the body's z axis acts."""
    axial: Annotated[tuple[Place, ...], IN_PLANE] = ()
    """Points (m from the root, or a name) at which a force along the body's x axis acts."""
    transverse: Annotated[tuple[Place, ...], IN_PLANE] = ()
    """Points at which a force along the body's y axis acts."""

    @property
    def places(self) -> list[tuple[str, Place]]:
        """Key and place (m from the root, or a point's name) of each component of force."""
        return [(key, place) for key in ALONG for place in getattr(self, key)]

    def references(self) -> Iterator[Reference]:
        """Yield references to the body and to its named points."""
        yield Reference("body", self.body)
        for key, place in self.places:
            if isinstance(place, str):
                yield Reference(key, f"{self.body}.{place}")


@struct
class PointSet:
    """Components of force, c in all, at points of one body with n modes; SI units."""

    body: str  # its name
    names: tuple[str, ...]  # of each component's point
    axes: tuple[str, ...]  # "x", "y" or "z" of the body along which each component acts
    points: tuple[BodyPoint, ...]  # point of each component
    scale: Array  # (6 + n,) factors from generalized forces to forces in N: 1, 1/length, √mass

    @property
    def direction(self) -> Array:
        """Unit vectors (3, c), no unit, of the c force components, body axes."""
        return np.eye(3)[:, [AXES.index(axis) for axis in self.axes]]

    def of_core(self) -> tuple[Array, Array, Array, Array]:
        """Directions (3, c), positions (3, c), m, shapes (3 c, n), 1/√kg, `scale` (6 + n,), SI, for the core."""
        position = np.transpose([point.position for point in self.points])
        return self.direction, position, np.vstack([point.translation for point in self.points]), self.scale

    def L_a(self, p: Array) -> Array:
        """Generalized forces (T, 6 + n, c), N, N·m, N/√kg, of 1 N per force at p (T, n), m·√kg; body axes."""
        columns = []
        for e, point in zip(self.direction.T, self.points, strict=True):
            u = point.position + p @ point.translation.T
            on_modes = np.broadcast_to(point.translation.T @ e, p.shape)
            columns.append(np.hstack([np.broadcast_to(e, u.shape), np.cross(u, e), on_modes]))
        return np.stack(columns, axis=2)

    def scaled(self, p: Array) -> Array:
        """`L_a` (T, 6 + n, c) at p (T, n), m·√kg, times `scale`: forces in N."""
        return self.scale[:, None] * self.L_a(p)


def make_point_set(layout: ActuationPoints, body: ModalBody | None, spatial: Body, space: Space) -> PointSet:
    """The components of force in `layout`, or, if it has none, independent ones that are well conditioned.

    `body` is the modal body, None of a rigid body; `spatial` its equations. Raises `InputError` for places that the
    body does not have, for more components than coordinates, and for dependent components; in the plane also for a
    body whose points cannot carry all its generalized forces.
    """
    coordinates = len(space.translations) + len(space.rotations) + spatial.n_modes
    if not layout.places:
        chosen = _automatic(layout.body, body, spatial, "".join(AXES[k] for k in space.translations))
        if space.is_plane and len(chosen.names) < coordinates:  # in 3D forces on an axis do not turn about it
            raise InputError(
                f"expected points that carry all {coordinates} generalized forces of the body",
                f"{len(chosen.names)} independent components among all its stations",
            )
        return chosen
    if len(layout.places) > coordinates:
        raise InputError(
            f"expected at most as many components as the body has coordinates ({coordinates})",
            len(layout.places),
        )
    points = [_point(place, body, spatial) for _, place in layout.places]
    for (i, (along, first)), (k, (other, second)) in combinations(enumerate(layout.places), 2):
        near = 1e-9 * (spatial.length or 0.0)
        if along == other and np.allclose(points[i].position, points[k].position, rtol=0, atol=near):
            raise InputError(
                f"{along}: expected points apart from each other", f"two at {first} and {second} that coincide"
            )
    chosen = _named(layout.body, tuple(ALONG[along] for along, _ in layout.places), points, spatial)
    sizes = np.linalg.svd(chosen.scaled(np.zeros((1, spatial.n_modes)))[0], compute_uv=False)
    rank = int(np.count_nonzero(sizes > DEPENDENT * sizes[0]))
    if rank < len(points):
        along_x = "axial ones" if space.is_plane else "those along x"
        raise InputError(
            "expected components that differ in what they do to the body",
            f"{len(points)} of which only {rank} are independent: {along_x} coincide without axial modes, and it has"
            f" {coordinates} coordinates",
        )
    return chosen


def with_points(spatial: Body, chosen: PointSet) -> Body:
    """The body with the actuation points among its points."""
    own = dict(zip(chosen.names, chosen.points, strict=True))
    return replace(spatial, points=MappingProxyType({**spatial.points, **own}))


def _automatic(name: str, body: ModalBody | None, spatial: Body, axes: str) -> PointSet:
    """Of all components at the stations of a link, or the points of a rigid body, the first in QR with pivoting."""
    if body is not None:
        points = [_section(x, body, spatial) for x in body.stations.position[:, 0]]
    elif not (points := list(spatial.points.values())):
        raise InputError("expected a rigid body with points", "none")
    candidates = _named(name, tuple(axis for axis in axes for _ in points), points * len(axes), spatial)
    _, R, order = scipy.linalg.qr(candidates.scaled(np.zeros((1, spatial.n_modes)))[0], mode="economic", pivoting=True)
    sizes = np.abs(np.diag(R))
    kept = sorted(order[: int(np.count_nonzero(sizes > DEPENDENT * sizes[0]))])
    return _named(name, tuple(candidates.axes[k] for k in kept), [candidates.points[k] for k in kept], spatial)


def _named(name: str, axes: tuple[str, ...], points: list[BodyPoint], spatial: Body) -> PointSet:
    # Moments on a body are measured against forces by its length
    length = spatial.length or max(float(np.linalg.norm(at.position)) for at in spatial.points.values()) or 1.0
    scale = np.repeat([1.0, 1.0 / length, np.sqrt(spatial.mass)], [3, 3, spatial.n_modes])
    return PointSet(name, tuple(f"actuation{k}" for k in range(1, len(points) + 1)), axes, tuple(points), scale)


def _point(place: Place, body: ModalBody | None, spatial: Body) -> BodyPoint:
    """The point of a body with a name, or the section at a distance (m) from the root of its link."""
    points = spatial.points
    if isinstance(place, str):
        check_known(place, points, f"expected a point of the body ({quoted(points)})")
        return points[place]
    if body is None:
        raise InputError(f"expected points of the rigid body by name ({quoted(points)})", f"{place:g}")
    slack = 1e-9 * body.length
    if not -slack <= place <= body.length + slack:
        raise InputError(f"expected places within the link, 0 … {body.length:g} m", f"{place:g} m")
    return _section(body.begin + place, body, spatial)


def _section(x: float, body: ModalBody, spatial: Body) -> BodyPoint:
    at, T = body.interpolate(x), spatial.modal_transform
    return BodyPoint(at.position, at.translation @ T, at.rotation @ T)


@struct
class PointForces:
    """Forces at the actuation points of one body over time."""

    force: Array  # (T, c) N along each component, body axes
    # (T, 6 + n) driving forces Q_a − L_a F_a on R and on the rotation, both in axes of the body, and on p: N, N·m,
    # N/√kg; in the plane (T, 3 + n) on (R, θ, p), R in global axes
    unmet: Array
    residual: Array  # (T,) N, norm of `unmet` times `PointSet.scale`
    # least rank and largest condition number of L_a (`PointSet.scaled`) over time
    rank: int
    condition_number: float


def solve_points(chosen: PointSet, run: Run) -> PointForces:
    """Solve L_a F_a = Q_a by least squares: forces F_a at points of a body from its driving forces, at all outputs."""
    node = run.model.tree.nodes[run.model.tree.index[chosen.body]]
    Q_a = find_driving_forces(run)[chosen.body]
    p = run.q[:, node.p_q]
    scaled = chosen.scaled(p)
    force = np.einsum("tck,tk->tc", np.linalg.pinv(scaled, rcond=DEPENDENT), chosen.scale * Q_a)
    unmet = Q_a - np.einsum("tkc,tc->tk", chosen.L_a(p), force)
    residual = np.linalg.norm(unmet * chosen.scale, axis=1)
    sizes = np.linalg.svd(scaled, compute_uv=False)
    rank = int(np.count_nonzero(sizes > DEPENDENT * sizes[:, :1], axis=1).min())
    condition = float((sizes[:, 0] / sizes[:, -1]).max())
    if (space := SPACES[run.model.scene.space]).is_plane:
        F = run.model.tree.places(run.q).frame(run.model.tree.index[chosen.body]).F
        on_frame = np.einsum("tij,tj->ti", F, unmet[:, :3])
        unmet = np.column_stack([space.along(on_frame), space.about(unmet[:, 3:6]), unmet[:, 6:]])
    return PointForces(force, unmet, residual, rank, condition)


def forces_at_points(chosen: Mapping[str, PointSet], run: Run) -> dict[str, Array]:
    """Forces (T, 3), N, global axes, by "BODY.POINT" along the motion of a run.

    Raises `InputError` where a body without points has driving forces.
    """
    tree, at_points = run.model.tree, {}
    driven = find_driving_forces(run)
    largest = max(float(np.abs(Q_a).max(initial=0.0)) for Q_a in driven.values())
    for body, Q_a in driven.items():
        if body not in chosen and np.abs(Q_a).max(initial=0.0) > DEPENDENT * largest:
            raise InputError(
                f'{run.model.scene.path}: analysis "{run.analysis.name}": expected [[actuation_points]] on every body'
                " that trajectories drive or that has a prescribed shape",
                f'none on "{body}"',
            )
    places = tree.places(run.q)
    for body, points in chosen.items():
        F = places.frame(tree.index[body]).F
        force = solve_points(points, run).force
        for k, name in enumerate(points.names):
            at_points[f"{body}.{name}"] = force[:, k : k + 1] * (F @ points.direction[:, k])
    return at_points


def find_driving_forces(run: Run) -> dict[str, Array]:
    """Driving forces Q_a (T, 6 + n) by body: N, N·m on its frame, in its axes, and N/√kg on its n modes."""
    model = run.model
    by_body = path_forces_on_bodies(model, run.time, run.q, run.multipliers)
    if run.required is not None:  # forces on the modes alone, for a prescribed shape
        held = run.required - path_forces(model, run.time, run.q, run.multipliers)
        for node in model.tree.nodes:
            by_body[node.body.name][:, 6:] += held[:, node.p_v]
    return by_body
