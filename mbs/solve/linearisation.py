"""The equations of motion, linear about a configuration or a motion, in independent coordinates.

M δs̈ + D δṡ + K δs = Σ inputs · δu, where
s = (motor coordinates, p of all bodies). About a motion the matrices belong to it: centrifugal and Coriolis terms, the
forces that drive it, and how H = ∂q/∂s turns along it are in D and K.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np

from ...common.arrays import Array
from ...common.errors import SolveError
from .. import _core
from ..joints.measure import FRAME, GROUND_FRAME, Marker, Measure, marker_at
from ..model.masses import system_mass_matrix
from ..model.model import ZERO, Constraint, Model
from ..model.system import MechanismSystem
from ..model.tree_layout import NotInTreeError
from .absolute_linearisation import AbsoluteLinearisation
from .gradients import gradient_rates, gradients
from .tree_linearisation import TreeLinearisation

DEPENDENT = 1e-8  # of a row's gradient, what others must leave of it to count as independent


@dataclass(frozen=True)
class LinearMechanism:
    """M δs̈ + D δṡ + K δs = inputs · δu about (time, q, v, a); f independent coordinates s.

    Attributes:
        M, D, K: (f, f).
        inputs: (f,) per unit of each motor ("joint/NAME") and force at a point ("force/BODY.POINT/x", "…/y").
        outputs: (f,) derivatives of joint coordinates ("joint/NAME"), of motors behind gears that give ("motor/NAME"),
            and places of points ("point/BODY.POINT/x", …).
        transformation: H = ∂q/∂s (coordinates, f).
        transformation_rate: its rate along the motion: δv = H δṡ + H_dot δs.
        force: (f,) what drives the motion itself: forces along the independent rows, modal forces beside the loads.
        names: (f,) of s: "joint/NAME" (or what was chosen instead), then "modal/BODY/k", k from 1.
    """

    time: float
    q: Array
    v: Array
    a: Array
    M: Array
    D: Array
    K: Array
    inputs: Mapping[str, Array]
    outputs: Mapping[str, Array]
    transformation: Array
    transformation_rate: Array
    force: Array
    names: tuple[str, ...]

    def modal(self, body: str) -> list[int]:
        """Where in s the modal coordinates of a body are."""
        return [i for i, name in enumerate(self.names) if name.startswith(f"modal/{body}/")]


class Linearisation:
    """What `linearise` needs of a model at every configuration: joints only, drives are loads of the scene.

    `independent` rows are the motors' where these fit the mechanism. Where they do not, as many of them as are
    independent, then other joint coordinates, then angles and places of frames make up the number, those first that
    the constraints determine worst at `q` (QR with pivoting). `points` ("BODY.POINT") are in- and outputs; a mapping
    says where each is in the model, where that is another body's point (of a link in pieces).
    """

    def __init__(self, model: Model, q: Array, points: Sequence[str] | Mapping[str, str] = ()) -> None:
        joints = {f"joint/{name}": measure for name, measure in _joint_coordinates(model).items()}
        elastic = {gear.joint for gear in model.gears}
        motors = {
            f"{'motor' if name in elastic else 'joint'}/{name}": measure for name, measure in model.motors.items()
        }
        candidates = [motors, {name: joint for name, joint in joints.items() if name not in motors}, _frames(model)]
        where = points if isinstance(points, Mapping) else {point: point for point in points}
        places = {f"{point}/{axis}": _place(place, axis) for point, place in where.items() for axis in "xy"}
        measures = [measure for group in (*candidates, joints, places) for measure in group.values()]
        self.model = model
        self.assembly = MechanismSystem(model, model.joints, model.loads, measures)
        core = iter(self.assembly.motor_measures)
        known = [{name: next(core) for name in group} for group in (*candidates, joints, places)]
        self._motors = {f"joint/{name}": row for name, row in zip(model.motors, known[0].values(), strict=True)}
        self._joints = {name: row for name, row in known[0].items() if name not in known[3]} | known[3]
        self._places = known[4]
        independent = _choose(self.assembly, q, known[:3])
        self.independent = list(independent.values())
        by_name = {name: measure for group in candidates for name, measure in group.items()}
        self._rows = [by_name[name] for name in independent]
        self.tree = _on_tree(model, self._rows)
        modal = [f"modal/{body.name}/{k}" for body in model.bodies for k in range(1, body.n_modes + 1)]
        self.names = (*independent, *modal)

    def at(self, t: float, q: Array, v: Array, a: Array) -> LinearMechanism:
        """The linear equations about a motion whose q, v and a meet the joint constraints.

        Raises `SolveError` in a configuration in which the independent coordinates do not determine the others.
        """
        rows = [*self.assembly.constraint_measures, *self.independent]
        G, frames = gradients(self.assembly, rows, q), self.assembly.frame_coordinates
        if not 1.0 / np.linalg.cond(G[:, frames], 1) > DEPENDENT**2:
            independent = ", ".join(self.names[: len(self.independent)])
            raise SolveError(
                f"{self.model.scene.path}: linear model at t = {t:g} s: {independent} do not determine the"
                " configuration there (a singular one)"
            )
        H = self._followers(G)
        H_dot = np.zeros_like(H)
        H_dot[frames] = -np.linalg.solve(G[:, frames], gradient_rates(self.assembly, rows, q, v) @ H)
        force = H.T @ self.assembly.system.required_forces(np.array([t]), q[None], v[None], a[None])[0]
        M = H.T @ system_mass_matrix(self.assembly, q) @ H
        if self.tree is not None:
            resistance = self.tree.at(t, q, v, a, force, M)
        else:
            resistance = self.absolute.at(t, q, v, a, H, H_dot)
        inputs = self._motors | {f"force/{place}": row for place, row in self._places.items()}
        outputs = self._joints | {f"point/{place}": row for place, row in self._places.items()}
        return LinearMechanism(
            t, q, v, a, M, resistance.D, resistance.K,
            self._gradients(inputs, H, q), self._gradients(outputs, H, q), H, H_dot, force, self.names,
        )  # fmt: skip

    @cached_property
    def absolute(self) -> AbsoluteLinearisation:
        """In absolute coordinates, where nothing is missing; made where it is asked for."""
        return AbsoluteLinearisation(self.model, self._rows)

    def _followers(self, G: Array) -> Array:
        """H (coordinates, f) by the gradients of joints and of what is independent: frames follow this, and p."""
        frames, independent = self.assembly.frame_coordinates, len(self.independent)
        modes = np.setdiff1d(np.arange(G.shape[1]), frames)
        H = np.zeros((G.shape[1], len(self.names)))
        H[modes, independent:] = np.eye(len(modes))
        of_s = np.eye(len(G))[:, len(G) - independent :]
        H[frames] = np.linalg.solve(G[:, frames], np.hstack([of_s, -G[:, modes]]))
        return H

    def _gradients(self, rows: dict[str, _core.Measure], H: Array, q: Array) -> Mapping[str, Array]:
        found = gradients(self.assembly, list(rows.values()), q) @ H
        return MappingProxyType(dict(zip(rows, found, strict=True)))


def _on_tree(model: Model, independent: Sequence[Measure]) -> TreeLinearisation | None:
    """None of what the recursion does not have, which is told in absolute coordinates."""
    try:
        return TreeLinearisation(model, independent)
    except NotInTreeError:
        return None


def linearise(model: Model, t: float, q: Array, v: Array, a: Array, points: Sequence[str] = ()) -> LinearMechanism:
    """The linear equations about one configuration or instant of a motion; see `Linearisation` for many."""
    return Linearisation(model, q, points).at(t, q, v, a)


def held_by_motors(model: Model, q: Array) -> list[Constraint]:
    """Constraints that keep the motor coordinates where they are at q."""
    free = [Constraint(row, ZERO, name, "motor", is_trajectory=True) for name, row in model.motors.items()]
    assembly = MechanismSystem(model, free)
    values = assembly.system.constraints(0.0, q, np.zeros_like(q))[0]
    targets = [_core.TimeFunction.constant(float(value)) for value in values]
    return [replace(c, target=target) for c, target in zip(assembly.constraints, targets, strict=True)]


def _joint_coordinates(model: Model) -> dict[str, Measure]:
    """Coordinates of the joints that move, by name; a motor's is the measure that it drives."""
    own = {joint.name: joint.coordinate(model.scene.motors) for joint in model.scene.joint}
    driven = model.motors | {gear.joint: gear.coordinate for gear in model.gears}
    return {name: driven.get(name, measure) for name, measure in own.items() if measure is not None}


def _frames(model: Model) -> dict[str, Measure]:
    """Angles and places of the frames."""
    return {
        f"frame/{body.name}/{kind.name}": Measure(f"frame of {body.name}", kind, GROUND_FRAME, Marker(body.name, FRAME))
        for kind in (_core.MeasureKind.angle, _core.MeasureKind.x, _core.MeasureKind.y)
        for body in model.bodies
    }


def _place(point: str, axis: str) -> Measure:
    return Measure(f"{point}/{axis}", getattr(_core.MeasureKind, axis), GROUND_FRAME, marker_at(point))


def _choose(
    assembly: MechanismSystem, q: Array, groups: Sequence[Mapping[str, _core.Measure]]
) -> dict[str, _core.Measure]:
    """The rows that, with the joints, determine the frames: earlier groups first, those of a group as QR pivots."""
    from scipy.linalg import qr

    frames = assembly.frame_coordinates
    basis = np.linalg.qr(gradients(assembly, assembly.constraint_measures, q)[:, frames].T)[0]
    chosen: dict[str, _core.Measure] = {}
    for group in groups:
        missing = len(frames) - basis.shape[1]
        if not missing or not group:
            continue
        rows = gradients(assembly, list(group.values()), q)[:, frames]
        Q, R, order = qr((rows - (rows @ basis) @ basis.T).T, mode="economic", pivoting=True)
        independent = np.abs(np.diag(R)) > DEPENDENT * np.linalg.norm(rows, axis=1).max()
        count = min(missing, int(np.count_nonzero(independent)))
        names = list(group)
        chosen |= {names[i]: group[names[i]] for i in sorted(order[:count])}
        basis = np.hstack([basis, Q[:, :count]])
    return chosen
